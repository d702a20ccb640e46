#pragma once

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
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
/// "EPOCH-NUMBER", so ids of a previous run are recognised. All but is_wanted() belongs to the loop
/// of the faces; the plant publishes by an EventOutlet.
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
    explicit EventHub(const std::string& epoch = "0") : first_epoch_(epoch), epoch_(epoch) {}
    ~EventHub();
    EventHub(const EventHub&) = delete;
    EventHub& operator=(const EventHub&) = delete;

    /// Adds a listener, removed when destroyed; null if there are too many. It starts now, or after
    /// the event `last_id`.
    std::shared_ptr<Listener> listen(EventFilter filter, std::string_view last_id = {});
    /// True while events are worth composing: a listener is there, or one that has left may come
    /// back. The events that nobody has heard are kept until they are kKept; then the hub forgets
    /// all events and begins a new epoch. Any thread.
    bool is_wanted() const { return wanted_; }
    /// True if there are no listeners.
    bool is_idle();
    /// `json` is one line. Requires is_wanted().
    void publish(EventTopic topic, std::string_view json);
    /// `count` events were not published, because the way to this hub was full: all listeners have
    /// lost them.
    void lose(std::uint64_t count);
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
        std::uint64_t gone = 0;  ///< number of the last one discarded
    };

    void forget_all();

    std::string id_of(std::uint64_t number) const { return epoch_ + '-' + std::to_string(number); }
    std::optional<std::uint64_t> number_of(std::string_view id) const;
    void forget(Ring& ring);
    const Event* next(const Listener& listener) const;
    std::uint64_t missed(const Listener& listener) const;

    std::string first_epoch_;
    std::string epoch_;
    std::map<std::string, Ring, std::less<>> rings_;  ///< by type; bounded by the number of types
    std::vector<std::weak_ptr<Listener>> listeners_;
    std::uint64_t last_ = 0;
    std::size_t unheard_ = 0;  ///< events since there was a listener
    unsigned forgotten_ = 0;   ///< how often all events were forgotten
    std::atomic<bool> wanted_ = false;
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

/// The plant's way to a hub: publish() posts the event to the hub's loop. One thread.
class EventOutlet {
  public:
    /// Events on their way to the hub at most; further ones are dropped, and told to its listeners
    /// as lost.
    static constexpr std::size_t kWaiting = 16384;

    /// `loop` is the hub's; empty: the caller's, and nothing is posted.
    EventOutlet(std::shared_ptr<EventHub> hub, boost::asio::any_io_executor loop);

    /// False: an event need not be composed.
    bool is_wanted() const { return hub_->is_wanted(); }
    void publish(EventTopic topic, std::string json);
    /// As EventHub::end().
    void end();
    EventHub* hub() const { return hub_.get(); }

  private:
    void run(std::function<void(EventHub&)> work);

    std::shared_ptr<EventHub> hub_;
    boost::asio::any_io_executor loop_;
    std::shared_ptr<std::atomic<std::size_t>> waiting_ =
        std::make_shared<std::atomic<std::size_t>>(0);
    std::uint64_t dropped_ = 0;
};

}  // namespace panelgate::web
