#include "trace_pcapng.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/frame_kind.hpp"

namespace panelgate::web {
namespace {

constexpr std::uint16_t kExportedPdu = 252;  ///< LINKTYPE_WIRESHARK_UPPER_PDU

/// Of exported PDUs: wireshark/exported_pdu.h.
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
/// The dissector takes what goes to port 0, where it has none configured, for a request.
constexpr std::uint32_t kMastersPort = 1;
constexpr std::uint32_t kStationsPort = 0;

struct Wrapped {
    std::string_view dissector;
    bool request = false;
    std::uint8_t station = 0;
};

std::string text_of(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

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

std::string wrapped(const Wrapped& how, ByteView bytes) {
    const std::uint32_t panel = kStation + how.station;
    Writer out(64 + bytes.size());
    put_tag(out, Tag::dissector, how.dissector);
    put_tag(out, Tag::ipv4_source, how.request ? kMaster : panel);
    put_tag(out, Tag::ipv4_destination, how.request ? panel : kMaster);
    put_tag(out, Tag::port_type, kTcp);
    put_tag(out, Tag::source_port, how.request ? kMastersPort : kStationsPort);
    put_tag(out, Tag::destination_port, how.request ? kStationsPort : kMastersPort);
    put_tag(out, Tag::end, std::string_view());
    out.raw(bytes);
    return text_of(out.take());
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

/// What is damaged is shown as the bytes that it is.
Pcapng::Packet packet_of(const bus::TraceFrame& frame) {
    Wrapped how;
    how.dissector = frame.kind == FrameKind::damaged ? "data" : "mbrtu";
    how.request = is_request(frame.kind);
    if (!frame.bytes.empty()) how.station = frame.bytes.front();
    Pcapng::Packet packet;
    packet.time = frame.time;
    packet.way =
        direction_of(frame.kind) == FrameDirection::sent ? Pcapng::Way::out : Pcapng::Way::in;
    packet.bytes = wrapped(how, frame.bytes);
    packet.comments = comments_on(frame);
    return packet;
}

}  // namespace

TracePcapng::TracePcapng(std::string_view version, std::string_view line)
    : file_("panelgate " + std::string(version), line, kExportedPdu) {}

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
