#include "panelgate/rt/asio_clock.hpp"

#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <utility>

namespace panelgate::rt {
namespace {

/// The system's timer is moved only when it must ring earlier: one that rings too early is set
/// again, which most of them never are, because what they wait for comes first.
class AsioAlarm final : public Alarm {
  public:
    AsioAlarm(const boost::asio::any_io_executor& executor, LeadTime& lead)
        : timer_(executor), lead_(lead) {}
    ~AsioAlarm() override { *alive_ = false; }

    void arm(TimePoint when, Handler ring) override { arm(when, std::move(ring), false); }
    void arm_sharp(TimePoint when, Handler ring) override { arm(when, std::move(ring), true); }
    void cancel() override {
        ring_ = nullptr;
        if (!std::exchange(waiting_, false)) return;
        ++waits_;
        timer_.cancel();  // a loop that has nothing else to do ends
    }

  private:
    void arm(TimePoint when, Handler ring, bool sharp) {
        ring_ = std::move(ring);
        when_ = when;
        sharp_ = sharp;
        if (!waiting_ || wake_at() < timer_.expiry()) wait();
    }
    TimePoint wake_at() const { return sharp_ ? when_ - lead_.lead() : when_; }
    void wait() {
        waiting_ = true;
        const unsigned number = ++waits_;
        timer_.expires_at(wake_at());
        timer_.async_wait([this, number, alive = alive_](boost::system::error_code) {
            if (*alive && number == waits_) on_time();
        });
    }
    void on_time() {
        waiting_ = false;
        if (!ring_) return;
        if (std::chrono::steady_clock::now() < wake_at()) return wait();
        if (sharp_) watch_clock();
        const Handler ring = std::exchange(ring_, nullptr);
        ring();
    }
    void watch_clock() {
        const TimePoint woken = std::chrono::steady_clock::now();
        TimePoint now = woken;
        while (now < when_) now = std::chrono::steady_clock::now();
        lead_.on_rung(now, woken - timer_.expiry(), now - woken);
    }

    boost::asio::steady_timer timer_;
    LeadTime& lead_;
    TimePoint when_{};
    bool sharp_ = false;
    Handler ring_;
    unsigned waits_ = 0;    ///< a timer that was due when it was moved completes nevertheless
    bool waiting_ = false;  ///< the system's timer is set
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace

AsioClock::AsioClock(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}

TimePoint AsioClock::now() const { return std::chrono::steady_clock::now(); }

std::unique_ptr<Alarm> AsioClock::make_alarm() {
    return std::make_unique<AsioAlarm>(executor_, lead_);
}

}  // namespace panelgate::rt
