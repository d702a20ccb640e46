#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "panelgate/base/time.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// Drives a pure machine over a line, always in this order: all that the device holds, then the
/// clock, then the verbs, then the actions, then the alarm. So bytes that came before something was
/// due or asked are never taken for what came behind it.
///
/// Machine: `poll_action()` gives an optional variant, `next_deadline()` an optional TimePoint.
/// `busy_until()`, where it has one, too: input that comes before then changes nothing and wakes
/// nobody. It is looked at then, or as late as the machine wakes up.
/// Host acts for it: `act(action)` for each alternative, `on_deadline(now)` when the machine's
/// deadline has come, `settled(now)` when it wants nothing more for now.
///
/// All of them outlive it. Verbs and acting may lead to further verbs (a write that fails takes the
/// line down): the outermost loop then drains, nothing recurses (HR-14).
template <class Machine, class Host>
class Drive {
  public:
    Drive(rt::Clock& clock, Line& line, Machine& machine, Host& host)
        : clock_(clock), line_(&line), machine_(machine), host_(host), alarm_(clock.make_alarm()) {}

    /// Another one from now on; the one before says nothing any more.
    void use(Line& line) { line_ = &line; }
    /// What the line itself says: `verb(now)`. It may be in the midst of handing over its input.
    template <class Verb>
    void hear(Verb verb) {
        verb(clock_.now());
        drain();
    }
    /// What anybody else wants: `verb(now)`.
    template <class Verb>
    void tell(Verb verb) {
        line_->poll_input();
        hear(std::move(verb));
    }
    /// The alarm rings no more, until the next verb.
    void rest() {
        line_->hold_input(false);
        silence();
    }

  private:
    void silence() {
        armed_.reset();
        alarm_->cancel();
    }
    void drain() {
        if (draining_) return;
        draining_ = true;
        while (auto action = machine_.poll_action()) {
            std::visit([this](auto& one) { host_.act(one); }, *action);
        }
        draining_ = false;
        const TimePoint now = clock_.now();
        host_.settled(now);
        arm(now);
    }
    void arm(TimePoint now) {
        std::optional<TimePoint> next = machine_.next_deadline();
        bool sharp = true;
        if constexpr (requires { machine_.busy_until(); }) {
            const std::optional<TimePoint> busy = machine_.busy_until();
            const bool hold = busy && *busy > now;
            if (hold && (!next || *busy < *next)) {
                next = busy;
                sharp = false;
            }
            line_->hold_input(hold);
        }
        if (next == armed_) return;
        if (!next) return silence();
        armed_ = next;
        auto ring = [this] {
            armed_.reset();
            tell([this](TimePoint now) { host_.on_deadline(now); });
        };
        sharp ? alarm_->arm_sharp(*next, ring) : alarm_->arm(*next, ring);
    }

    rt::Clock& clock_;
    Line* line_;
    Machine& machine_;
    Host& host_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::optional<TimePoint> armed_;
    bool draining_ = false;
};

}  // namespace panelgate::line
