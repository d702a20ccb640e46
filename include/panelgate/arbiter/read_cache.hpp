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

/// What a read of one table (01..04) asks one station for.
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

/// The part of a reply to `whole` that answers `part`, as its own reply PDU. `whole` contains
/// `part` and the reply matches it.
Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part);

/// What reads of one line have brought, for stations that allow a client an older value (max_age).
/// Bounded: the oldest value goes first. Pure.
class ReadCache {
  public:
    static constexpr std::size_t kEntries = 256;

    struct Hit {
        Bytes pdu;  ///< the reply to the read that was asked for
        Duration age{};
    };

    /// The normal reply to `span`, read by a request that left at `sampled` or later. Not kept when
    /// something was written since: nobody knows which came first.
    void store(const ReadSpan& span, Bytes reply, TimePoint sampled);
    /// The youngest value of all these items that is not older than max_age.
    std::optional<Hit> find(const ReadSpan& span, TimePoint now, Duration max_age) const;
    /// This request may change what the station holds (0: all stations), answered or not: what
    /// modbus::may_change() says is forgotten.
    void on_write(TimePoint now, std::uint8_t station, const modbus::Request& request);
    void clear() { entries_.clear(); }
    std::size_t size() const { return entries_.size(); }

  private:
    struct Entry {
        ReadSpan span;
        Bytes reply;
        TimePoint sampled;
    };
    PoolList<Entry> entries_;                    ///< the youngest first
    std::map<std::uint8_t, TimePoint> written_;  ///< when each station was last written to; 0: all
};

}  // namespace panelgate::arbiter
