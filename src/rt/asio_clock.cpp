#include "panelgate/rt/asio_clock.hpp"

#include <sys/timerfd.h>
#include <algorithm>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <system_error>
#include <utility>

#include "panelgate/base/pool.hpp"

namespace panelgate::rt {

namespace asio = boost::asio;

/// All armed alarms of a clock, by time, and the one timerfd that wakes for the first. It is reset
/// only to wake earlier: most alarms are cancelled before they fire, and a wake-up with nothing due
/// sets it again.
class AsioClock::Alarms {
  public:
    class One;
    using Key = std::pair<TimePoint, std::uint64_t>;

    explicit Alarms(const asio::any_io_executor& executor) : timer_(executor) {
        const int timer = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
        if (timer < 0) throw std::system_error(errno, std::generic_category(), "timerfd_create");
        timer_.assign(timer);
    }
    ~Alarms() { *alive_ = false; }
    Alarms(const Alarms&) = delete;
    Alarms& operator=(const Alarms&) = delete;

    LeadTime& lead() { return lead_; }
    Key add(TimePoint wake_at, One& alarm) {
        const Key key{wake_at, ++added_};
        armed_.emplace(key, &alarm);
        set();
        return key;
    }
    void remove(const Key& key) {
        armed_.erase(key);
        if (armed_.empty() && !ringing_) rest();
    }

  private:
    void set();
    void wait();
    void on_time();
    /// Lets a loop without other work end.
    void rest() {
        if (!std::exchange(waiting_, false)) return;
        ++waits_;
        timer_.cancel();
    }

    asio::posix::stream_descriptor timer_;
    LeadTime lead_;  ///< shared: they fire from one loop
    PoolMap<Key, One*> armed_;
    std::uint64_t added_ = 0;
    TimePoint set_for_{};
    unsigned waits_ = 0;    ///< a wait that was due when cancelled completes nevertheless
    bool waiting_ = false;  ///< the timerfd is set
    bool ringing_ = false;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

class AsioClock::Alarms::One final : public Alarm {
  public:
    explicit One(std::shared_ptr<Alarms> alarms) : alarms_(std::move(alarms)) {}
    ~One() override { One::cancel(); }

    void arm(TimePoint when, Handler ring) override { arm(when, std::move(ring), false); }
    void arm_sharp(TimePoint when, Handler ring) override { arm(when, std::move(ring), true); }
    void cancel() override {
        const Handler gone = std::exchange(ring_, nullptr);
        if (std::exchange(armed_, false)) alarms_->remove(key_);
    }
    /// Called when due, after removal from armed_.
    void ring() {
        armed_ = false;
        if (sharp_) watch_clock();
        const Handler handler = std::exchange(ring_, nullptr);
        handler();
    }

  private:
    void arm(TimePoint when, Handler ring, bool sharp) {
        cancel();
        ring_ = std::move(ring);
        when_ = when;
        sharp_ = sharp;
        armed_ = true;
        key_ = alarms_->add(sharp ? when - alarms_->lead().lead() : when, *this);
    }
    void watch_clock() {
        const TimePoint woken = std::chrono::steady_clock::now();
        TimePoint now = woken;
        while (now < when_) now = std::chrono::steady_clock::now();
        alarms_->lead().on_rung(now, woken - key_.first, now - woken);
    }

    std::shared_ptr<Alarms> alarms_;  ///< a handler left in an ended loop may own the last alarm
    Key key_{};
    TimePoint when_{};
    Handler ring_;
    bool sharp_ = false;
    bool armed_ = false;
};

void AsioClock::Alarms::set() {
    if (ringing_) return;  // on_time() calls it afterwards
    if (armed_.empty()) return rest();
    const TimePoint first = armed_.begin()->first.first;
    if (waiting_ && set_for_ <= first) return;
    set_for_ = first;
    // A time in the past fires at once; 0 would disarm the timer.
    const auto since = std::max<Duration>(first.time_since_epoch(), 1ns);
    itimerspec at{};
    at.it_value.tv_sec = static_cast<std::time_t>(since / 1s);
    at.it_value.tv_nsec = static_cast<long>((since % 1s).count());
    ::timerfd_settime(timer_.native_handle(), TFD_TIMER_ABSTIME, &at, nullptr);
    if (!waiting_) wait();
}

/// Setting the timerfd clears its expiration, so it is never read.
void AsioClock::Alarms::wait() {
    waiting_ = true;
    timer_.async_wait(asio::posix::stream_descriptor::wait_read,
                      [this, number = ++waits_, alive = alive_](boost::system::error_code) {
                          if (*alive && number == waits_) on_time();
                      });
}

/// Alarms armed by the handlers wait for the next turn, so that the rest of the loop gets its turn.
void AsioClock::Alarms::on_time() {
    waiting_ = false;
    ringing_ = true;
    const std::uint64_t last = added_;
    while (!armed_.empty()) {
        const auto first = armed_.begin();
        if (first->first.second > last) break;
        if (first->first.first > std::chrono::steady_clock::now()) break;
        One& alarm = *first->second;
        armed_.erase(first);
        alarm.ring();
    }
    ringing_ = false;
    set();
}

AsioClock::AsioClock(const asio::any_io_executor& executor)
    : alarms_(std::make_shared<Alarms>(executor)) {}

TimePoint AsioClock::read() { return std::chrono::steady_clock::now(); }

std::unique_ptr<Alarm> AsioClock::make_alarm() { return std::make_unique<Alarms::One>(alarms_); }

}  // namespace panelgate::rt
