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

/// A file in the format of Wireshark's captures (draft-ietf-opsawg-pcapng): one section, little
/// endian, with one interface whose times are in microseconds. Pure.
class Pcapng {
  public:
    enum class Way : std::uint8_t { in = 1, out = 2 };  ///< as epb_flags has them
    struct Packet {
        WallTime time{};
        Way way = Way::in;
        std::string bytes;
        std::vector<std::string> comments{};  ///< UTF-8; cut after kLongestComment bytes
    };
    static constexpr std::size_t kLongestComment = 1000;

    /// `link`: what the bytes of its packets are (LINKTYPE_…).
    Pcapng(std::string_view application, std::string_view interface, std::uint16_t link);
    void add(const Packet& packet);
    /// What was written since the last call: pieces of one file.
    std::string take() { return std::exchange(text_, {}); }

  private:
    std::string text_;
};

inline constexpr std::uint16_t kExportedPdu = 252;  ///< LINKTYPE_WIRESHARK_UPPER_PDU

/// A frame as Wireshark's exported PDU: the dissector that shows it, then addresses and ports, as
/// if the master were 127.0.0.1 and station 31 were 127.0.1.31. Pure.
struct ExportedFrame {
    enum class Form : std::uint8_t {
        rtu,    ///< Modbus RTU
        tcp,    ///< as Modbus/TCP would say it, without the CRC
        bytes,  ///< nothing but bytes
    };
    Form form = Form::bytes;
    bool request = false;  ///< from the master
    ByteView adu{};        ///< address to CRC
};
std::string exported_pdu(const ExportedFrame& frame);

/// Does the dissector of Modbus RTU see that this good frame is a request, or a reply? It goes by
/// function and length alone (packet-mbtcp.c, 4.0), knows no broadcasts and nothing shorter than
/// five bytes.
bool is_seen_by_rtu(ByteView adu, bool request);

/// A line's trace for Wireshark, which shows its frames as Modbus RTU with no preference set, and
/// in the words of Modbus/TCP what it would not understand as RTU (05, 06, broadcasts). Who sent
/// each and why, what was thrown away and what was decided stand as comments. Pure.
class TracePcapng {
  public:
    TracePcapng(std::string_view version, std::string_view line);
    /// Parts in their order. A decision stands with the frame that follows it, or with the last.
    void add(const bus::TracePart& part);
    /// What was written since the last call: pieces of one file, but for its last packet.
    std::string take() { return file_.take(); }
    /// The rest of the file.
    std::string finish();

  private:
    void add(Pcapng::Packet packet);
    Pcapng::Packet packet_of(const bus::TraceFrame& frame);
    ExportedFrame exported(const bus::TraceFrame& frame);

    Pcapng file_;
    std::optional<Pcapng::Packet> last_;
    bool as_tcp_ = false;               ///< the last request
    std::vector<std::string> decided_;  ///< and no frame has followed yet
};

}  // namespace panelgate::web
