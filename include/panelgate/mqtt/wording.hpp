#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/mqtt/message.hpp"
#include "panelgate/mqtt/subjects.hpp"

namespace panelgate::mqtt {

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
