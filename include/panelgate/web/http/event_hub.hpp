#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panelgate::web {

/// What an event is about; "" if not applicable.
struct EventTopic {
    std::string type;  ///< the value of `event:`
    std::string line;
    std::string station;
    std::string point;
    std::string about{};  ///< a station that its text is about: for may_see, no filter asks for it
};

/// Which events a client wants. An empty set allows all; otherwise the event must match an entry,
/// so an event without a station passes no station filter.
struct EventFilter {
    std::set<std::string> types;
    std::set<std::string> lines;
    std::set<std::pair<std::string, std::string>> stations;  ///< line, station
    std::set<std::pair<std::string, std::string>> points;    ///< station, point
    /// What the client has a right to; empty: everything.
    std::function<bool(const EventTopic&)> may_see{};

    bool passes(const EventTopic& topic) const;
};

/// Server-sent events: the latest of each type, numbered, and their listeners. A listener is a
/// position in that order, so a slow one costs nothing and a returning one gets what it missed.
/// Events discarded before it read them are lost, and a note gives their number. An id is
/// "EPOCH-NUMBER", so ids of a previous run are recognised. Single-threaded.
class EventHub {
  public:
    static constexpr std::size_t kListeners = 64;
    /// Kept per type: events, and bytes of their texts.
    static constexpr std::size_t kKept = 4096;
    static constexpr std::size_t kKeptBytes = 1024 * 1024;
    /// Bytes, or events examined, after which take() yields to others.
    static constexpr std::size_t kTakeBytes = 64 * 1024;
    static constexpr std::size_t kTakeExamined = 2000;
    /// Delay before clients reconnect; after an outage many do at once.
    static constexpr int kRetryMs = 2000;

    class Listener;

    /// `epoch`: a word without blanks, different in each run of the program.
    explicit EventHub(std::string epoch = "0") : epoch_(std::move(epoch)) {}
    ~EventHub();
    EventHub(const EventHub&) = delete;
    EventHub& operator=(const EventHub&) = delete;

    /// Adds a listener, removed when destroyed; null if there are too many. It starts now, or after
    /// the event `last_id`.
    std::shared_ptr<Listener> listen(EventFilter filter, std::string_view last_id = {});
    /// An event of this type occurs. True: call publish(). False: there is no listener and it could
    /// not be kept for one that returns; it is counted as lost.
    bool announce(std::string_view type);
    /// `json` is one line. Requires announce().
    void publish(EventTopic topic, std::string_view json);
    /// True if there are no listeners.
    bool is_idle();
    /// Ends all listeners after their pending events: the server stops.
    void end();

  private:
    struct Event {
        std::uint64_t number = 0;
        EventTopic topic;
        std::string text;  ///< in wire format
    };
    /// The events of one type.
    struct Ring {
        std::deque<Event> events;
        std::size_t bytes = 0;
        std::uint64_t gone = 0;   ///< number of the last one discarded
        std::size_t unheard = 0;  ///< events since there was a listener
    };

    std::string id_of(std::uint64_t number) const { return epoch_ + '-' + std::to_string(number); }
    std::optional<std::uint64_t> number_of(std::string_view id) const;
    void forget(Ring& ring);
    const Event* next(const Listener& listener) const;
    std::uint64_t missed(const Listener& listener) const;

    std::string epoch_;
    std::map<std::string, Ring, std::less<>> rings_;  ///< by type; bounded by the number of types
    std::vector<std::weak_ptr<Listener>> listeners_;
    std::uint64_t last_ = 0;
    bool was_heard_ = false;  ///< there has been a listener
};

class EventHub::Listener {
  public:
    /// Called when matching events are pending, and at the end.
    std::function<void()> wake;
    /// Returns pending events, or some of them, in wire format; "" if there are none.
    std::string take();
    /// The same, but never "": without events, a comment that keeps the connection alive and
    /// advances the position for a reconnect.
    std::string heartbeat();
    bool ended() const { return ended_; }

  private:
    friend class EventHub;
    EventHub* hub_ = nullptr;  ///< null: the hub is gone
    EventFilter filter_;
    std::string opening_;      ///< sent before the first event
    std::uint64_t place_ = 0;  ///< all up to this number were sent, skipped or lost
    std::uint64_t lost_ = 0;
    bool ended_ = false;
};

}  // namespace panelgate::web
