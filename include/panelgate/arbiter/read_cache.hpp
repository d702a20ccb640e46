#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// The items of one table (01..04) that a read asks of one station.
struct ReadSpan {
    std::uint8_t station = 0;
    modbus::Span items;

    bool same_table(const ReadSpan& other) const {
        return station == other.station && items.table == other.items.table;
    }
    bool contains(const ReadSpan& other) const {
        return station == other.station && items.contains(other.items);
    }
    friend bool operator==(const ReadSpan&, const ReadSpan&) = default;
};

/// Returns the part of a reply to `whole` that answers `part`, as a reply PDU. `whole` must contain
/// `part` and the reply match it.
Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part);

/// Values read on one line, for stations that allow clients an older value (max_age). Bounded: the
/// oldest is dropped first. Pure.
class ReadCache {
  public:
    static constexpr std::size_t kEntries = 256;

    struct Hit {
        Bytes pdu;  ///< reply to the read that was asked for
        Duration age{};
    };

    /// Stores the normal reply to `span`, read by a request that left at `sampled` or later. Not if
    /// a write came since: the order of the two is unknown.
    void store(const ReadSpan& span, Bytes reply, TimePoint sampled);
    /// Returns the newest value of all these items that is not older than max_age.
    std::optional<Hit> find(const ReadSpan& span, TimePoint now, Duration max_age) const;
    /// A write to the station (0: all stations), answered or not: drops the values that
    /// modbus::may_change() names.
    void on_write(TimePoint now, std::uint8_t station, const modbus::Request& request);
    void clear() { entries_.clear(); }
    std::size_t size() const { return entries_.size(); }

  private:
    struct Entry {
        ReadSpan span;
        Bytes reply;
        TimePoint sampled;
    };
    PoolList<Entry> entries_;                    ///< newest first
    std::map<std::uint8_t, TimePoint> written_;  ///< last write to each station; 0: all stations
};

}  // namespace panelgate::arbiter
