#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::mqtt {

/// What one PUBLISH carries.
struct Message {
    std::string topic;
    std::string payload;
    int qos = 1;
    bool retain = false;

    friend bool operator==(const Message&, const Message&) = default;
};

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

/// The changes that the broker has not acknowledged, in their order: those that were sent first,
/// then those that wait. When it is full, the oldest that waits goes and is counted. Pure.
class Store {
  public:
    /// `limit`: changes; more than are ever sent and not acknowledged.
    explicit Store(std::size_t limit) : limit_(limit) {}

    void add(std::size_t subject, State state);
    /// The next to be sent; null: nothing waits. Stays until sent() or skip().
    const Change* next() const;
    void sent();
    /// Nothing is to be said of it.
    void skip();
    /// The broker has it; numbers that are not there any more mean nothing.
    void delivered(std::uint64_t number);
    /// Whatever was sent and not acknowledged has to be sent again.
    void lost() { sent_ = 0; }

    const std::deque<Change>& changes() const { return changes_; }
    std::size_t size() const { return changes_.size(); }
    std::size_t in_flight() const { return sent_; }
    std::uint64_t dropped() const { return dropped_; }
    /// Of the change that is added next.
    std::uint64_t next_number() const { return next_number_; }

  private:
    void erase(std::size_t place);

    std::size_t limit_;
    std::deque<Change> changes_;
    std::size_t sent_ = 0;
    std::uint64_t dropped_ = 0;
    std::uint64_t next_number_ = 1;
};

/// Somebody who publishes at the broker wants a point written.
struct WriteCommand {
    std::size_t point = 0;  ///< its subject
    points::Value value;
    std::string id{};  ///< JSON, to be told with what has become of it; empty: none
};
/// ... but what came is no write of a point.
struct BadCommand {
    std::string topic;  ///< that it came by
    std::string why;    ///< for people
    std::string id{};
};
/// Everything is to be told anew.
struct Rebirth {};
using Command = std::variant<WriteCommand, BadCommand, Rebirth>;

/// What became of a write.
struct WriteResult {
    std::string topic;  ///< that the write came by
    std::string id;     ///< of the write
    std::string body;   ///< a JSON object: what is told of it
};

/// How subjects and their states are told: the format. Pure but for what has been told: births,
/// sequence numbers. Calls stand in the order of what they make.
class Wording {
  public:
    virtual ~Wording() = default;

    /// A connection is to be made: what the broker says when it is lost.
    virtual Message will() = 0;
    /// What the gateway says before it goes.
    virtual Message farewell(WallTime now) = 0;
    /// What is subscribed to, all with quality of service 0: nothing comes twice, or late.
    virtual std::vector<std::string> subscriptions() const = 0;

    /// The topics that the broker keeps the last message of, told or not.
    virtual std::vector<std::string> retained() const = 0;

    /// How many steps a birth has, before the changes that are kept, and behind them.
    virtual std::size_t steps_before() const = 0;
    virtual std::size_t steps_behind() const = 0;
    /// A step of the birth; nothing: there is nothing to be said at it. `next_change`: the number
    /// that no change has yet.
    virtual std::optional<Message> before(std::size_t step, const States& states,
                                          std::uint64_t next_change, WallTime now) = 0;
    virtual std::optional<Message> behind(std::size_t step, const States& states) = 0;
    /// Nothing: it is told by a birth.
    virtual std::optional<Message> change(const Change& change, const States& states,
                                          std::uint64_t next_change, WallTime now) = 0;

    /// What somebody has published. `retained`: some time ago.
    virtual std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                          bool retained) const = 0;
    /// Where a write of this point comes by.
    virtual std::string topic_of(std::size_t point) const = 0;
    /// Nothing: the format has no words for it.
    virtual std::optional<Message> result(const WriteResult& result) const = 0;
};

}  // namespace panelgate::mqtt
