#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::mqtt {

/// The content of one PUBLISH.
struct Message {
    std::string topic;
    std::string payload;
    int qos = 1;
    bool retain = false;

    friend bool operator==(const Message&, const Message&) = default;
};

/// Something whose state is published.
struct Subject {
    enum class Kind : std::uint8_t { line, station, point, alarm, notice };
    Kind kind = Kind::point;
    std::string name;         ///< of a notice: its topic
    std::size_t station = 0;  ///< of a point: its station's subject number
    std::string unit{};       ///< of a point, like the rest
    points::Type type = points::Type::u16;
    bool scaled = false;  ///< the value is not the raw number
    std::string text{};   ///< of a notice: its payload

    friend bool operator==(const Subject&, const Subject&) = default;
};

/// The published subjects in a fixed order: lines; then each station followed by its points; then
/// alarms and notices, of JsonTopics alone. A subject's number is its index, and never changes.
class Subjects {
  public:
    void add_line(std::string name);
    /// Adds a station; the points added next belong to it.
    void add_station(std::string name);
    void add_point(const points::Point& point);
    void add_alarm(std::string name);
    /// Adds a message that never changes.
    void add_notice(std::string topic, std::string payload);

    std::size_t size() const { return all_.size(); }
    const Subject& operator[](std::size_t subject) const { return all_[subject]; }
    /// Returns the end of a station's points, which start after the station.
    std::size_t end_of(std::size_t station) const;
    const std::string& station_of(std::size_t point) const {
        return all_[all_[point].station].name;
    }
    /// Returns the subject with the same names as `subject` of `others`.
    std::optional<std::size_t> find_same(const Subjects& others, std::size_t subject) const;
    friend bool operator==(const Subjects&, const Subjects&) = default;
    std::optional<std::size_t> find_line(std::string_view name) const;
    std::optional<std::size_t> find_station(std::string_view name) const;
    std::optional<std::size_t> find_alarm(std::string_view name) const;
    std::optional<std::size_t> find_notice(std::string_view topic) const;
    std::optional<std::size_t> find_point(std::size_t station, std::string_view name) const;
    std::optional<std::size_t> find_point(std::string_view station, std::string_view name) const;

  private:
    std::optional<std::size_t> find(Subject::Kind kind, std::string_view name) const;

    std::vector<Subject> all_;
};

/// The state of a subject.
struct State {
    /// Of a point: nullopt if it has none. Of a line: it is up. Of a station: it may answer.
    std::optional<points::Value> value;
    std::string text;  ///< of a point: its label; otherwise the name of its state
    points::Quality quality = points::Quality::good;
    WallTime time;       ///< since when; of a point's value: when it was read
    std::string body{};  ///< of an alarm: its payload, as of the moment of the state

    /// Compares value, text and quality.
    bool same_as(const State& other) const {
        return value == other.value && text == other.text && quality == other.quality;
    }
};

/// The last state of each subject; nullopt before the first.
using States = std::vector<std::optional<State>>;

/// A change of a subject's state.
struct Change {
    std::uint64_t number = 0;  ///< increasing
    std::size_t subject = 0;
    State state{};
};

/// A point write requested through the broker.
struct WriteCommand {
    std::size_t point = 0;  ///< its subject
    points::Value value;
    std::string id{};  ///< JSON, returned with the result; empty: none
};
/// An invalid write request.
struct BadCommand {
    std::string topic;  ///< it was received on
    std::string why;    ///< human-readable
    std::string id{};
};
/// A request to publish everything again.
struct Rebirth {};
using Command = std::variant<WriteCommand, BadCommand, Rebirth>;

/// The result of a write.
struct WriteResult {
    std::string topic;  ///< the write was received on
    std::string id;     ///< of the write
    std::string body;   ///< a JSON object with the outcome
};

/// The message format of subjects and states. Pure except for its record of births and sequence
/// numbers. Messages must be sent in the order in which they were made.
class MessageFormat {
  public:
    virtual ~MessageFormat() = default;

    /// Returns the last will for a new connection.
    virtual Message will() = 0;
    /// Returns the message sent before disconnecting.
    virtual Message farewell(WallTime now) = 0;
    /// Returns the topic filters, all subscribed with QoS 0: no duplicates, no stale messages.
    virtual std::vector<std::string> subscriptions() const = 0;

    /// Returns all retained topics, published yet or not.
    virtual std::vector<std::string> retained() const = 0;

    /// Number of birth steps before the stored changes, and after them.
    virtual std::size_t steps_before() const = 0;
    virtual std::size_t steps_behind() const = 0;
    /// Returns the message of a birth step, nullopt if it has none. `next_change`: the number of
    /// the next change.
    virtual std::optional<Message> before(std::size_t step, const States& states,
                                          std::uint64_t next_change, WallTime now) = 0;
    virtual std::optional<Message> behind(std::size_t step, const States& states) = 0;
    /// Returns the message of a change; nullopt if a birth covers it.
    virtual std::optional<Message> change(const Change& change, const States& states,
                                          std::uint64_t next_change, WallTime now) = 0;

    /// Parses a message received from the broker. `retained`: it is of unknown age.
    virtual std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                          bool retained) const = 0;
    /// Returns the topic on which writes of this point are received.
    virtual std::string topic_of(std::size_t point) const = 0;
    /// Returns the message of a write result; nullopt if the format has none.
    virtual std::optional<Message> result(const WriteResult& result) const = 0;
};

}  // namespace panelgate::mqtt
