#include "line_histories.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/base/slot_ring.hpp"

namespace panelgate::app {

using bus::LineHistory;

LineHistories::LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines)
    : clock_(clock), lines_(std::move(lines)), alarm_(clock.make_alarm()) {
    const Duration width = slot_width(lines_.size() * LineHistory::kColumns, LineHistory::kSpan,
                                      LineHistory::kNarrowest, kBytes);
    for (std::size_t i = 0; i < lines_.size(); ++i) histories_.emplace_back(width);
}

void LineHistories::start() {
    if (lines_.empty()) return;
    began_ = clock_.now();
    look();
}

/// The looks are spread over a slot; one that comes late moves none that follows, and counts for
/// when it was due, so that each falls into a slot of its own.
void LineHistories::look() {
    const auto count = static_cast<std::int64_t>(lines_.size());
    const Duration pause = histories_.front().width() / count;
    const auto line = static_cast<std::size_t>(looks_ % count);
    histories_[line].record(began_ + looks_ * pause, lines_[line]->report());
    looks_ = std::max(looks_ + 1, (clock_.now() - began_) / pause);
    alarm_->arm(began_ + looks_ * pause, [this] { look(); });
}

}  // namespace panelgate::app
