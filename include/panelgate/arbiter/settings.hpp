#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// Settings of one station. The defaults are those of the line.
struct StationSettings {
    std::uint8_t id = 1;  ///< 1..247
    /// From the end of the request on the wire to the start of the reply.
    Duration response_timeout = 500ms;
    /// Follow the measured turnaround, from timeout_floor up to response_timeout.
    bool adaptive_timeout = false;
    Duration timeout_floor = 20ms;
    /// Silence before a request and after its reply; empty: the standard's (silent_interval()).
    std::optional<Duration> frame_gap;
    /// Least time between a reply of this station and the next request to it. T14: devices that
    /// ignore what follows their own reply for 50 to 850 ms (NModbus#188, eModbus#223). 0: none.
    Duration station_gap{};
    /// The same behind a write to this station. T14: devices that store a command for 1 to 3 s
    /// (batpred#1209). 0: as `station_gap`.
    Duration after_write{};
    /// The byte count of a reply to 01 to 04 need not be the quantity asked: the reply's own byte
    /// count decides. T14: registers of 4 or 12 bytes (pymodbus#669, libmodbus#466).
    bool any_length = false;
    int retries = 1;  ///< of reads; 0..10
    bool retry_writes = false;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;  ///< as it sends and expects it
    /// How long after a timeout a reply may still come; empty: by the lateness seen (LateWindow).
    std::optional<Duration> late_window;
    /// Maximum age of a stored value that may answer a client; 0 = ask the panel.
    Duration max_age{};
    /// Items of one read, for joining: the profile's or the standard's limit.
    std::uint16_t max_registers = 125;
    std::uint16_t max_bits = 2000;
    /// The profile guarantees both limits; else joined reads have a length answered before (P6).
    bool vouched = false;
    friend bool operator==(const StationSettings&, const StationSettings&) = default;
};

/// Which stations rest after a timeout until a late reply can no longer come (P1).
enum class Quarantine : std::uint8_t {
    automatic,  ///< the silent station; all stations if its replies have been late before
    line,       ///< all stations
    station,    ///< the silent station; others may be asked, at the risk of a collision
};

struct Settings {
    SerialFormat serial;
    modbus::HexDigits ascii_digits =
        modbus::HexDigits::upper_only;  ///< accepted in received frames
    /// For stations without an entry in `stations`; its id is not used.
    StationSettings unlisted;
    std::vector<StationSettings> stations;
    Duration broadcast_turnaround = 100ms;  ///< serial line V1.02, 2.4.1: 100..200 ms
    /// Silence that ends a reply of unknown length (FRM-11); counted from its last byte.
    Duration end_of_frame = 20ms;
    /// The longest silence inside a reply of known length; in ASCII also between two characters of
    /// any frame. The default is for a tty: a USB latency timer (16 ms) and a busy machine.
    Duration reply_hole = 60ms;
    /// The line rests so long after each opening. T8: device servers that ignore the first seconds
    /// of a connection (telegraf#11919, ioBroker.modbus#250).
    Duration connect_pause{};
    QueueSettings queue;
    OfflineSettings offline;
    Quarantine quarantine = Quarantine::automatic;
    /// A real UART, no pty: no reply byte can come before the request has left.
    bool paced = false;
    /// The transport may deliver frames later (RTU over TCP): time alone ends no request (T8).
    bool may_stall = false;
    /// Identical, contained and adjacent reads share one transaction (P6).
    bool share_reads = true;
    /// By default a line is taken to have no echo.
    EchoMode echo = EchoMode::off;
    /// Requests on their way to a device that speaks Modbus/TCP; 0: a serial line.
    unsigned in_flight = 0;
    /// Report why each request is sent now and why one is refused.
    bool explain = false;
    /// The pause of a station inside its replies is learned where longer than `reply_hole` (T4).
    bool learns_holes = true;
    friend bool operator==(const Settings&, const Settings&) = default;
};

/// True if the settings that affect the wire itself are equal: the line stays open.
bool is_same_wire(const Settings& one, const Settings& other);

/// Returns the stations' CRC orders; in ASCII the standard's. A broadcast has the standard order
/// unless all listed stations have the other: no frame can be right for both.
modbus::CrcOrders crc_orders(const Settings& settings);

}  // namespace panelgate::arbiter
