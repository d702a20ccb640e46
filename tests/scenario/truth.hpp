#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::scenario {

inline constexpr std::uint8_t kBroadcast = 0;
/// Big-endian, as everything in a PDU.
inline std::uint16_t word(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] * 256 + bytes[at + 1]);
}

/// Registers from here on are memory that clients write; below, each holds how many requests its
/// station has served, plus something of its own: a value tells when it was read.
inline constexpr std::uint16_t kMemory = 1000;
inline constexpr std::uint16_t kMemoryCells = 128;
/// What register `address` of a station holds when it has served `served` requests.
std::uint16_t moving_value(std::uint8_t station, std::uint8_t function, std::uint16_t address,
                           std::uint64_t served);
/// A station and a PDU: every write is another one.
std::string key_of(std::uint8_t station, ByteView pdu);

/// What the panels really did, and what a value can therefore be.
class Truth {
  public:
    void on_served(TimePoint now, std::uint8_t station);
    void on_executed(TimePoint now, std::uint8_t station, ByteView pdu);
    void on_exception(TimePoint now, std::uint8_t station, ByteView pdu);
    /// A write to these cells leaves; 0 = of all stations that are known.
    void on_write_sent(TimePoint now, std::uint8_t station, ByteView pdu);

    /// Somebody said this on the wire, or was about to when another spoke as well.
    void on_said(TimePoint now, ByteView bytes);
    /// Nobody said these bytes of late, one behind the other: what was heard passed the CRC by
    /// chance.
    bool is_chance(ByteView bytes) const;

    std::uint64_t served(std::uint8_t station) const;
    /// `write`: its key_of().
    std::optional<TimePoint> executed(const std::string& write) const;
    std::optional<TimePoint> executed(std::uint8_t station, ByteView pdu) const {
        return executed(key_of(station, pdu));
    }
    /// It refused this very request at `since` or later.
    bool refused(std::uint8_t station, ByteView pdu, TimePoint since) const;

    struct Read {
        std::uint8_t station = 0;
        std::uint8_t function = 0;
        TimePoint now;
        TimePoint since;           ///< no older: when it was asked, or a write was known to be done
        std::uint64_t served = 0;  ///< by then
        std::optional<Duration> age;
    };
    /// Nothing, or what is wrong with this value.
    const char* fault_of(const Read& read, std::uint16_t address, std::uint16_t value) const;

  private:
    struct Cell {
        std::vector<std::pair<TimePoint, std::uint16_t>> values;
        TimePoint asked{};  ///< when a write to it last left
    };
    struct Station {
        std::uint64_t served = 0;
        std::deque<std::pair<TimePoint, std::uint64_t>> history;
        std::map<Bytes, TimePoint> refused;  ///< by request
        std::unordered_map<std::uint16_t, Cell> cells;
    };
    bool moves_right(const Read& read, const Station& station, std::uint16_t address,
                     std::uint16_t value) const;
    bool held(const Read& read, const Station& station, std::uint16_t address,
              std::uint16_t value) const;

    std::map<std::uint8_t, Station> stations_;
    std::deque<std::pair<TimePoint, Bytes>> said_;
    std::unordered_map<std::string, TimePoint> executed_;
};

}  // namespace panelgate::scenario
