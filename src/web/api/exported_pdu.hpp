#pragma once

#include <cstdint>
#include <string>

#include "panelgate/base/bytes.hpp"

namespace panelgate::web {

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

}  // namespace panelgate::web
