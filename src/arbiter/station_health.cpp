#include "panelgate/arbiter/station_health.hpp"

#include <algorithm>

namespace panelgate::arbiter {

bool StationHealth::on_reply(TimePoint now) {
    const bool back = on_late_reply(now);
    state_ = Health::online;
    last_success_ = now;
    return back;
}

bool StationHealth::on_late_reply(TimePoint now) {
    const bool back = offline();
    returns_ += silent_ > 0 ? 1u : 0u;
    state_ = Health::suspect;
    known_ = true;
    silent_ = 0;
    last_heard_ = now;
    return back;
}

void StationHealth::on_damaged() {
    returns_ += silent_ > 0 ? 1u : 0u;
    silent_ = 0;
    state_ = Health::suspect;
    // A station that was never heard: the damage may come from any sender.
    known_ = last_heard_.has_value();
}

bool StationHealth::on_silence(TimePoint now) {
    ++silent_;
    known_ = true;
    if (offline()) {
        pause_ = std::min(pause_ * 2, settings_.probe_max);
        next_probe_ = now + pause_;
        return false;
    }
    if (silent_ < settings_.after) {
        state_ = Health::suspect;
        return false;
    }
    state_ = Health::offline;
    pause_ = settings_.probe_min;
    next_probe_ = now + pause_;
    next_half_open_ = now + pause_;
    return true;
}

bool StationHealth::on_silent_write() {
    known_ = true;
    if (offline()) return false;
    state_ = Health::suspect;
    const bool is_last = silent_ + 1 >= settings_.after;
    if (!is_last) ++silent_;
    return is_last;
}

bool StationHealth::take_half_open(TimePoint now) {
    if (now < next_half_open_) return false;
    next_half_open_ = now + pause_;
    return true;
}

}  // namespace panelgate::arbiter
