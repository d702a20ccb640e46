#include "panelgate/web/http/event_hub.hpp"

#include <utility>

namespace panelgate::web {

std::string EventHub::Listener::take() {
    std::string text;
    if (const std::uint64_t lost = std::exchange(lost_, 0); lost > 0)
        text += "event: lost\ndata: {\"events\":" + std::to_string(lost) + "}\n\n";
    for (const std::string& event : std::exchange(waiting_, {})) text += event;
    return text;
}

bool EventHub::is_idle() {
    std::erase_if(listeners_, [](const auto& weak) { return weak.expired(); });
    return listeners_.empty();
}

std::shared_ptr<EventHub::Listener> EventHub::listen(std::set<std::string> types) {
    if (!is_idle() && listeners_.size() >= kListeners) return nullptr;
    auto listener = std::make_shared<Listener>();
    listener->types_ = std::move(types);
    listeners_.push_back(listener);
    return listener;
}

void EventHub::publish(std::string_view type, std::string_view json) {
    if (is_idle()) return;
    const std::string text = "id: " + std::to_string(++last_id_) + "\nevent: " + std::string(type) +
                             "\ndata: " + std::string(json) + "\n\n";
    const auto listeners = listeners_;  // waking one may end another
    for (const auto& weak : listeners) {
        const auto listener = weak.lock();
        if (!listener || listener->ended_) continue;
        if (!listener->types_.empty() && !listener->types_.contains(std::string(type))) continue;
        if (listener->waiting_.size() >= kWaiting) {
            listener->waiting_.pop_front();
            ++listener->lost_;
        }
        listener->waiting_.push_back(text);
        if (listener->wake) listener->wake();
    }
}

void EventHub::end() {
    for (const auto& weak : std::exchange(listeners_, {})) {
        const auto listener = weak.lock();
        if (!listener) continue;
        listener->ended_ = true;
        if (listener->wake) listener->wake();
    }
}

}  // namespace panelgate::web
