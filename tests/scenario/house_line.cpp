#include "house_line.hpp"

#include <utility>

namespace panelgate::scenario {

void HouseLine::start(Events& events) {
    events_ = &events;
    events.on_up();
}

void HouseLine::write(ByteView bytes) {
    if (!wire_.is_up()) return;
    agenda_.tell("sent", bytes);
    wire_.send({bytes.begin(), bytes.end()});
}

void HouseLine::come(ByteView bytes) {
    agenda_.tell("heard", bytes);
    device_.insert(device_.end(), bytes.begin(), bytes.end());
    if (!held_) wake();
}

void HouseLine::wake() {
    if (std::exchange(waking_, true)) return;
    agenda_.at(agenda_.now() + random_.between(0us, wake_), [this] {
        reach_([this] {
            waking_ = false;
            read();
        });
    });
}

void HouseLine::read() {
    if (events_ != nullptr && !device_.empty()) events_->on_bytes(std::exchange(device_, {}));
}

void HouseLine::lose(Duration pause, const std::string& why) {
    if (!wire_.is_up() || events_ == nullptr) return;
    wire_.forget_connection();
    wire_.go_down();
    device_.clear();
    agenda_.at(agenda_.now() + pause, [this] {
        reach_([this] {
            wire_.come_up();
            if (events_ != nullptr) events_->on_up();
        });
    });
    events_->on_down(why);
}

}  // namespace panelgate::scenario
