#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/subjects.hpp"

namespace panelgate::mqtt {

/// Messages that are sent until the broker has them, in order, by numbers of their own. Pure.
class Kept {
  public:
    using Numbered = std::map<std::uint64_t, Message>;

    /// `first`: the lowest number; nobody else's.
    explicit Kept(std::uint64_t first) : first_(first), free_(first), next_(first) {}

    void add(Message message) { messages_.emplace(free_++, std::move(message)); }
    /// The next one, which is on its way now.
    std::optional<Numbered::value_type> next() {
        const auto found = messages_.lower_bound(next_);
        if (found == messages_.end()) return std::nullopt;
        next_ = found->first + 1;
        return *found;
    }
    /// Of a number that is none of these: nothing.
    void delivered(std::uint64_t number) { messages_.erase(number); }
    /// What was on its way goes again.
    void lost() { next_ = first_; }

    std::size_t size() const { return messages_.size(); }
    const Numbered& messages() const { return messages_; }

  private:
    std::uint64_t first_;
    std::uint64_t free_;
    std::uint64_t next_;  ///< those below are on their way
    Numbered messages_;
};

/// What is to be said next to the broker. Births first, then what has changed while the broker was
/// away, in its order, then what is; nothing that is sent is older than what was sent before of the
/// same subject. Pure: time is an argument, a connection is a word.
class Publisher {
  public:
    Publisher(const Settings& settings, Subjects subjects);
    ~Publisher();
    Publisher(const Publisher&) = delete;
    Publisher& operator=(const Publisher&) = delete;

    const Subjects& subjects() const { return *subjects_; }
    /// Before anything is offered: what another one knows, and has not told, of what is here too.
    /// At the same broker also the answers that it may not have, and what it has retained there and
    /// is none of this one's is cleared.
    void take_over(const Publisher& before);
    /// What is known of a subject before there is a connection, if nothing was: births tell it, and
    /// it takes no room.
    void know(std::size_t subject, State state);
    /// What is known of a subject now. Nothing new: nothing is sent. True: it was.
    bool offer(std::size_t subject, State state);
    /// Its state is sent once more.
    void repeat(std::size_t subject);
    /// Told after what waits, until the broker has it; beyond Settings::results it is lost, and
    /// counted. Of writes that were refused less find room, so that they take none from those that
    /// were carried out.
    void answer(const WriteResult& result, bool refused);
    /// Whether the answer to one more write, besides so many that are under way, has a place (P2).
    bool has_room_for_answer(std::size_t under_way) const {
        return results_.size() + under_way < settings_.results;
    }
    std::uint64_t results_dropped() const { return results_dropped_; }

    /// A connection is to be made; its will.
    Message will() { return wording_->will(); }
    std::vector<std::string> subscriptions() const { return wording_->subscriptions(); }
    /// It stands: everything is told.
    void connected();
    /// It has gone: what the broker has not acknowledged is sent again.
    void disconnected();
    /// A host has asked for it: everything is told; if that is under way, once more behind it.
    void rebirth();
    Message farewell(WallTime now) { return wording_->farewell(now); }

    struct Outgoing {
        Message message;
        std::uint64_t change = 0;  ///< for delivered(); 0: of no change
    };
    /// Nothing: nothing is to be said. Whoever sends sees to it that at most Settings::in_flight
    /// are not acknowledged.
    std::optional<Outgoing> next(WallTime now);
    void delivered(std::uint64_t change);

    std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                  bool retained) const {
        return wording_->commands(topic, payload, retained);
    }
    std::string topic_of(std::size_t point) const { return wording_->topic_of(point); }

    const Store& store() const { return store_; }

  private:
    std::optional<Message> next_before(WallTime now);
    std::optional<Message> next_behind();
    void clear_what_went(const Publisher& before);

    Settings settings_;
    std::unique_ptr<const Subjects> subjects_;  ///< the wording refers to it
    std::unique_ptr<Wording> wording_;
    States states_;
    Store store_;
    Kept results_;
    std::uint64_t results_dropped_ = 0;
    Kept cleared_;  ///< topics
    bool connected_ = false;
    bool again_ = false;      ///< a rebirth behind this one
    std::size_t before_ = 0;  ///< steps that are done
    std::size_t behind_ = 0;
};

}  // namespace panelgate::mqtt
