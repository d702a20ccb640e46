#include "place.hpp"

#include <algorithm>
#include <array>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>
#include <boost/json/value.hpp>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <optional>
#include <utility>

#include "panelgate/base/text.hpp"

namespace panelgate::commands {

namespace {

constexpr std::array<std::string_view, 4> kTables{"coils", "discrete-inputs", "input-registers",
                                                  "holding-registers"};
constexpr unsigned kMostId = 255;  // the gateway refuses an id above 247 that is not listed
constexpr std::size_t kFew = 8;    // names that are all listed

bool is_table(std::string_view word) { return std::ranges::find(kTables, word) != kTables.end(); }

std::optional<unsigned> id_in(std::string_view word) {
    unsigned id = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return id >= 1 && id <= kMostId ? std::optional(id) : std::nullopt;
}

/// A word as the station and the place in it; a part that is not there is empty.
Place parts_of(std::string_view word) {
    const std::size_t first = word.find('/');
    if (first == word.npos) return {std::string(word), ""};
    const std::size_t second = std::min(word.find('/', first + 1), word.size());
    if (is_table(word.substr(0, first)) && second == word.size()) return {"", std::string(word)};
    if (!id_in(word.substr(first + 1, second - first - 1)))
        return {std::string(word.substr(0, first)), std::string(word.substr(first + 1))};
    const std::size_t rest = std::min(second + 1, word.size());
    return {std::string(word.substr(0, second)), std::string(word.substr(rest))};
}

std::string all_of(std::span<const std::string> names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

Named of_id(std::span<const Station> all, unsigned id) {
    std::vector<std::string> places;
    Named found;
    for (const Station& station : all) {
        if (station.id != id) continue;
        found.name = station.name;
        places.push_back(station.line + '/' + std::to_string(id));
    }
    if (places.size() == 1) return found;
    const std::string number = std::to_string(id);
    if (places.empty())
        return {"", "no station has the id " + number + "; one that is not listed is LINE/" +
                        number + ", such as floor1/" + number};
    return {"", "station " + number + " is on several lines: " + all_of(places)};
}

Named of_line(std::span<const Station> all, const std::string& line, std::string_view number,
              std::span<const std::string> lines) {
    const auto id = id_in(number);
    if (!id) return {"", "LINE/ID has an id from 1 to 255, not '" + std::string(number) + '\''};
    for (const Station& station : all)
        if (station.line == line && station.id == *id) return {station.name, ""};
    if (std::ranges::find(lines, line) != lines.end() || lines.empty())
        return {line + ':' + std::to_string(*id), ""};
    return {"", "there is no line '" + line + '\'' + suggestion(line, lines)};
}

std::string tables_text() {
    std::string text;
    for (const std::string_view table : kTables)
        text += (text.empty() ? "" : ", ") + std::string(table);
    return text;
}

/// What is wrong with a place of the form TABLE/ADDRESS; "" for any other.
std::string wrong_table(std::string_view place) {
    const std::size_t slash = place.find('/');
    if (slash == place.npos) return "";
    const std::string table(place.substr(0, slash));
    const std::string_view address = place.substr(slash + 1);
    if (is_table(table)) {
        if (!address.empty()) return "";
        return "an address is missing after '" + std::string(place) + "', such as " + table + "/4";
    }
    const bool is_number =
        !address.empty() && address.find_first_not_of("0123456789") == address.npos;
    if (!is_number) return "";
    return "there is no table '" + table + "'; there are " + tables_text();
}

/// Of a station that `next` follows.
std::string no_place(const std::string& station, std::string_view next) {
    // "holdings/4" alone is a station of a line; behind "press" it is meant as a place.
    std::string wrong = station.find('/') == station.npos ? wrong_table(next) : "";
    if (!wrong.empty()) return wrong;
    return "a place is missing after '" + station +
           "': a notation such as UW100, TABLE/ADDRESS such as holding-registers/4, or a point's "
           "name";
}

}  // namespace

bool holds_place(std::string_view word) {
    const Place parts = parts_of(word);
    return !parts.station.empty() && !parts.place.empty();
}

Places places_of(std::span<const std::string> words, std::span<const std::string> stations) {
    Places made;
    std::string station;    // that was named alone
    bool has_place = true;  // of it
    for (const std::string& word : words) {
        if (word.empty()) continue;
        Place parts = parts_of(word);
        std::string wrong = wrong_table(parts.station.empty() ? word : parts.place);
        if (!wrong.empty()) return {{}, std::move(wrong)};
        const bool begins = has_place && std::ranges::find(stations, word) != stations.end();
        const bool is_plain = !begins && (parts.station.empty() || word.find('/') == word.npos);
        if (parts.station.empty() && station.empty())
            return {{}, "a station is missing before '" + word + "', such as oven " + word};
        if (is_plain && !station.empty()) {
            made.list.push_back({station, word});
            has_place = true;
            continue;
        }
        if (!has_place) return {{}, no_place(station, word)};
        has_place = !parts.place.empty();
        station = has_place ? "" : parts.station;
        if (has_place) made.list.push_back(std::move(parts));
    }
    if (has_place && !made.list.empty()) return made;
    return {{}, no_place(station, "")};
}

Named find_station(std::span<const Station> all, const std::string& typed) {
    std::vector<std::string> names;
    std::vector<std::string> lines;
    for (const Station& station : all) {
        if (station.name == typed) return {typed, ""};
        names.push_back(station.name);
        if (std::ranges::find(lines, station.line) == lines.end()) lines.push_back(station.line);
    }
    if (const auto id = id_in(typed)) return of_id(all, *id);
    const std::size_t slash = typed.find_first_of("/:");
    if (slash != typed.npos)
        return of_line(all, typed.substr(0, slash), std::string_view(typed).substr(slash + 1),
                       lines);
    return {"", "there is no station '" + typed + '\'' + suggestion(typed, names)};
}

FoundStation station_of(std::span<const Station> all, const std::string& typed) {
    const Named named = find_station(all, typed);
    if (!named.wrong.empty()) return {{}, named.wrong};
    const auto found = std::ranges::find(all, named.name, &Station::name);
    if (found != all.end()) return {*found, ""};
    const std::size_t colon = named.name.rfind(':');
    const auto id = id_in(std::string_view(named.name).substr(colon + 1));
    return {{"", named.name.substr(0, colon), static_cast<unsigned>(id.value_or(0))}, ""};
}

Target target_of(const std::string& station, const std::string& place,
                 std::span<const std::string> points) {
    const std::string base = "/api/v1/stations/" + escaped(station) + '/';
    if (std::ranges::find(points, place) != points.end())
        return {PlaceKind::point, base + "points/" + escaped(place), station + '/' + place};
    const std::string shown = station + ' ' + place;
    const std::size_t slash = place.find('/');
    if (slash != place.npos && is_table(std::string_view(place).substr(0, slash)))
        return {PlaceKind::table,
                base + place.substr(0, slash) + '/' + escaped(place.substr(slash + 1)), shown};
    return {PlaceKind::device, base + "devices/" + escaped(place), shown};
}

std::string unknown_place(const std::string& detail, const std::string& place,
                          std::span<const std::string> points) {
    if (points.empty()) return detail;
    const std::string near =
        nearest(place, std::vector<std::string_view>(points.begin(), points.end()));
    if (!near.empty()) return "there is no point '" + place + "'; did you mean '" + near + "'?";
    if (points.size() > kFew) return detail;
    return detail + "; its points are " + all_of(points);
}

std::string suggestion(std::string_view typed, std::span<const std::string> names) {
    const std::string near =
        nearest(typed, std::vector<std::string_view>(names.begin(), names.end()));
    if (!near.empty()) return "; did you mean '" + near + "'?";
    if (names.empty() || names.size() > kFew) return "";
    return std::string(names.size() == 1 ? "; there is " : "; there are ") + all_of(names);
}

std::string escaped(std::string_view text) {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    std::string made;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if ((byte < 0x80 && std::isalnum(byte) != 0) ||
            std::string_view("-._~:").find(c) != std::string_view::npos) {
            made += c;
        } else {
            made += '%';
            made += kDigits[byte >> 4U];
            made += kDigits[byte & 0xFU];
        }
    }
    return made;
}

namespace {

bool is_comma_number(std::string_view typed) {
    const std::size_t comma = typed.find(',');
    if (comma == typed.npos || typed.find(',', comma + 1) != typed.npos) return false;
    return std::ranges::all_of(
        typed, [](char c) { return (c >= '0' && c <= '9') || c == ',' || c == '-'; });
}

bool is_number(std::string_view typed) {
    boost::system::error_code wrong;
    const auto value = boost::json::parse(typed, wrong);
    return !wrong && value.is_number();
}

std::string hex_number(std::string_view typed) {
    std::uint64_t number = 0;
    const char* const end = typed.data() + typed.size();
    const auto [stop, error] = std::from_chars(typed.data() + 2, end, number, 16);
    return error == std::errc() && stop == end ? std::to_string(number) : "";
}

}  // namespace

std::string json_of_value(std::string_view typed, bool is_text) {
    if (!is_text) {
        if (typed == "true" || typed == "on") return "true";
        if (typed == "false" || typed == "off") return "false";
        if (is_number(typed)) return std::string(typed);
        if (typed.size() > 2 && (typed.starts_with("0x") || typed.starts_with("0X"))) {
            if (std::string number = hex_number(typed); !number.empty()) return number;
        }
        if (is_comma_number(typed)) return "";
    }
    return boost::json::serialize(boost::json::string(as_utf8(typed)));
}

std::string json_of_values(std::span<const std::string> typed, bool is_text) {
    std::string made;
    for (const std::string& one : typed) {
        const std::string text = json_of_value(one, is_text);
        if (text.empty()) return "";
        made += (made.empty() ? "" : ",") + text;
    }
    return typed.size() == 1 ? made : '[' + made + ']';
}

}  // namespace panelgate::commands
