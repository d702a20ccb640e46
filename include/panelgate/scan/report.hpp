#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

/// A profile that matches a station's answers.
struct Candidate {
    std::string profile;
    std::string why;
};

/// Results of the requests to one station.
struct Evidence {
    unsigned asked = 0;
    unsigned good = 0;
    unsigned damaged = 0;  ///< bytes without a complete reply
    unsigned twice = 0;    ///< a second good reply, duplicated
    unsigned late = 0;     ///< replies after the timeout
    bool mixed = false;    ///< the same read was both refused and granted
};

struct StationFinding {
    std::uint8_t station = 0;
    std::vector<Candidate> candidates;  ///< best first; empty if no reply was readable
    Evidence evidence;
    bool duplicate = false;  ///< two stations seem to share this address
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

/// Frames that answer no request of this scan: function codes by station.
using Talk = std::map<std::uint8_t, std::set<std::uint8_t>>;

struct Result {
    enum class Ending : std::uint8_t {
        running,         ///< so far
        finished,        ///< everything was asked
        another_master,  ///< heard before the first request; nothing was sent
    };
    Ending ending = Ending::running;
    /// Format in which stations answered or another master was heard. For a remote device: a format
    /// that its panels support.
    std::optional<SerialFormat> format;
    bool remote = false;
    std::vector<StationFinding> stations;  ///< by address
    Talk talk;
    unsigned noise = 0;  ///< bytes heard before the first request, unreadable in every format
    bool noisy = false;  ///< damage on the whole line, not at one address
    /// Formats in which a station gave only damaged replies, while nothing was readable.
    std::vector<SerialFormat> damaged_formats;
};

/// A request that changes nothing. make() is the only way to create one, and a scan can send
/// nothing else: it is read-only by construction, whatever a profile asks for.
class ReadRequest {
  public:
    /// Returns nullopt unless the station is 1 to 247 and the PDU is well-formed and a pure read.
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

/// Returns the table: "DEVICE: 38400 8N1, 6 stations", then a row per station. A non-empty `ending`
/// is added to the first line in parentheses.
std::string report_text(const std::string& device, const Result& result,
                        const std::string& ending = {});

/// The same as a configuration of one line, complete and valid if a station was found. `device` is
/// an absolute path, tcp:// or modbus-tcp://HOST:PORT; `profiles_dir` is empty or an absolute path.
std::string report_yaml(const std::string& device, const Result& result,
                        const std::string& profiles_dir = {});

/// Returns the line `serial:` of that configuration, indented, with a comment where it is supposed;
/// "" of a device on Ethernet.
std::string serial_yaml(const std::string& device, const Result& result);

/// Returns the entries of these stations only, for the `stations:` of the named line.
std::string stations_yaml(const std::string& line, const std::vector<StationFinding>& stations);

/// Returns why a station was recognised as such, and its anomalies.
std::string evidence_text(const StationFinding& finding);

/// Returns a station as one sentence: "station 31: autonics-gplp-s, ...".
std::string found_text(const StationFinding& finding);

/// Returns further advice for the user: one sentence each.
std::vector<std::string> advice(const std::string& device, const Result& result);

/// True if a station gave a complete reply.
bool found_any(const Result& result);

}  // namespace panelgate::scan
