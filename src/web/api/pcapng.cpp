#include "pcapng.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/web/api/render.hpp"

namespace panelgate::web {

namespace {

constexpr std::uint32_t kSection = 0x0A0D0D0A;
constexpr std::uint32_t kInterface = 1;
constexpr std::uint32_t kPacket = 6;
constexpr std::uint32_t kByteOrder = 0x1A2B3C4D;

constexpr std::uint16_t kExportedPdu = 252;    ///< LINKTYPE_WIRESHARK_UPPER_PDU
constexpr std::size_t kLongestComment = 1000;  ///< bytes

constexpr std::uint16_t kEndOfOptions = 0;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kPacketFlags = 2;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kApplication = 4;
constexpr std::uint16_t kTimeResolution = 9;
constexpr std::uint64_t kReceived = 1;  ///< values of epb_flags
constexpr std::uint64_t kSent = 2;
constexpr char kMicroseconds = 6;  ///< 10 to the -6

void put(std::string& text, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xFF);
}

/// Pads to a multiple of four bytes.
void pad(std::string& text) { text.append((4 - text.size() % 4) % 4, '\0'); }

void put_option(std::string& body, std::uint16_t code, std::string_view value) {
    put(body, code, 2);
    put(body, value.size(), 2);
    body += value;
    pad(body);
}

/// The length is written at both ends, so that a file can be read backwards.
void put_block(std::string& text, std::uint32_t type, const std::string& body) {
    constexpr std::size_t kAround = 12;
    put(text, type, 4);
    put(text, body.size() + kAround, 4);
    text += body;
    put(text, body.size() + kAround, 4);
}

/// How a frame is exported. The addresses are as if the master were 127.0.0.1 and station 31 were
/// 127.0.1.31.
enum class Form : std::uint8_t {
    rtu,    ///< Modbus RTU
    tcp,    ///< translated to Modbus/TCP, without the CRC
    bytes,  ///< raw bytes
};

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
constexpr std::uint32_t kStationsPort =
    502;  ///< by which the Modbus/TCP dissector distinguishes requests from replies
constexpr std::size_t kCrc = 2;

std::string_view dissector_of(Form form) {
    if (form == Form::bytes) return "data";
    return form == Form::rtu ? "mbrtu" : "mbtcp";
}

void put_tag(Writer& out, Tag tag, std::uint32_t value) {
    out.u16(static_cast<std::uint16_t>(tag)).u16(4).u16(value >> 16).u16(value & 0xFFFF);
}

/// Padded with zeros to a multiple of four.
void put_tag(Writer& out, Tag tag, std::string_view text) {
    const std::size_t size = (text.size() + 3) / 4 * 4;
    out.u16(static_cast<std::uint16_t>(tag)).u16(static_cast<unsigned>(size));
    for (std::size_t i = 0; i < size; ++i)
        out.u8(i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0);
}

/// The frame (address to CRC) as an exported PDU: the dissector to use, addresses and ports, bytes.
std::string exported_pdu(ByteView adu, Form form, bool request) {
    const std::uint32_t station = kStation + (adu.empty() ? 0 : adu.front());
    Writer out(80 + adu.size());
    put_tag(out, Tag::dissector, dissector_of(form));
    put_tag(out, Tag::ipv4_source, request ? kMaster : station);
    put_tag(out, Tag::ipv4_destination, request ? station : kMaster);
    put_tag(out, Tag::port_type, kTcp);
    put_tag(out, Tag::source_port, request ? kMastersPort : kStationsPort);
    put_tag(out, Tag::destination_port, request ? kStationsPort : kMastersPort);
    put_tag(out, Tag::end, std::string_view());
    if (form == Form::tcp) {
        adu = adu.first(adu.size() - kCrc);
        out.u16(0).u16(0).u16(static_cast<unsigned>(adu.size()));
    }
    out.raw(adu);
    const Bytes text = out.take();
    return {text.begin(), text.end()};
}

/// True if Wireshark's Modbus RTU dissector recognizes this valid frame as a request or reply. It
/// goes by function and length alone (packet-mbtcp.c, 4.0), and does not know broadcasts or frames
/// shorter than five bytes.
bool is_seen_by_rtu(ByteView adu, bool request) {
    constexpr std::size_t kShort = 8;  ///< a request to read, a confirmed write of several
    if (adu.size() < 5 || adu[0] == 0) return false;
    if ((adu[1] & 0x80) != 0) return !request && adu.size() == 5;
    switch (adu[1]) {
        case 1:
        case 2:
            // A request for an address from 0x300 on looks like a reply with three bytes of data.
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

bool is_request(FrameKind kind) {
    return direction_of(kind) == FrameDirection::sent || kind == FrameKind::heard_request ||
           kind == FrameKind::foreign_request || kind == FrameKind::echo;
}

std::vector<std::string> comments_on(const bus::TraceFrame& frame) {
    std::vector<std::string> comments;
    std::string what(label(frame.kind));
    if (direction_of(frame.kind) == FrameDirection::discarded) what = "discarded: " + what;
    if (frame.transaction != 0) what += ", transaction " + std::to_string(frame.transaction);
    comments.push_back(std::move(what));
    if (!frame.why.empty()) comments.push_back(frame.why);
    return comments;
}

}  // namespace

TracePcapng::TracePcapng(std::string_view version, std::string_view line) {
    std::string section;
    put(section, kByteOrder, 4);
    put(section, 1, 2);  // version 1.0
    put(section, 0, 2);
    put(section, UINT64_MAX, 8);  // section length unknown
    put_option(section, kApplication, "panelgate " + std::string(version));
    put_option(section, kEndOfOptions, {});
    put_block(text_, kSection, section);

    std::string described;
    put(described, kExportedPdu, 2);
    put(described, 0, 2);
    put(described, 0, 4);  // snapshot length: no limit
    put_option(described, kInterfaceName, line);
    put_option(described, kTimeResolution, std::string_view(&kMicroseconds, 1));
    put_option(described, kEndOfOptions, {});
    put_block(text_, kInterface, described);
}

/// Damaged frames are exported as plain bytes. A reply is exported like its request, or Wireshark
/// would not match them.
TracePcapng::Packet TracePcapng::packet_of(const bus::TraceFrame& frame) {
    const bool request = is_request(frame.kind);
    Form form = Form::bytes;
    if (frame.kind != FrameKind::damaged && frame.bytes.size() >= modbus::kMinAdu) {
        const bool seen = is_seen_by_rtu(frame.bytes, request);
        if (request) as_tcp_ = !seen;
        form = seen && (request || !as_tcp_) ? Form::rtu : Form::tcp;
    }
    Packet packet;
    packet.time = frame.time;
    packet.sent = direction_of(frame.kind) == FrameDirection::sent;
    packet.bytes = exported_pdu(frame.bytes, form, request);
    packet.comments = comments_on(frame);
    if (form == Form::tcp)
        packet.comments.push_back("on the wire, as RTU: " + upper_hex(frame.bytes));
    return packet;
}

void TracePcapng::write_last() {
    if (!last_) return;
    const auto time = static_cast<std::uint64_t>(last_->time.time_since_epoch().count());
    std::string body;
    put(body, 0, 4);  // the interface
    put(body, time >> 32, 4);
    put(body, time, 4);
    put(body, last_->bytes.size(), 4);
    put(body, last_->bytes.size(), 4);
    body += last_->bytes;
    pad(body);
    std::string flags;
    put(flags, last_->sent ? kSent : kReceived, 4);
    put_option(body, kPacketFlags, flags);
    for (const std::string& comment : last_->comments)
        put_option(body, kComment, std::string_view(comment).substr(0, kLongestComment));
    put_option(body, kEndOfOptions, {});
    put_block(text_, kPacket, body);
    last_.reset();
}

void TracePcapng::add(const bus::TracePart& part) {
    auto decision = part.decisions.begin();
    const auto decide_until = [&](std::uint64_t sequence) {
        for (; decision != part.decisions.end() && decision->sequence < sequence; ++decision)
            decided_.push_back("decided: " + decision->text);
    };
    for (const bus::TraceFrame& frame : part.frames) {
        decide_until(frame.sequence);
        write_last();
        last_ = packet_of(frame);
        std::ranges::move(std::exchange(decided_, {}), std::back_inserter(last_->comments));
    }
    decide_until(UINT64_MAX);
}

std::string TracePcapng::finish() {
    if (last_) std::ranges::move(std::exchange(decided_, {}), std::back_inserter(last_->comments));
    write_last();
    return take();
}

}  // namespace panelgate::web
