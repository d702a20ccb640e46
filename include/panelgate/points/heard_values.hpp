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

/// Values of one station's wants, heard on a line with another master. A read that covers a want
/// completely sets its value, and so does a confirmed write. A doubtful or unconfirmed write makes
/// stale what it may have changed. Pure.
class HeardValues {
  public:
    explicit HeardValues(const std::vector<Want>& wants, SharedMemory memory = {});

    /// Processes a request to this station, or a broadcast, with its result. Returns the changed
    /// wants: read, failed, or outdated.
    std::vector<std::size_t> on_heard(const tap::Transaction& heard);

    /// Takes over the readings of the same items from `before`.
    void adopt(const HeardValues& before) {
        adopt_readings(wants_, readings_, before.wants_, before.readings_);
    }

    const std::vector<Reading>& readings() const { return readings_; }

  private:
    bool apply_read(const modbus::Span& span, const tap::Transaction& heard);
    void apply_write(const std::optional<modbus::Span>& span, const tap::Transaction& heard);
    void apply_failure(const modbus::Span& span, std::optional<std::uint8_t> exception);
    void set(std::size_t want, const modbus::Span& span, const std::vector<std::uint16_t>& items,
             TimePoint sampled);

    std::vector<Want> wants_;
    SharedMemory memory_;
    std::vector<Reading> readings_;
    std::vector<std::size_t> changed_;
};

}  // namespace panelgate::points
