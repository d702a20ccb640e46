#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/trace.hpp"

namespace panelgate::web {

/// Writes a pcapng file (draft-ietf-opsawg-pcapng): one little-endian section with one interface,
/// timestamps in microseconds. Pure.
class Pcapng {
  public:
    enum class Way : std::uint8_t { in = 1, out = 2 };  ///< values of epb_flags
    struct Packet {
        WallTime time{};
        Way way = Way::in;
        std::string bytes;
        std::vector<std::string> comments{};  ///< UTF-8; cut after kLongestComment bytes
    };
    static constexpr std::size_t kLongestComment = 1000;

    /// `link`: the link type of its packets (LINKTYPE_…).
    Pcapng(std::string_view application, std::string_view interface, std::uint16_t link);
    void add(const Packet& packet);
    /// Returns what was written since the last call: the next piece of the file.
    std::string take() { return std::exchange(text_, {}); }

  private:
    std::string text_;
};

inline constexpr std::uint16_t kExportedPdu = 252;  ///< LINKTYPE_WIRESHARK_UPPER_PDU

/// A frame as a Wireshark exported PDU: the dissector to use, then addresses and ports, as if the
/// master were 127.0.0.1 and station 31 were 127.0.1.31. Pure.
struct ExportedFrame {
    enum class Form : std::uint8_t {
        rtu,    ///< Modbus RTU
        tcp,    ///< translated to Modbus/TCP, without the CRC
        bytes,  ///< raw bytes
    };
    Form form = Form::bytes;
    bool request = false;  ///< from the master
    ByteView adu{};        ///< address to CRC
};
std::string exported_pdu(const ExportedFrame& frame);

/// True if Wireshark's Modbus RTU dissector recognizes this valid frame as a request or reply. It
/// goes by function and length alone (packet-mbtcp.c, 4.0), and does not know broadcasts or frames
/// shorter than five bytes.
bool is_seen_by_rtu(ByteView adu, bool request);

/// Exports a line's trace for Wireshark, which shows the frames as Modbus RTU without any
/// preference set. Frames that its RTU dissector does not understand (05, 06, broadcasts) are
/// exported as Modbus/TCP. Comments give the sender and reason of each frame, what was discarded
/// and what was decided. Pure.
class TracePcapng {
  public:
    TracePcapng(std::string_view version, std::string_view line);
    /// Adds the next part. A decision is attached to the frame that follows it, or to the last one.
    void add(const bus::TracePart& part);
    /// Returns what was written since the last call, except for the last packet.
    std::string take() { return file_.take(); }
    /// Returns the rest of the file.
    std::string finish();

  private:
    void add(Pcapng::Packet packet);
    Pcapng::Packet packet_of(const bus::TraceFrame& frame);
    ExportedFrame exported(const bus::TraceFrame& frame);

    Pcapng file_;
    std::optional<Pcapng::Packet> last_;
    bool as_tcp_ = false;               ///< the last request was exported as Modbus/TCP
    std::vector<std::string> decided_;  ///< decisions that no frame has followed yet
};

}  // namespace panelgate::web
