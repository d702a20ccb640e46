#include "panelgate/points/report.hpp"

#include <cmath>

namespace panelgate::points {

namespace {

bool is_change(const ReportRule& rule, const PointReading& before, const PointReading& now) {
    const auto from = before.good_number();
    const auto to = now.good_number();
    if (!rule.deadband || !from || !to) return before.value != now.value;
    return std::abs(*to - *from) >= *rule.deadband && *to != *from;
}

}  // namespace

Report Told::judge(const ReportRule& rule, const PointReading& reading, TimePoint now) const {
    if (!last_ || last_->quality != reading.quality) return Report::changed;
    const Duration passed = now - at_;
    if (rule.at_least && passed >= *rule.at_least) return Report::again;
    if (rule.at_most && passed < *rule.at_most) return Report::none;
    return is_change(rule, *last_, reading) ? Report::changed : Report::none;
}

Report Told::take(const ReportRule& rule, const PointReading& reading, TimePoint now) {
    const Report report = judge(rule, reading, now);
    if (report == Report::none) return report;
    last_ = reading;
    at_ = now;
    return report;
}

}  // namespace panelgate::points
