#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/line/counters.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// A stream of bytes to a serial line: the byte seam. It opens by itself after start(), says when
/// it is up or down, and keeps trying to open while it is down. One thread. Events may come from
/// inside poll_input() and write(); after stop() none come.
class Line {
  public:
    /// Who listens; it outlives the line.
    class Events {
      public:
        virtual ~Events() = default;
        virtual void on_up() = 0;
        /// `why` is for people: "cannot open /dev/ttyUSB0: No such file or directory".
        virtual void on_down(const std::string& why) = 0;
        virtual void on_bytes(ByteView bytes) = 0;
    };

    virtual ~Line() = default;
    virtual void start(Events& events) = 0;
    virtual void stop() = 0;
    /// Hands all bytes that have arrived already to on_bytes, now.
    virtual void poll_input() = 0;
    /// Input waits for poll_input(), which somebody will call, until this is taken back: it need
    /// not wake anybody. A line that cannot keep it hands it over all the same.
    virtual void hold_input(bool hold) { static_cast<void>(hold); }
    /// Sends in one piece; nothing blocks. On failure the line goes down (on_down).
    virtual void write(ByteView bytes) = 0;
    virtual const Counters& counters() = 0;
    /// Other characters from now on, while it is up and nothing is being sent. False when this end
    /// does not decide that (RTU over TCP), or the device refuses (then it is down).
    virtual bool set_format(const SerialFormat& format) {
        static_cast<void>(format);
        return false;
    }
    /// Between write() and the first bit: what switching to sending takes.
    virtual Duration lead() const { return {}; }
    /// How long the wire still needs for what was written, as far as the driver tells. Nothing from
    /// a line that cannot tell at all: who writes has to go by its own arithmetic.
    virtual std::optional<Duration> unsent() { return std::nullopt; }
    /// The far end has not taken what was written, although its time is over: it is not to be left
    /// there, to be executed whenever the way is free again.
    virtual bool undelivered() { return false; }
    /// Throws away what has not left yet, closes, and opens again with back-off. The line goes down
    /// (on_down, from inside). `why` is for people.
    virtual void reset(const std::string& why) { static_cast<void>(why); }
    /// What the way to the wire and back adds to every answer, now: nothing for a device here.
    virtual Duration latency() { return {}; }
};

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
