#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/wall_time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::mqtt {

/// Something whose state is published.
struct Subject {
    enum class Kind : std::uint8_t { line, station, point };
    Kind kind = Kind::point;
    std::string name;
    std::size_t station = 0;  ///< of a point: the number of its station's subject
    std::string unit{};       ///< of a point, as the rest
    points::Type type = points::Type::u16;
    bool scaled = false;  ///< its value is no raw number

    friend bool operator==(const Subject&, const Subject&) = default;
};

/// What is published, in one order: lines; then each station with its points behind it. A subject's
/// number is its place, and stays what it is.
class Subjects {
  public:
    void add_line(std::string name);
    /// Of the points that follow.
    void add_station(std::string name);
    void add_point(const points::Point& point);

    std::size_t size() const { return all_.size(); }
    const Subject& operator[](std::size_t subject) const { return all_[subject]; }
    /// Where the points of a station end; they begin behind it.
    std::size_t end_of(std::size_t station) const;
    const std::string& station_of(std::size_t point) const {
        return all_[all_[point].station].name;
    }
    /// Which one has the names of this of others.
    std::optional<std::size_t> find_same(const Subjects& others, std::size_t subject) const;
    friend bool operator==(const Subjects&, const Subjects&) = default;
    std::optional<std::size_t> find_line(std::string_view name) const;
    std::optional<std::size_t> find_station(std::string_view name) const;
    std::optional<std::size_t> find_point(std::size_t station, std::string_view name) const;
    std::optional<std::size_t> find_point(std::string_view station, std::string_view name) const;

  private:
    std::optional<std::size_t> find(Subject::Kind kind, std::string_view name) const;

    std::vector<Subject> all_;
};

/// What is known of a subject.
struct State {
    /// Of a point: nothing where there is none. Of a line: it is up. Of a station: it may answer.
    std::optional<points::Value> value;
    std::string text;  ///< of a point: its label; else the word for its state
    points::Quality quality = points::Quality::good;
    WallTime time;  ///< since when; of a point's value: when it was read

    /// Whatever their times are.
    bool same_as(const State& other) const {
        return value == other.value && text == other.text && quality == other.quality;
    }
};

/// The last state of each subject; nothing before it has one.
using States = std::vector<std::optional<State>>;

/// A subject's state has become another.
struct Change {
    std::uint64_t number = 0;  ///< grows
    std::size_t subject = 0;
    State state{};
};

}  // namespace panelgate::mqtt
