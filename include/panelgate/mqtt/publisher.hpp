#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
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

/// A queue of entries, each sent again until the broker acknowledges it, in order. When full, the
/// oldest waiting entry is dropped and counted. Pure.
template <class Entry>
class Kept {
  public:
    using Numbered = std::map<std::uint64_t, Entry>;

    /// `first`: the lowest number of its exclusive range. `limit`: in entries, more than are ever
    /// in flight.
    explicit Kept(std::uint64_t first, std::size_t limit = std::numeric_limits<std::size_t>::max())
        : first_(first), free_(first), next_(first), limit_(limit) {}

    void add(Entry entry) {
        const auto waits = entries_.lower_bound(next_);
        if (entries_.size() >= limit_ && waits != entries_.end()) {
            entries_.erase(waits);
            ++dropped_;
        }
        entries_.emplace_hint(entries_.end(), free_++, std::move(entry));
    }
    /// Puts an entry from before back under its own number, before any other is added.
    void restore(std::uint64_t number, Entry entry) {
        entries_.emplace(number, std::move(entry));
        free_ = std::max(free_, number + 1);
        if (entries_.size() <= limit_) return;
        entries_.erase(entries_.begin());
        ++dropped_;
    }
    /// Returns the next entry and marks it as in flight; null if none waits.
    const typename Numbered::value_type* next() {
        const auto found = entries_.lower_bound(next_);
        if (found == entries_.end()) return nullptr;
        next_ = found->first + 1;
        return &*found;
    }
    /// The broker has acknowledged it, or it need not be sent. Numbers of others are ignored.
    void delivered(std::uint64_t number) {
        if (number < next_) entries_.erase(number);
    }
    /// Entries in flight must be sent again.
    void lost() { next_ = first_; }

    std::size_t size() const { return entries_.size(); }
    const Numbered& entries() const { return entries_; }
    std::uint64_t dropped() const { return dropped_; }
    /// Returns the number of the next entry added.
    std::uint64_t next_number() const { return free_; }

  private:
    std::uint64_t first_;
    std::uint64_t free_;
    std::uint64_t next_;  ///< lower ones are in flight
    std::size_t limit_;
    std::uint64_t dropped_ = 0;
    Numbered entries_;
};

/// Decides what to send to the broker next: births, then the changes made while the broker was
/// unreachable, in order, then current states; never a state older than one already sent for the
/// same subject. Pure: time and connection events are arguments.
class Publisher {
  public:
    Publisher(const Settings& settings, Subjects subjects);
    ~Publisher();
    Publisher(const Publisher&) = delete;
    Publisher& operator=(const Publisher&) = delete;

    const Subjects& subjects() const { return *subjects_; }
    /// Takes over, before the first offer(), the previous publisher's states and unsent changes of
    /// subjects that exist here too. At the same broker, also its unacknowledged write results, and
    /// clears its retained topics that this one does not have.
    void take_over(const Publisher& before);
    /// Sets a subject's state before there is a connection, if it has none: births publish it, and
    /// it takes no room in the store.
    void know(std::size_t subject, State state);
    /// Puts a change from before back into the store, under its own number: before any offer().
    void restore(std::uint64_t number, std::size_t subject, State state) {
        store_.restore(number, {number, subject, std::move(state)});
    }
    /// Updates a subject's state. True if the state will be published: if it changed, or `again`.
    bool offer(std::size_t subject, State state, bool again = false);
    /// Publishes its current state again.
    void repeat(std::size_t subject);
    /// Queues a write result after pending changes until the broker has it; beyond
    /// Settings::results it is lost and counted. Results of refused writes have a lower limit, so
    /// that they cannot displace those of executed writes.
    void answer(const WriteResult& result, bool refused);
    /// True if the result of one more write, besides those under way, has room (P2).
    bool has_room_for_answer(std::size_t under_way) const {
        return results_.size() + under_way < settings_.results;
    }
    std::uint64_t results_dropped() const { return results_dropped_; }

    /// Returns the will for a new connection.
    Message will() { return format_->will(); }
    std::vector<std::string> subscriptions() const { return format_->subscriptions(); }
    /// The connection is up: everything is published.
    void connected();
    /// The connection is lost: unacknowledged messages are sent again.
    void disconnected();
    /// A host requested a rebirth: everything is published again; if a birth is under way, after
    /// it.
    void rebirth();
    Message farewell(WallTime now) { return format_->farewell(now); }

    struct Outgoing {
        Message message;
        std::uint64_t change = 0;  ///< for delivered(); 0: not a change
    };
    /// Returns the next message, nullopt if there is none. The caller must keep at most
    /// Settings::in_flight unacknowledged.
    std::optional<Outgoing> next(WallTime now);
    void delivered(std::uint64_t change);

    std::vector<Command> commands(std::string_view topic, std::string_view payload,
                                  bool retained) const {
        return format_->commands(topic, payload, retained);
    }
    std::string topic_of(std::size_t point) const { return format_->topic_of(point); }

    const Kept<Change>& store() const { return store_; }
    bool is_connected() const { return connected_; }

  private:
    std::optional<Message> next_before(WallTime now);
    std::optional<Message> next_behind();
    void change(std::size_t subject, State state);
    void clear_stale_topics(const Publisher& before);

    Settings settings_;
    std::unique_ptr<const Subjects> subjects_;  ///< referenced by format_
    std::unique_ptr<MessageFormat> format_;
    States states_;
    Kept<Change> store_;
    Kept<Message> results_;
    std::uint64_t results_dropped_ = 0;
    Kept<Message> cleared_;  ///< topics to clear
    bool connected_ = false;
    bool again_ = false;      ///< a rebirth follows this one
    std::size_t before_ = 0;  ///< birth steps done
    std::size_t behind_ = 0;
};

}  // namespace panelgate::mqtt
