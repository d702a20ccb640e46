#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/imports/import.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::imports {

/// A point of the draft. `name` and `at` are not set.
struct Tag {
    std::string name;  ///< as the other program has it
    points::Point point{};
};

/// Returns "400001" of the first holding register.
std::string notation(modbus::Table table, std::int64_t address);

/// The value of a word in a list of pairs; nothing for other words.
template <class List>
auto look_up(const List& list, std::string_view word) -> std::optional<decltype(list[0].second)> {
    for (const auto& [name, value] : list)
        if (name == word) return value;
    return std::nullopt;
}

/// The map `serial` of a line; `parity` is N, E or O.
std::string serial_map(const std::string& baud, const std::string& data_bits,
                       std::string_view parity, const std::string& stop_bits, bool ascii);

/// A configuration that grows tag by tag.
class Draft {
  public:
    /// `program`: whose file it is.
    Draft(std::string program, std::string file)
        : program_(std::move(program)), file_(std::move(file)) {}

    /// Returns the index of the line with this device, adding a line for a new device. `serial`:
    /// the line's map, or "".
    std::size_t line(const std::string& name, const std::string& device, const std::string& serial);
    /// Adds a point to a station. The tag's name becomes a valid name, unique at the station.
    void add(std::size_t line, std::int64_t station, const Tag& tag);
    /// Something in this line of the file is not taken over.
    void note(int line, const std::string& what);
    Imported made() const;

  private:
    struct Line {
        std::string name;
        std::string device;
        std::string serial;
        std::map<std::int64_t, std::vector<std::string>> stations{};  ///< points, by id
        std::map<std::int64_t, std::set<std::string>> names{};
    };

    std::string program_;
    std::string file_;
    std::deque<Line> lines_;
    std::vector<std::string> notes_;
};

// Of each program; `problems` has the file's name.

std::optional<Imported> import_kepware(std::string_view text, yaml::Problems& problems);
std::optional<Imported> import_telegraf(std::string_view text, yaml::Problems& problems);
std::optional<Imported> import_home_assistant(std::string_view text, yaml::Problems& problems);

}  // namespace panelgate::imports
