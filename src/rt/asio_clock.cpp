#include "panelgate/rt/asio_clock.hpp"

#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <utility>

namespace panelgate::rt {
namespace {

/// A timer that was due when it was cancelled completes nevertheless: what was armed is known by
/// its number.
class AsioAlarm final : public Alarm {
  public:
    explicit AsioAlarm(const boost::asio::any_io_executor& executor) : timer_(executor) {}
    ~AsioAlarm() override { *armed_ = 0; }

    void arm(TimePoint when, Handler ring) override {
        const std::uint64_t number = ++last_;
        *armed_ = number;
        timer_.expires_at(when);
        timer_.async_wait(
            [armed = armed_, number, ring = std::move(ring)](boost::system::error_code) {
                if (*armed != number) return;
                *armed = 0;
                ring();
            });
    }
    void cancel() override {
        *armed_ = 0;
        timer_.cancel();
    }

  private:
    boost::asio::steady_timer timer_;
    std::uint64_t last_ = 0;
    std::shared_ptr<std::uint64_t> armed_ = std::make_shared<std::uint64_t>(0);  ///< 0: nothing
};

}  // namespace

AsioClock::AsioClock(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}

TimePoint AsioClock::now() const { return std::chrono::steady_clock::now(); }

std::unique_ptr<Alarm> AsioClock::make_alarm() { return std::make_unique<AsioAlarm>(executor_); }

}  // namespace panelgate::rt
