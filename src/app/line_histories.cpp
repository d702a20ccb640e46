#include "line_histories.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/base/slot_ring.hpp"

namespace panelgate::app {

using bus::LineHistory;

LineHistories::LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines)
    : clock_(clock), alarm_(clock.make_alarm()) {
    apply(std::move(lines));
}

void LineHistories::apply(std::vector<const bus::LineBus*> lines) {
    const Duration width = slot_width(lines.size() * LineHistory::kColumns, LineHistory::kSpan,
                                      LineHistory::kNarrowest, kBytes);
    const auto before = std::exchange(histories_, {});
    for (const bus::LineBus* line : lines) {
        const auto known =
            static_cast<std::size_t>(std::ranges::find(lines_, line) - lines_.begin());
        const bool stays = known < before.size() && before[known]->width() == width;
        histories_.push_back(stays ? before[known] : std::make_shared<LineHistory>(width));
    }
    if (lines_ == lines) return;
    lines_ = std::move(lines);
    if (running_) start();
}

void LineHistories::stop() {
    running_ = false;
    alarm_->cancel();
}

void LineHistories::start() {
    running_ = true;
    alarm_->cancel();
    if (lines_.empty()) return;
    began_ = clock_.now();
    looks_ = 0;
    look();
}

/// The looks are spread over a slot; one that comes late moves none that follows, and counts for
/// when it was due, so that each falls into a slot of its own.
void LineHistories::look() {
    const auto count = static_cast<std::int64_t>(lines_.size());
    const Duration pause = histories_.front()->width() / count;
    const auto line = static_cast<std::size_t>(looks_ % count);
    histories_[line]->record(began_ + looks_ * pause, lines_[line]->report());
    looks_ = std::max(looks_ + 1, (clock_.now() - began_) / pause);
    alarm_->arm(began_ + looks_ * pause, [this] { look(); });
}

}  // namespace panelgate::app
