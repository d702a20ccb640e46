#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::rt {

/// The machine's monotonic clock; its alarms ring from the executor's loop. With wall_seconds() the
/// only place that asks the machine for the time.
class AsioClock final : public Clock {
  public:
    /// Throws std::system_error when the system has no timer left.
    explicit AsioClock(const boost::asio::any_io_executor& executor);

    TimePoint now() const override;
    std::unique_ptr<Alarm> make_alarm() override;

  private:
    class Alarms;

    std::shared_ptr<Alarms> alarms_;
};

}  // namespace panelgate::rt
