#include "trace_page.hpp"

#include <algorithm>

namespace panelgate::web {
namespace {

std::uint64_t last_number(const TracePage& page) {
    const std::uint64_t frame = page.frames.empty() ? 0 : page.frames.back().sequence;
    const std::uint64_t decision = page.decisions.empty() ? 0 : page.decisions.back().sequence;
    return std::max(frame, decision);
}

/// Leaves the oldest of both.
void cut(TracePage& page, std::size_t most) {
    std::size_t frames = 0;
    std::size_t decisions = 0;
    while (frames + decisions < most) {
        const bool has_frame = frames < page.frames.size();
        const bool has_decision = decisions < page.decisions.size();
        if (!has_frame && !has_decision) return;
        const bool frame_is_next =
            !has_decision ||
            (has_frame && page.frames[frames].sequence < page.decisions[decisions].sequence);
        ++(frame_is_next ? frames : decisions);
    }
    page.frames.resize(frames);
    page.decisions.resize(decisions);
}

}  // namespace

TracePage last_of_trace(const bus::BusClient& bus, std::size_t most) {
    TracePage page{bus.trace(most), bus.decisions(most)};
    page.next = last_number(page);
    return page;
}

TracePage trace_since(const bus::BusClient& bus, std::uint64_t since, std::size_t most) {
    TracePage page{bus.trace_since(since, most), bus.decisions_since(since, most)};
    cut(page, most);
    page.next = last_number(page);
    if (page.next == 0) page.next = std::min(since, last_of_trace(bus, 1).next);
    return page;
}

}  // namespace panelgate::web
