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

/// What an event is about. "" where it names none.
struct EventTopic {
    std::string type;  ///< the word behind `event:`
    std::string line;
    std::string station;
    std::string point;
};

/// Which events somebody wants. What is empty allows all; otherwise an event has to name one of
/// them, so one that names no station passes no filter of stations.
struct EventFilter {
    std::set<std::string> types;
    std::set<std::string> lines;
    std::set<std::pair<std::string, std::string>> stations;  ///< line, station
    std::set<std::pair<std::string, std::string>> points;    ///< station, point

    bool passes(const EventTopic& topic) const;
};

/// Server-sent events: the last ones of each type, in order of their numbers, and those who listen.
/// Every listener is a place in that order, so it costs nothing to be slow, and who comes back is
/// given what it has missed. What is no longer there when its turn comes is lost, and a note says
/// how much. An id is "EPOCH-NUMBER": one of another life of the program is not mistaken. One
/// thread.
class EventHub {
  public:
    static constexpr std::size_t kListeners = 64;
    /// What is kept of each type: events, and bytes of their texts.
    static constexpr std::size_t kKept = 4096;
    static constexpr std::size_t kKeptBytes = 1024 * 1024;
    /// Bytes, or events looked at, after which take() lets others have their turn.
    static constexpr std::size_t kTaken = 64 * 1024;
    static constexpr std::size_t kLookedAt = 2000;
    /// After a break clients are to wait so long before they come again; some will be many.
    static constexpr int kRetryMs = 2000;

    class Listener;

    /// `epoch`: a word without blanks, another one in each life of the program.
    explicit EventHub(std::string epoch = "0") : epoch_(std::move(epoch)) {}
    ~EventHub();
    EventHub(const EventHub&) = delete;
    EventHub& operator=(const EventHub&) = delete;

    /// Nothing when too many listen already. It listens while it lives, from now on; with the id of
    /// the last event that it has got, from there.
    std::shared_ptr<Listener> listen(EventFilter filter, std::string_view last_id = {});
    /// Something of this type happens. True: publish() it. Otherwise nobody listens, and nobody who
    /// has left could be given it: it is counted, as lost to whoever comes back.
    bool announce(std::string_view type);
    /// `json` is one line. After announce().
    void publish(EventTopic topic, std::string_view json);
    /// Nobody listens now.
    bool is_idle();
    /// The server stops: everybody is given what waits and sent home.
    void end();

  private:
    struct Event {
        std::uint64_t number = 0;
        EventTopic topic;
        std::string text;  ///< in the wire format
    };
    /// Of one type.
    struct Ring {
        std::deque<Event> events;
        std::size_t bytes = 0;
        std::uint64_t gone = 0;   ///< the number of the last that is no longer here
        std::size_t unheard = 0;  ///< events since somebody has listened
    };

    std::string id_of(std::uint64_t number) const { return epoch_ + '-' + std::to_string(number); }
    std::optional<std::uint64_t> number_of(std::string_view id) const;
    void forget(Ring& ring);
    const Event* next(const Listener& listener) const;
    std::uint64_t missed(const Listener& listener) const;

    std::string epoch_;
    std::map<std::string, Ring, std::less<>> rings_;  ///< by type: as many as there are words
    std::vector<std::weak_ptr<Listener>> listeners_;
    std::uint64_t last_ = 0;
    bool was_heard_ = false;  ///< by anybody, ever
};

class EventHub::Listener {
  public:
    /// Called when events wait that it wants, and at the end.
    std::function<void()> wake;
    /// What waits, or some of it, in the wire format; "" when nothing does.
    std::string take();
    /// The same, never "": where nothing waits, what shows that this end is there, and moves the
    /// place from which the client would come again.
    std::string heartbeat();
    bool ended() const { return ended_; }

  private:
    friend class EventHub;
    EventHub* hub_ = nullptr;  ///< null: it is no more
    EventFilter filter_;
    std::string opening_;      ///< what comes before the first event
    std::uint64_t place_ = 0;  ///< all up to this number have been given, passed over or lost
    std::uint64_t lost_ = 0;
    bool ended_ = false;
};

}  // namespace panelgate::web
