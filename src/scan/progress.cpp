#include "panelgate/scan/progress.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace panelgate::scan
