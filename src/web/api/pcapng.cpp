#include "pcapng.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::web {

namespace {

constexpr std::uint32_t kSection = 0x0A0D0D0A;
constexpr std::uint32_t kInterface = 1;
constexpr std::uint32_t kPacket = 6;
constexpr std::uint32_t kByteOrder = 0x1A2B3C4D;

constexpr std::uint16_t kEndOfOptions = 0;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kPacketFlags = 2;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kApplication = 4;
constexpr std::uint16_t kTimeResolution = 9;
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

}  // namespace

Pcapng::Pcapng(std::string_view application, std::string_view interface, std::uint16_t link) {
    std::string section;
    put(section, kByteOrder, 4);
    put(section, 1, 2);  // version 1.0
    put(section, 0, 2);
    put(section, UINT64_MAX, 8);  // section length unknown
    put_option(section, kApplication, application);
    put_option(section, kEndOfOptions, {});
    put_block(text_, kSection, section);

    std::string described;
    put(described, link, 2);
    put(described, 0, 2);
    put(described, 0, 4);  // snapshot length: no limit
    put_option(described, kInterfaceName, interface);
    put_option(described, kTimeResolution, std::string_view(&kMicroseconds, 1));
    put_option(described, kEndOfOptions, {});
    put_block(text_, kInterface, described);
}

void Pcapng::add(const Packet& packet) {
    const auto time = static_cast<std::uint64_t>(packet.time.time_since_epoch().count());
    std::string body;
    put(body, 0, 4);  // the interface
    put(body, time >> 32, 4);
    put(body, time, 4);
    put(body, packet.bytes.size(), 4);
    put(body, packet.bytes.size(), 4);
    body += packet.bytes;
    pad(body);
    std::string flags;
    put(flags, static_cast<std::uint64_t>(packet.way), 4);
    put_option(body, kPacketFlags, flags);
    for (const std::string& comment : packet.comments)
        put_option(body, kComment, std::string_view(comment).substr(0, kLongestComment));
    put_option(body, kEndOfOptions, {});
    put_block(text_, kPacket, body);
}

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

namespace {

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

TracePcapng::TracePcapng(std::string_view version, std::string_view line)
    : file_("panelgate " + std::string(version), line, kExportedPdu) {}

/// Damaged frames are exported as plain bytes. A reply is exported like its request, or Wireshark
/// would not match them.
ExportedFrame TracePcapng::exported(const bus::TraceFrame& frame) {
    ExportedFrame made;
    made.adu = frame.bytes;
    made.request = is_request(frame.kind);
    if (frame.kind == FrameKind::damaged || frame.bytes.size() < modbus::kMinAdu) return made;
    const bool seen = is_seen_by_rtu(frame.bytes, made.request);
    if (made.request) as_tcp_ = !seen;
    made.form =
        seen && (made.request || !as_tcp_) ? ExportedFrame::Form::rtu : ExportedFrame::Form::tcp;
    return made;
}

Pcapng::Packet TracePcapng::packet_of(const bus::TraceFrame& frame) {
    Pcapng::Packet packet;
    packet.time = frame.time;
    packet.way =
        direction_of(frame.kind) == FrameDirection::sent ? Pcapng::Way::out : Pcapng::Way::in;
    const ExportedFrame shown = exported(frame);
    packet.bytes = exported_pdu(shown);
    packet.comments = comments_on(frame);
    if (shown.form == ExportedFrame::Form::tcp)
        packet.comments.push_back("on the wire, as RTU: " + upper_hex(frame.bytes));
    return packet;
}

void TracePcapng::add(const bus::TracePart& part) {
    auto decision = part.decisions.begin();
    const auto decide_until = [&](std::uint64_t sequence) {
        for (; decision != part.decisions.end() && decision->sequence < sequence; ++decision)
            decided_.push_back("decided: " + decision->text);
    };
    for (const bus::TraceFrame& frame : part.frames) {
        decide_until(frame.sequence);
        add(packet_of(frame));
    }
    decide_until(UINT64_MAX);
}

void TracePcapng::add(Pcapng::Packet packet) {
    std::ranges::move(std::exchange(decided_, {}), std::back_inserter(packet.comments));
    if (last_) file_.add(*last_);
    last_ = std::move(packet);
}

std::string TracePcapng::finish() {
    if (last_) {
        std::ranges::move(std::exchange(decided_, {}), std::back_inserter(last_->comments));
        file_.add(*std::exchange(last_, std::nullopt));
    }
    return file_.take();
}

}  // namespace panelgate::web
