#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/mqtt/kept.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/mqtt/store.hpp"
#include "panelgate/mqtt/subjects.hpp"
#include "panelgate/mqtt/wording.hpp"

namespace panelgate::mqtt {

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
