#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/trace.hpp"

namespace panelgate::web {

/// Exports a line's trace as a pcapng file (draft-ietf-opsawg-pcapng) for Wireshark, which shows
/// the frames as Modbus RTU without any preference set. Frames that its RTU dissector does not
/// understand (05, 06, broadcasts) are exported as Modbus/TCP. Comments give the sender and reason
/// of each frame, what was discarded and what was decided. Pure.
class TracePcapng {
  public:
    TracePcapng(std::string_view version, std::string_view line);
    /// Adds the next part. A decision is attached to the frame that follows it, or to the last one.
    void add(const bus::TracePart& part);
    /// Returns what was written since the last call, except for the last packet.
    std::string take() { return std::exchange(text_, {}); }
    /// Returns the rest of the file.
    std::string finish();

  private:
    struct Packet {
        WallTime time{};
        bool sent = false;
        std::string bytes;                  ///< an exported PDU of Wireshark
        std::vector<std::string> comments;  ///< UTF-8
    };

    Packet packet_of(const bus::TraceFrame& frame);
    /// Writes the last packet with the decisions that have followed it.
    void write_last();

    std::string text_;
    std::optional<Packet> last_;
    bool as_tcp_ = false;               ///< the last request was exported as Modbus/TCP
    std::vector<std::string> decided_;  ///< decisions that no frame has followed yet
};

}  // namespace panelgate::web
