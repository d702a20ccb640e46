#include "exported_pdu.hpp"

#include <cstddef>
#include <string_view>

namespace panelgate::web {
namespace {

using Form = ExportedFrame::Form;

/// wireshark/exported_pdu.h
enum class Tag : std::uint16_t {
    end = 0,
    dissector = 12,
    ipv4_source = 20,
    ipv4_destination = 21,
    port_type = 24,
    source_port = 25,
    destination_port = 26,
};
constexpr std::uint32_t kTcp = 2;                  ///< EXP_PDU_PT_TCP
constexpr std::uint32_t kMaster = 0x7F'00'00'01;   ///< 127.0.0.1
constexpr std::uint32_t kStation = 0x7F'00'01'00;  ///< 127.0.1.ID
constexpr std::uint32_t kMastersPort = 1;
constexpr std::uint32_t kStationsPort = 502;  ///< by which Modbus/TCP tells requests from replies
constexpr std::size_t kCrc = 2;

std::string_view dissector_of(Form form) {
    if (form == Form::bytes) return "data";
    return form == Form::rtu ? "mbrtu" : "mbtcp";
}

void put_tag(Writer& out, Tag tag, std::uint32_t value) {
    out.u16(static_cast<std::uint16_t>(tag)).u16(4).u16(value >> 16).u16(value & 0xFFFF);
}

/// Filled up with zeros to a multiple of four.
void put_tag(Writer& out, Tag tag, std::string_view text) {
    const std::size_t size = (text.size() + 3) / 4 * 4;
    out.u16(static_cast<std::uint16_t>(tag)).u16(static_cast<unsigned>(size));
    for (std::size_t i = 0; i < size; ++i)
        out.u8(i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0);
}

}  // namespace

std::string exported_pdu(const ExportedFrame& frame) {
    const std::uint32_t station = kStation + (frame.adu.empty() ? 0 : frame.adu.front());
    Writer out(80 + frame.adu.size());
    put_tag(out, Tag::dissector, dissector_of(frame.form));
    put_tag(out, Tag::ipv4_source, frame.request ? kMaster : station);
    put_tag(out, Tag::ipv4_destination, frame.request ? station : kMaster);
    put_tag(out, Tag::port_type, kTcp);
    put_tag(out, Tag::source_port, frame.request ? kMastersPort : kStationsPort);
    put_tag(out, Tag::destination_port, frame.request ? kStationsPort : kMastersPort);
    put_tag(out, Tag::end, std::string_view());
    ByteView bytes = frame.adu;
    if (frame.form == Form::tcp) {
        bytes = bytes.first(bytes.size() - kCrc);
        out.u16(0).u16(0).u16(static_cast<unsigned>(bytes.size()));
    }
    out.raw(bytes);
    const Bytes text = out.take();
    return {text.begin(), text.end()};
}

bool is_seen_by_rtu(ByteView adu, bool request) {
    constexpr std::size_t kShort = 8;  ///< a request to read, a confirmed write of several
    if (adu.size() < 5 || adu[0] == 0) return false;
    if ((adu[1] & 0x80) != 0) return !request && adu.size() == 5;
    switch (adu[1]) {
        case 1:
        case 2:
            // With an address from 0x300 on it looks like a reply of three bytes.
            return request ? adu.size() == kShort && adu[2] != 3
                           : adu.size() != kShort || adu[2] == 3;
        case 3:
        case 4:
            return (adu.size() == kShort) == request;
        case 15:
        case 16:
            return (adu.size() > kShort) == request;
        default:
            return false;
    }
}

}  // namespace panelgate::web
