#include "panelgate/scan/progress.hpp"

#include <algorithm>
#include <cmath>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/scanner.hpp"
#include "state.hpp"

namespace panelgate::scan {

namespace {

std::string time_text(Duration time) {
    const auto seconds = static_cast<long>(std::ceil(to_seconds(time)));
    if (seconds < 100) return std::to_string(seconds) + " s";
    return std::to_string((seconds + 59) / 60) + " min";
}

}  // namespace

std::string format_progress(const Progress& progress, std::size_t width) {
    const auto percent = static_cast<int>(100 * std::clamp(progress.share, 0.0, 1.0));
    std::string line = (percent < 10    ? "  "
                        : percent < 100 ? " "
                                        : "") +
                       std::to_string(percent) + " %, " +
                       (progress.found > 0 ? "about " : "at most ") +
                       time_text(progress.remaining) + " left, " + std::to_string(progress.found) +
                       " found: " + progress.what;
    line.resize(std::min(line.size(), width));
    return line;
}

namespace {

constexpr int kProbes = 12;        // of a typical recognition
constexpr Duration kProbe = 20ms;  // request, think time and reply

/// The far end's setting cannot be read: takes a format that all panels found support.
std::optional<SerialFormat> probable_format(const profile::Catalogue& profiles,
                                            const Result& result) {
    std::vector<const profile::PanelProfile*> panels;
    for (const StationFinding& finding : result.stations) {
        if (finding.candidates.empty()) continue;
        const auto* panel = profiles.find(finding.candidates.front().profile);
        if (panel != nullptr) panels.push_back(panel);
    }
    return common_format(profiles, panels);
}

}  // namespace

/// Sums first pass, second pass and other CRC order for stations assumed silent, and the
/// examination of stations that have answered.
Duration Scanner::State::asking_cost() const {
    const Duration wire = frame_time(format, modbus::kReadRequestAdu);
    const auto first = static_cast<std::int64_t>(first_pass.size());
    const auto second = static_cast<std::int64_t>(second_pass.size()) + first;
    std::int64_t high_first = static_cast<std::int64_t>(high_first_pass.size());
    for (const auto* pass : {&first_pass, &second_pass}) {
        high_first += std::ranges::count_if(
            *pass, [this](std::uint8_t station) { return station_may_be_high_first(station); });
    }
    const Duration examining = settings.repeats * (settings.settle + kProbe) + kProbes * kProbe;
    const auto open = static_cast<std::int64_t>(to_examine.size()) + (examination ? 1 : 0);
    return first * (settings.first_timeout + wire) + second * (settings.second_timeout + wire) +
           high_first * (settings.first_timeout + wire) + open * examining;
}

std::string Scanner::State::activity() const {
    const std::string where = settings.remote ? "" : to_string(format) + ", ";
    if (phase == Phase::listening) return where + "listening";
    if (examination) return where + "looking at station " + std::to_string(examination->station());
    if (!attempt) return where + "asking";
    return where + "station " + std::to_string(attempt->request().station());
}

Progress Scanner::progress(TimePoint now) const {
    const State& state = *state_;
    Progress progress;
    progress.found = state.answered.size();
    progress.what = state.activity();
    switch (state.phase) {
        case State::Phase::listening:
        case State::Phase::searching:
            progress.remaining = state.plan.cost(state.settings) + std::max(state.due(), now) - now;
            break;
        case State::Phase::asking:
            progress.remaining = state.asking_cost() + std::max(state.due(), now) - now;
            break;
        case State::Phase::done:
            break;
    }
    const Duration gone = now - state.started;
    const double all = to_seconds(gone + progress.remaining);
    progress.share = all > 0 ? to_seconds(gone) / all : 1;
    return progress;
}

Result Scanner::result() const {
    const State& state = *state_;
    Result result = state.result;
    if (state.examination) result.stations.push_back(state.examination->finding());
    for (const std::uint8_t station : state.to_examine) {
        StationFinding finding;
        finding.station = station;
        result.stations.push_back(std::move(finding));
    }
    for (StationFinding& finding : result.stations) {
        const auto seen = state.other_evidence.find(finding.station);
        if (seen == state.other_evidence.end()) continue;
        finding.evidence.twice += seen->second.twice;
        finding.evidence.late += seen->second.late;
    }
    if (!result.stations.empty() || !result.talk.empty()) {
        result.format =
            result.remote ? probable_format(state.profiles, result) : state.known_format();
        if (result.remote && result.format && state.format.mode == SerialMode::ascii) {
            const int baud = result.format->baud;  // manuals give nothing else for ASCII
            result.format = state.format;
            result.format->baud = baud;
        }
    }
    std::ranges::sort(result.stations, std::less(), &StationFinding::station);
    mark_duplicates(result);
    return result;
}

}  // namespace panelgate::scan
