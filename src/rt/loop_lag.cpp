#include "panelgate/rt/loop_lag.hpp"

namespace panelgate::rt {

void LoopLag::start() { arm(clock_.now() + kEvery); }

void LoopLag::arm(TimePoint due) {
    alarm_->arm(due, [this, due] {
        const TimePoint now = clock_.now();
        seconds_.observe(now - due);
        arm(now + kEvery);
    });
}

}  // namespace panelgate::rt
