#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/rt/clock.hpp"

namespace panelgate::test {

/// Time that passes when a test says so; its alarms ring from inside jump() and advance().
class ManualClock final : public rt::Clock {
  public:
    ManualClock() = default;
    ManualClock(const ManualClock&) = delete;
    ManualClock& operator=(const ManualClock&) = delete;
    /// A handler may hold the last of an alarm's owner.
    ~ManualClock() override { const std::vector<Armed> gone = std::exchange(armed_, {}); }

    TimePoint now() const override { return now_; }
    std::unique_ptr<rt::Alarm> make_alarm() override { return std::make_unique<Bell>(*this); }

    /// When the next alarm rings; nothing: none is armed.
    std::optional<TimePoint> next() const {
        const auto first = std::ranges::min_element(armed_, {}, &Armed::when);
        return first == armed_.end() ? std::nullopt : std::optional(first->when);
    }
    std::size_t armed() const { return armed_.size(); }

    /// On to the next alarm, which rings; of one instant, the one that was armed first. False when
    /// none is armed.
    bool jump() {
        const auto first = std::ranges::min_element(armed_, {}, &Armed::when);
        if (first == armed_.end()) return false;
        const Armed due = std::move(*first);
        armed_.erase(first);
        now_ = std::max(now_, due.when);
        due.ring();
        return true;
    }
    /// All alarms of this time ring on the way.
    void advance(Duration by) {
        const TimePoint end = now_ + by;
        while (next() && *next() <= end) jump();
        pass(end - now_);
    }
    /// Time passes and nobody notices: the process was busy, or stopped.
    void pass(Duration by) { now_ += std::max(by, Duration::zero()); }

  private:
    struct Armed {
        const rt::Alarm* alarm = nullptr;
        TimePoint when;
        rt::Alarm::Handler ring;
    };
    class Bell final : public rt::Alarm {
      public:
        explicit Bell(ManualClock& clock) : clock_(clock) {}
        ~Bell() override { Bell::cancel(); }
        void arm(TimePoint when, Handler ring) override {
            cancel();
            clock_.armed_.push_back({this, when, std::move(ring)});
        }
        void cancel() override {
            const auto found = std::ranges::find(clock_.armed_, this, &Armed::alarm);
            if (found == clock_.armed_.end()) return;
            const Armed gone = std::move(*found);
            clock_.armed_.erase(found);
        }

      private:
        ManualClock& clock_;
    };

    TimePoint now_{1h};
    std::vector<Armed> armed_;
};

/// Runs what is ready, and lets time pass only when nothing is, until something is true. False when
/// nothing is left that could make it true.
inline bool run_until(boost::asio::io_context& io, ManualClock& clock,
                      const std::function<bool()>& reached) {
    while (!reached()) {
        io.restart();
        if (io.poll_one() == 0 && !clock.jump()) return false;
    }
    return true;
}

}  // namespace panelgate::test
