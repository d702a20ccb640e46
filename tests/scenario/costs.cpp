#include "costs.hpp"

#include <algorithm>

#include "panelgate/base/serial_format.hpp"

namespace panelgate::scenario {

Costs::Costs(const Plan& plan, const Watch& watch) : settings_(plan.settings), watch_(watch) {
    for (const PanelPlan& panel : plan.panels) {
        const bool flaps = panel.flapping > Duration::zero();
        if (panel.dead || flaps || panel.reboots > Duration::zero()) ++mortals_;
        if (flaps) deaths_ += 0.5 / to_seconds(panel.flapping);
        if (panel.reboots > Duration::zero()) deaths_ += 1 / to_seconds(panel.reboots);
    }
    scanned_ = std::ranges::any_of(plan.clients, &ClientPlan::scans);
}

/// Both frames, gaps at both ends, a full receive FIFO, and whatever a gap was lengthened to.
Duration Costs::frames(const Attempt& attempt) const {
    constexpr std::size_t kShortReply = 60;
    return attempt.sent - attempt.started + frame_time(settings_.serial, kShortReply) +
           2 * silent_interval(settings_.serial) + 25ms;
}

Duration Costs::surprise() const {
    return settings_.unlisted.response_timeout + frame_time(settings_.serial, 60) +
           2 * silent_interval(settings_.serial) + 25ms;
}

/// Each silence is waited for as long as the user has said (T1).
Duration Costs::limit(const Attempt& attempt) const {
    return settings_.unlisted.response_timeout + frames(attempt);
}

std::string Costs::on_unanswered(TimePoint now, const Attempt& attempt, bool wanted) {
    if (!attempt.dead) return {};
    const Duration most = settings_.unlisted.response_timeout + frames(attempt);
    const Duration cost = std::min(now - attempt.started, most);
    dead_ += cost;
    // A death costs its first silence, whenever it happens.
    const bool unforeseen = !attempt.was_silent && !attempt.again;
    if (!wanted || unforeseen) return {};
    constexpr int kShare = 5;  // a fifth
    level_ = std::max(level_ - (now - level_at_) / kShare, Duration{}) + cost;
    level_at_ = now;
    // Where only one dies its reads are retried as configured (T1).
    const int in_advance = static_cast<int>(mortals_) + 2 + settings_.unlisted.retries;
    if (!scanned_ && level_ > surprise() * in_advance)
        return "P4: silent stations take more than a fifth of the line";
    return {};
}

void Costs::on_answered(TimePoint now, const Attempt& attempt) {
    good_ += now - attempt.started + silent_interval(settings_.serial);
}

/// Beyond what each death costs until it is known: 5 %.
std::string Costs::at_end(Duration elapsed) const {
    const double seconds = to_seconds(elapsed);
    const double known_after = 1 + settings_.offline.after;
    const double first = (mortals_ + deaths_ * seconds) * known_after * to_seconds(surprise());
    const double dead = to_seconds(dead_);
    if (scanned_ || seconds < 20 || dead <= 0.05 * seconds + first) return {};
    return "P4: dead stations took " + std::to_string(100 * dead / seconds) + " % of the time";
}

double Costs::good_share(Duration elapsed) const {
    return elapsed > Duration::zero() ? to_seconds(good_) / to_seconds(elapsed) : 0;
}

}  // namespace panelgate::scenario
