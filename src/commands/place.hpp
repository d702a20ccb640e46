#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::commands {

/// A place of a station as typed: a notation, TABLE/ADDRESS or a point's name.
struct Place {
    std::string station;
    std::string place;
    friend bool operator==(const Place&, const Place&) = default;
};

/// Places, or what is wrong with the words, as one sentence without a full stop.
struct Places {
    std::vector<Place> list;
    std::string wrong;
};

/// Understands the words of a command: "oven temperature GDT108", "oven/temperature press/UW0",
/// "floor1/17 coils/4", "floor1/17/coils/4". Words behind a station that was named alone are
/// places of it; behind its first place the name of one of `stations` begins the next station.
Places places_of(std::span<const std::string> words, std::span<const std::string> stations = {});
/// True if the word holds a place behind its station ("oven/temperature"; not "floor1/17").
bool holds_place(std::string_view word);

/// A station as the gateway lists it.
struct Station {
    std::string name;
    std::string line;
    unsigned id = 0;
};
/// A station's name for REST (LINE:ID where it is not listed), or what is wrong with the typed one.
struct Named {
    std::string name;
    std::string wrong;
};
/// `typed`: a name, an id that only one line has, or LINE/ID, listed or not.
Named find_station(std::span<const Station> all, const std::string& typed);
/// The same as a station; of one that is not listed `name` is empty.
struct FoundStation {
    Station station;
    std::string wrong;
};
FoundStation station_of(std::span<const Station> all, const std::string& typed);

enum class PlaceKind : std::uint8_t { point, table, device };
struct Target {
    PlaceKind kind = PlaceKind::device;
    std::string path;   ///< of REST
    std::string shown;  ///< "oven/temperature", "oven GDT108"
};
/// `points`: names of the station's points; they come before notations.
Target target_of(const std::string& station, const std::string& place,
                 std::span<const std::string> points);

/// What to say of a place that the gateway does not know: its own words, and the nearest point or
/// all of them.
std::string unknown_place(const std::string& detail, const std::string& place,
                          std::span<const std::string> points);

/// "; did you mean 'oven'?", or "; there are a, b" of few names, or "".
std::string suggestion(std::string_view typed, std::span<const std::string> names);

/// Percent-encodes a segment of a path or a value of a query (RFC 3986, 2.1).
std::string escaped(std::string_view text);

/// The JSON of a typed value: a number as its digits are, true and false (also on and off), 0x1F;
/// anything else, or all if `is_text`, is a string. "" for a number with a decimal comma.
std::string json_of_value(std::string_view typed, bool is_text);
/// Returns the JSON of several typed values: a single value as a value, more as an array; "" if a
/// value has no JSON.
std::string json_of_values(std::span<const std::string> typed, bool is_text);

}  // namespace panelgate::commands
