#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::yaml {
namespace {

struct Unit {
    std::string_view name;
    Duration length;
};
constexpr std::array<Unit, 4> kUnits{{{"min", 60s}, {"s", 1s}, {"ms", 1ms}, {"us", 1us}}};

}  // namespace

std::optional<std::int64_t> parse_integer(std::string_view text) {
    const std::string_view digits = !text.empty() && text[0] == '-' ? text.substr(1) : text;
    if (digits.empty() || (digits.size() > 1 && digits[0] == '0')) return std::nullopt;
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<Duration> parse_duration(std::string_view text) {
    const std::size_t letters = text.find_first_not_of("0123456789");
    if (letters == std::string_view::npos) return std::nullopt;
    const auto count = parse_integer(text.substr(0, letters));
    const auto unit = std::find_if(kUnits.begin(), kUnits.end(),
                                   [&](const Unit& u) { return u.name == text.substr(letters); });
    constexpr std::int64_t kMost = 1'000'000'000;
    if (!count || unit == kUnits.end() || *count > kMost) return std::nullopt;
    if (*count > Duration::max() / unit->length) return std::nullopt;
    return *count * unit->length;
}

std::string format_duration(Duration duration) {
    if (duration == Duration::zero()) return "0ms";
    for (const Unit& unit : kUnits) {
        if (duration % unit.length == Duration::zero())
            return std::to_string(duration / unit.length) + std::string(unit.name);
    }
    return std::to_string(duration.count()) + "ns";
}

}  // namespace panelgate::yaml
