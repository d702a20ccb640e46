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

/// A byte stream to a serial line; tests replace it. Opens itself after start(), reports up and
/// down, and retries while down. Single-threaded. Events may come from inside poll_input() and
/// write(); none come after stop().
class Line {
  public:
    /// Receives the line's events; outlives the line.
    class Events {
      public:
        virtual ~Events() = default;
        virtual void on_up() = 0;
        /// `why` is human-readable: "cannot open /dev/ttyUSB0: No such file or directory".
        virtual void on_down(const std::string& why) = 0;
        virtual void on_bytes(ByteView bytes) = 0;
    };

    virtual ~Line() = default;
    virtual void start(Events& events) = 0;
    virtual void stop() = 0;
    /// Passes all bytes received so far to on_bytes(), now.
    virtual void poll_input() = 0;
    /// Defers input until poll_input() or defer_input(false): it causes no wake-up. A line that
    /// cannot defer its input delivers it as usual.
    virtual void defer_input(bool hold) { static_cast<void>(hold); }
    /// Sends in one piece, without blocking. On failure the line goes down (on_down).
    virtual void write(ByteView bytes) = 0;
    virtual const Counters& counters() = 0;
    /// Changes the character format, while the line is up and idle. False if this end does not set
    /// it (RTU over TCP), or the device refuses (then it is down).
    virtual bool set_format(const SerialFormat& format) {
        static_cast<void>(format);
        return false;
    }
    /// Time from write() to the first bit: the switch to sending.
    virtual Duration lead() const { return {}; }
    /// Time until all written bytes have left, as far as the driver reports it. std::nullopt if it
    /// cannot report it at all: the caller must compute it.
    virtual std::optional<Duration> unsent() { return std::nullopt; }
    /// True if the far end has not taken written bytes in time: they must not stay there, to be
    /// executed whenever the transport recovers.
    virtual bool undelivered() { return false; }
    /// Discards unsent bytes, closes, and reopens with back-off. The line goes down (on_down, from
    /// inside). `why` is human-readable.
    virtual void reset(const std::string& why) { static_cast<void>(why); }
    /// Time that the transport to the wire and back adds to every reply, now; zero for a local
    /// device.
    virtual Duration latency() { return {}; }
};

/// Drives a pure state machine over a line, always in this order: all input of the device, the
/// clock, the call, the actions, the alarm. So bytes received before an event are never taken for
/// bytes after it.
///
/// Machine: `poll_action()` returns an optional variant, `next_deadline()` an optional TimePoint,
/// and so does `busy_until()`, if present: input before then changes nothing and is deferred until
/// then, or until the machine wakes up.
/// Host: `act(action)` executes each alternative, `on_deadline(now)` is called when the machine's
/// deadline has come, `settled(now)` when no action is left.
///
/// All of them outlive it. Calls and actions may lead to further calls (a failed write takes the
/// line down): the outermost loop drains, nothing recurses (HR-14).
template <class Machine, class Host>
class Drive {
  public:
    Drive(rt::Clock& clock, Line& line, Machine& machine, Host& host)
        : clock_(clock), line_(&line), machine_(machine), host_(host), alarm_(clock.make_alarm()) {}

    /// Replaces the line; the previous one must send no more events.
    void use(Line& line) { line_ = &line; }
    /// Handles an event of the line: calls `verb(now)`. The line may be in the midst of passing on
    /// input.
    template <class Verb>
    void hear(Verb verb) {
        verb(clock_.now());
        drain();
    }
    /// Handles any other call: polls the input, then calls `verb(now)`.
    template <class Verb>
    void tell(Verb verb) {
        line_->poll_input();
        hear(std::move(verb));
    }
    /// Handles a call that sends nothing while the machine is_waiting() for a reply: what has come
    /// of that meanwhile is read when it is due, not for each such call.
    template <class Verb>
    void queue(Verb verb) {
        const TimePoint now = clock_.now();
        if (!machine_.is_waiting() || !armed_ || now >= *armed_) return tell(std::move(verb));
        verb(now);
        drain();
    }
    /// Cancels the alarm, until the next call.
    void rest() {
        line_->defer_input(false);
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
            line_->defer_input(hold);
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
