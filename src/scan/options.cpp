#include "panelgate/scan/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <utility>

#include "attempt.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::scan {

namespace {

constexpr int kSlowest = 50;  // the configuration accepts the same
constexpr int kFastest = 4'000'000;
constexpr std::size_t kMostRates = 32;

std::optional<int> parse_number(std::string_view text) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

/// Splits at commas; "" gives one empty part.
std::vector<std::string_view> split(std::string_view text) {
    std::vector<std::string_view> parts;
    while (true) {
        const std::size_t comma = text.find(',');
        parts.push_back(text.substr(0, comma));
        if (comma == std::string_view::npos) return parts;
        text.remove_prefix(comma + 1);
    }
}

std::string quoted(std::string_view text) { return '\'' + std::string(text) + '\''; }

std::optional<std::pair<int, int>> parse_range(std::string_view text) {
    const std::size_t dash = text.find('-');
    const auto first = parse_number(text.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : parse_number(text.substr(dash + 1));
    if (!first || !last || *first < 1 || *last > modbus::kMaxStation || *first > *last)
        return std::nullopt;
    return std::pair(*first, *last);
}

}  // namespace

std::optional<std::string> parse_baud(std::string_view text, Settings& settings) {
    std::vector<int> rates;
    for (const std::string_view part : split(text)) {
        const auto rate = parse_number(part);
        if (!rate || *rate < kSlowest || *rate > kFastest || rates.size() == kMostRates) {
            return "--baud " + quoted(text) +
                   " is not a list of rates from 50 to 4000000 such as 9600,38400";
        }
        append_new(rates, *rate);
    }
    settings.baud = std::move(rates);
    return std::nullopt;
}

std::optional<std::string> parse_parity(std::string_view text, Settings& settings) {
    std::vector<Parity> parities;
    for (const std::string_view part : split(text)) {
        const auto* known =
            std::ranges::find(kParityWords, part, &std::pair<std::string_view, Parity>::first);
        if (known == kParityWords.end())
            return "--parity " + quoted(text) + " is not a list of none, even and odd";
        append_new(parities, known->second);
    }
    settings.parity = std::move(parities);
    return std::nullopt;
}

std::optional<std::vector<std::uint8_t>> station_list(std::string_view text) {
    std::set<std::uint8_t> stations;
    for (const std::string_view part : split(text)) {
        const auto range = parse_range(part);
        if (!range) return std::nullopt;
        for (int station = range->first; station <= range->second; ++station)
            stations.insert(static_cast<std::uint8_t>(station));
    }
    return std::vector<std::uint8_t>(stations.begin(), stations.end());
}

std::string station_ranges(const std::set<std::uint8_t>& stations) {
    std::string text;
    for (auto at = stations.begin(); at != stations.end();) {
        const int first = *at;
        int last = first;
        while (++at != stations.end() && *at == last + 1) ++last;
        if (!text.empty()) text += ',';
        text += std::to_string(first);
        if (last > first) text += '-' + std::to_string(last);
    }
    return text;
}

std::optional<std::string> parse_stations(std::string_view text, Settings& settings) {
    auto stations = station_list(text);
    if (!stations) return "--stations " + quoted(text) + " is not " + kStationListForm;
    settings.stations = std::move(*stations);
    return std::nullopt;
}

}  // namespace panelgate::scan
