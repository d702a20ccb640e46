#include "trace_pcapng.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "answer.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::web {
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

/// What is damaged is shown as the bytes that it is. A reply has the form of its request, or
/// Wireshark would not find them together.
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
