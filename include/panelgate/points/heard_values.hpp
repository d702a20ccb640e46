#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/read_plan.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/tap/heard.hpp"

namespace panelgate::points {

/// What passes by on a line whose master is somebody else, as far as it is wanted of one station: a
/// want is known by a read that covers all of it, or a write that was confirmed. What is in doubt,
/// and a write that nobody confirmed, makes old what it may have changed. Pure.
class HeardValues {
  public:
    explicit HeardValues(const std::vector<Want>& wants, SharedMemory memory = {});

    /// A request to this station, or a broadcast, and what came of it. Gives the wants that are
    /// another now: read, failed, or old.
    std::vector<std::size_t> on_heard(const tap::Transaction& heard);

    /// What the one before knew of the same items is known here, too.
    void adopt(const HeardValues& before) {
        adopt_readings(wants_, readings_, before.wants_, before.readings_);
    }

    const std::vector<Reading>& readings() const { return readings_; }

  private:
    bool read(const modbus::Span& span, const tap::Transaction& heard);
    void wrote(const std::optional<modbus::Span>& span, const tap::Transaction& heard);
    void failed(const modbus::Span& span, std::optional<std::uint8_t> exception);
    void set(std::size_t want, const modbus::Span& span, const std::vector<std::uint16_t>& items,
             TimePoint sampled);

    std::vector<Want> wants_;
    SharedMemory memory_;
    std::vector<Reading> readings_;
    std::vector<std::size_t> changed_;
};

}  // namespace panelgate::points
