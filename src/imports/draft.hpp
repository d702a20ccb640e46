#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/imports/import.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::imports {

/// A point of the draft. `name` and `at` of `point` are not set.
struct Tag {
    std::string name;  ///< as the other program has it
    int line = 1;      ///< of the file
    std::int64_t address = 0;
    points::Point point{};
};

/// A line of the draft: its keys with their values as YAML.
struct LineBody {
    std::string name;  ///< as the other program has it
    int line = 1;      ///< of the file
    std::string device{};
    std::string serial{};                        ///< "" for none
    std::map<std::string, std::string> waits{};  ///< timing, connect_pause
};

/// A configuration that grows tag by tag.
class Draft {
  public:
    /// `program`: whose file it is.
    Draft(std::string program, const std::string& file);

    /// Returns the index of the line with this device, adding a line for a new device; nothing if
    /// the device's line has other serial settings.
    std::optional<std::int64_t> line(const LineBody& body);
    /// Adds a point to a station. The tag's name becomes a valid name, unique at the station.
    void add(std::int64_t line, std::int64_t station, Tag tag);
    /// Something in this line of the file is not taken over.
    void note(int line, const std::string& what) { notes_.emplace(line, what); }
    /// This key of `place` is not taken over. Keys of equal places (`kind`) are told together.
    void left_over(int line, const std::string& kind, const std::string& place,
                   const std::string& key);
    /// Nothing, and problems, if no point is left.
    std::optional<Imported> made(const Check& check, yaml::Problems& problems);

  private:
    /// Line, station and point. Rows 0 of a station and of a line (station 0) are their heads.
    using Key = std::array<std::int64_t, 3>;
    /// A part of the YAML text, and where it is from.
    struct Row {
        std::string text;
        int line;  ///< of the file
        std::string what;
    };
    struct Left {
        int line;
        std::string place;
        int count = 0;
    };

    void erase(Key key);
    void tidy();
    std::string text() const;
    bool drop(const std::vector<yaml::Problem>& faults);

    std::string program_;
    std::string file_;
    std::map<Key, Row> rows_;
    std::vector<LineBody> lines_;  ///< with their names here
    std::map<std::pair<std::int64_t, std::int64_t>, std::set<std::string>> names_;
    std::multimap<int, std::string> notes_;  ///< by line of the file
    std::map<std::pair<std::string, std::string>, Left> left_;
};

// Of each program; `problems` has the file's name.

void read_kepware(std::string_view text, yaml::Problems& problems, Draft& draft);
void read_telegraf(std::string_view text, yaml::Problems& problems, Draft& draft);
void read_home_assistant(std::string_view text, yaml::Problems& problems, Draft& draft);

}  // namespace panelgate::imports
