#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/lead_time.hpp"

namespace panelgate::rt {

/// The machine's monotonic clock; its alarms ring from the executor's loop. With wall_seconds() the
/// only place that asks the machine for the time.
class AsioClock final : public Clock {
  public:
    explicit AsioClock(boost::asio::any_io_executor executor);

    TimePoint now() const override;
    std::unique_ptr<Alarm> make_alarm() override;

  private:
    boost::asio::any_io_executor executor_;
    LeadTime lead_;  ///< of all alarms: they ring from one loop
};

}  // namespace panelgate::rt
