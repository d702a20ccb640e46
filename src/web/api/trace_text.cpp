#include "trace_text.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/base/wall_time.hpp"

namespace panelgate::web {
namespace {

constexpr const char* kHead =
    "TIME                              ID STATION REASON      OUTCOME     QUEUE     OUT   THINK"
    "      IN   TOTAL  CLIENT\n";
constexpr std::string_view kIndent = "                               ";

/// "12.3", or "-" for what did not happen.
std::string ms(const std::optional<TimePoint>& from, const std::optional<TimePoint>& to) {
    if (!from || !to) return "-";
    std::array<char, 32> text{};
    const int size = std::snprintf(text.data(), text.size(), "%.1f",
                                   to_milliseconds(std::max(*to - *from, Duration::zero())));
    return std::string(text.data(), static_cast<std::size_t>(size));
}

std::string right(std::string text, std::size_t width) {
    return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}
std::string left(std::string text, std::size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return text;
}

std::string frame_row(std::string_view mark, ByteView bytes, std::string_view note) {
    std::string row = std::string(kIndent) + std::string(mark) + ' ' + upper_hex(bytes);
    if (!note.empty()) row += "  " + std::string(note);
    return row + '\n';
}

std::string_view mark_of(FrameKind kind) {
    switch (direction_of(kind)) {
        case FrameDirection::sent:
            return ">";
        case FrameDirection::received:
            return "<";
        case FrameDirection::discarded:
            break;
    }
    return "x";
}

std::string row(const bus::TraceTransaction& one) {
    std::string text = rfc3339(one.time) + ' ' + right(std::to_string(one.id), 8) + ' ' +
                       right(std::to_string(one.station), 7) + ' ' + left(one.reason, 11) + ' ' +
                       left(std::string(label(one.end)), 9);
    const std::optional<TimePoint> end = one.answered       ? one.answered
                                         : one.last_byte_in ? one.last_byte_in
                                                            : one.last_bit_out;
    for (const std::string& figure :
         {ms(one.arrived, one.granted), ms(one.first_bit_out, one.last_bit_out),
          ms(one.last_bit_out, one.first_byte_in), ms(one.first_byte_in, one.last_byte_in),
          ms(one.arrived, end)})
        text += right(figure, 8);
    text += one.client.empty() ? "\n" : "  " + one.client + '\n';
    text += frame_row(">", one.request, "");
    if (!one.reply.empty()) text += frame_row("<", one.reply, "");
    for (const bus::TraceFrame& frame : one.discarded)
        text += frame_row("x", frame.bytes, label(frame.kind));
    return text;
}

std::string row(const bus::TraceDecision& one) {
    return rfc3339(one.time) + "  " + one.text + '\n';
}

/// Of a frame whose transaction is not in the part.
std::string row(const bus::TraceFrame& one) {
    return rfc3339(one.time) + "    " + std::string(mark_of(one.kind)) + ' ' +
           upper_hex(one.bytes) + "  " + std::string(label(one.kind)) + '\n';
}

}  // namespace

std::string trace_text(const bus::TracePart& part) {
    std::vector<std::pair<std::uint64_t, std::string>> rows;
    std::set<std::uint64_t> shown;
    for (const bus::TraceTransaction& one : part.transactions) {
        rows.emplace_back(one.first, row(one));
        shown.insert(one.id);
    }
    for (const bus::TraceFrame& one : part.frames) {
        if (!shown.contains(one.transaction)) rows.emplace_back(one.sequence, row(one));
    }
    for (const bus::TraceDecision& one : part.decisions) rows.emplace_back(one.sequence, row(one));
    std::ranges::sort(rows);
    std::string text = kHead;
    for (const auto& [sequence, line] : rows) text += line;
    return text;
}

}  // namespace panelgate::web
