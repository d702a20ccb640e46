#include "panelgate/doctor/doctor.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/doctor/diagnose.hpp"

namespace panelgate::doctor {
namespace {

bool holds(const std::vector<Finding>& list, const Finding& finding) {
    return std::ranges::any_of(
        list, [&](const Finding& other) { return other.is_about_the_same(finding); });
}

/// Those of `list` that `other` does not have.
std::vector<Finding> without(const std::vector<Finding>& list, const std::vector<Finding>& other) {
    std::vector<Finding> rest;
    for (const Finding& finding : list) {
        if (!holds(other, finding)) rest.push_back(finding);
    }
    return rest;
}

}  // namespace

Doctor::Doctor(Settings settings, LineFacts facts)
    : settings_(settings), facts_(std::move(facts)) {}

void Doctor::begin(TimePoint now, Sample counted) {
    if (!marks_.empty()) {
        const Sample window = difference(counted, marks_.front().counted);
        const arbiter::Symptoms all = window.total();
        // Damage that goes on across openings, one after another, is one trouble.
        if (all.damaged() > 0 && all.answered == 0) return;
    }
    marks_.clear();
    marks_.push_back({now, std::move(counted)});
    looked_ = now;
}

Doctor::Change Doctor::look(TimePoint now, const Sample& counted) {
    if (marks_.empty()) begin(now, counted);
    looked_ = now;
    const Sample window = difference(counted, marks_.front().counted);
    Change change;
    if (window.attempts() > 0) {
        std::vector<Finding> found = diagnose(facts_, window, findings_);
        change.appeared = without(found, findings_);
        change.gone = without(findings_, found);
        findings_ = std::move(found);
    }
    if (due(now)) move_window(now, counted);
    return change;
}

void Doctor::move_window(TimePoint now, const Sample& counted) {
    marks_.push_back({now, counted});
    while (marks_.size() > 2) {
        const Mark& next = marks_[1];
        const bool enough = now - next.at >= settings_.window &&
                            difference(counted, next.counted).attempts() >= settings_.attempts;
        if (!enough && marks_.size() <= settings_.marks) return;
        marks_.pop_front();
    }
}

}  // namespace panelgate::doctor
