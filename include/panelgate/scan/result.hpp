#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

/// A profile that explains what a station answered.
struct Candidate {
    std::string profile;
    std::string why;
};

/// What came of the requests to one station.
struct Evidence {
    unsigned asked = 0;
    unsigned good = 0;
    unsigned damaged = 0;  ///< bytes, and no whole reply
    unsigned twice = 0;    ///< a second good reply, unasked
    unsigned late = 0;     ///< replies after the time was up
    bool mixed = false;    ///< the same read was refused and granted
};

struct StationFinding {
    std::uint8_t station = 0;
    std::vector<Candidate> candidates;  ///< the best first; empty when no reply could be read
    Evidence evidence;
    bool duplicate = false;  ///< two stations seem to have this address
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

/// Frames that answer nothing this scan has asked: function codes by station.
using Talk = std::map<std::uint8_t, std::set<std::uint8_t>>;

struct Result {
    enum class Ending : std::uint8_t {
        running,         ///< so far
        finished,        ///< everything was asked
        another_master,  ///< heard before the first word, and nothing was said
    };
    Ending ending = Ending::running;
    /// Where stations answered, or where another master was understood. Of a remote device what its
    /// panels can be set to.
    std::optional<SerialFormat> format;
    bool remote = false;
    std::vector<StationFinding> stations;  ///< by address
    Talk talk;
    unsigned noise = 0;  ///< bytes heard before the first word that made no sense in any format
    bool noisy = false;  ///< damage is all over the line, not at one address
    /// Formats in which a station gave damaged replies only, while nothing was readable.
    std::vector<SerialFormat> damaged_formats;
};

/// A request that changes nothing. There is no other way to make one than make(), and a scan has
/// nothing else to send: it is read-only by construction, whatever a profile asks for.
class ReadRequest {
  public:
    /// Nothing unless the station is 1 to 247 and the PDU is well-formed and a pure read.
    static std::optional<ReadRequest> make(std::uint8_t station, ByteView pdu,
                                           modbus::CrcOrder order = modbus::CrcOrder::low_first);

    std::uint8_t station() const { return adu_.front(); }
    ByteView pdu() const { return modbus::pdu_of(adu_); }
    const Bytes& adu() const { return adu_; }
    modbus::CrcOrder crc_order() const { return order_; }

  private:
    ReadRequest(Bytes adu, modbus::CrcOrder order) : adu_(std::move(adu)), order_(order) {}
    Bytes adu_;
    modbus::CrcOrder order_;
};

}  // namespace panelgate::scan
