#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exported_pdu.hpp"
#include "panelgate/bus/trace.hpp"
#include "pcapng.hpp"

namespace panelgate::web {

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
