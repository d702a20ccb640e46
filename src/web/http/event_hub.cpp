#include "panelgate/web/http/event_hub.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "panelgate/base/text.hpp"

namespace panelgate::web {
namespace {

template <class Set, class Key>
bool allows(const Set& set, const Key& key) {
    return set.empty() || set.contains(key);
}

/// `how`: JSON members.
std::string loss(const std::string& how) { return "event: lost\ndata: {" + how + "}\n\n"; }

constexpr const char* kComment = ": \n\n";

}  // namespace

bool EventFilter::passes(const EventTopic& topic) const {
    if (!allows(types, topic.type) || !allows(lines, topic.line)) return false;
    if (!stations.empty() && !stations.contains({topic.line, topic.station})) return false;
    if (!points.empty() && !points.contains({topic.station, topic.point})) return false;
    return !may_see || may_see(topic);
}

std::string EventHub::Listener::take() {
    std::string text = std::exchange(opening_, {});
    if (hub_ == nullptr) return text;
    if (const std::uint64_t lost = std::exchange(lost_, 0); lost > 0)
        text += loss("\"events\":" + std::to_string(lost) + ",\"exact\":true");
    for (std::size_t examined = 0; text.size() < kTakeBytes; ++examined) {
        const Event* event = hub_->next(*this);
        if (event == nullptr) return text;
        if (examined == kTakeExamined) break;
        place_ = event->number;
        if (filter_.passes(event->topic)) text += event->text;
    }
    return text.empty() ? kComment : text;  // more events are pending
}

std::string EventHub::Listener::heartbeat() {
    std::string text = take();
    if (!text.empty()) return text;
    if (hub_ == nullptr) return kComment;
    place_ = hub_->last_;
    return ": \nid: " + hub_->id_of(place_) + "\n\n";
}

EventHub::~EventHub() {
    for (const auto& weak : listeners_) {
        if (const auto listener = weak.lock()) listener->hub_ = nullptr;
    }
}

bool EventHub::is_idle() {
    std::erase_if(listeners_, [](const auto& weak) { return weak.expired(); });
    return listeners_.empty();
}

std::optional<std::uint64_t> EventHub::number_of(std::string_view id) const {
    if (!id.starts_with(epoch_ + '-')) return std::nullopt;
    id.remove_prefix(epoch_.size() + 1);
    const auto number = to_number<std::uint64_t>(id);
    if (!number || *number > last_) return std::nullopt;
    return number;
}

/// Returns the first event after its place, of the types it wants.
const EventHub::Event* EventHub::next(const Listener& listener) const {
    const Event* first = nullptr;
    for (const auto& [type, ring] : rings_) {
        if (!allows(listener.filter_.types, type)) continue;
        const auto at = std::ranges::upper_bound(ring.events, listener.place_, {}, &Event::number);
        if (at != ring.events.end() && (first == nullptr || at->number < first->number))
            first = &*at;
    }
    return first;
}

/// Returns an upper bound of the events it lost: discarded events of other filters and types count
/// too, since their topics are no longer known.
std::uint64_t EventHub::missed(const Listener& listener) const {
    std::uint64_t gone = 0;
    for (const auto& [type, ring] : rings_) {
        if (allows(listener.filter_.types, type)) gone = std::max(gone, ring.gone);
    }
    return gone > listener.place_ ? gone - listener.place_ : 0;
}

std::shared_ptr<EventHub::Listener> EventHub::listen(EventFilter filter, std::string_view last_id) {
    if (!is_idle() && listeners_.size() >= kListeners) return nullptr;
    auto listener = std::make_shared<Listener>();
    listener->hub_ = this;
    listener->filter_ = std::move(filter);
    listener->opening_ = "retry: " + std::to_string(kRetryMs) + "\n";
    if (last_id.empty()) {
        listener->place_ = last_;
        listener->opening_ += "id: " + id_of(last_) + "\n\n";
    } else if (const auto number = number_of(last_id)) {
        listener->place_ = *number;
        listener->opening_ += '\n';
        if (const std::uint64_t lost = missed(*listener); lost > 0)
            listener->opening_ += loss("\"events\":" + std::to_string(lost) + ",\"exact\":false");
    } else {  // from a previous run: all events here are new
        listener->opening_ += "\n" + loss(R"("events":null,"exact":false)");
    }
    listeners_.push_back(listener);
    wanted_ = true;
    unheard_ = 0;
    return listener;
}

/// Ids of the epoch before are those of a previous run from now on.
void EventHub::forget_all() {
    wanted_ = false;
    rings_.clear();
    last_ = 0;
    epoch_ = first_epoch_ + '.' + std::to_string(++forgotten_);
}

void EventHub::lose(std::uint64_t count) {
    for (const auto& weak : listeners_)
        if (const auto listener = weak.lock()) listener->lost_ += count;
}

/// Drops a ring's oldest event; it counts as lost to listeners that have not read it.
void EventHub::forget(Ring& ring) {
    const Event& oldest = ring.events.front();
    for (const auto& weak : listeners_) {
        const auto listener = weak.lock();
        if (!listener || listener->place_ >= oldest.number) continue;
        if (listener->filter_.passes(oldest.topic)) ++listener->lost_;
    }
    ring.gone = oldest.number;
    ring.bytes -= oldest.text.size();
    ring.events.pop_front();
}

void EventHub::publish(EventTopic topic, std::string_view json) {
    if (is_idle() && ++unheard_ > kKept) return forget_all();
    Event event{++last_, std::move(topic), {}};
    event.text = "id: " + id_of(last_) + "\nevent: " + event.topic.type +
                 "\ndata: " + std::string(json) + "\n\n";
    Ring& ring = rings_[event.topic.type];
    ring.bytes += event.text.size();
    ring.events.push_back(std::move(event));
    while (ring.events.size() > kKept || (ring.bytes > kKeptBytes && ring.events.size() > 1))
        forget(ring);
    const EventTopic& wanted = ring.events.back().topic;
    const auto listeners = listeners_;  // wake() may end a listener
    for (const auto& weak : listeners) {
        const auto listener = weak.lock();
        if (!listener || listener->ended_) continue;
        if (listener->filter_.passes(wanted)) {
            if (listener->wake) listener->wake();
        } else if (listener->place_ + 1 == last_) {
            listener->place_ = last_;
        }
    }
}

void EventHub::end() {
    const auto listeners = listeners_;
    for (const auto& weak : listeners) {
        const auto listener = weak.lock();
        if (!listener) continue;
        listener->ended_ = true;
        if (listener->wake) listener->wake();
    }
}

EventOutlet::EventOutlet(std::shared_ptr<EventHub> hub, boost::asio::any_io_executor loop)
    : hub_(std::move(hub)), loop_(std::move(loop)) {}

void EventOutlet::run(std::function<void(EventHub&)> work) {
    if (!loop_) return work(*hub_);
    boost::asio::post(loop_, [hub = hub_, work = std::move(work)] { work(*hub); });
}

void EventOutlet::publish(EventTopic topic, std::string json) {
    if (*waiting_ >= kWaiting) {
        ++dropped_;
        return;
    }
    ++*waiting_;
    run([topic = std::move(topic), json = std::move(json), waiting = waiting_,
         dropped = std::exchange(dropped_, 0)](EventHub& hub) {
        --*waiting;
        if (dropped > 0) hub.lose(dropped);
        hub.publish(topic, json);
    });
}

void EventOutlet::end() {
    run([](EventHub& hub) { hub.end(); });
}

}  // namespace panelgate::web
