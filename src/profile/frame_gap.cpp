#include "panelgate/profile/frame_gap.hpp"

#include <algorithm>
#include <chrono>

namespace panelgate::profile {

Duration asked_gap(const SerialFormat& serial, const PanelProfile& profile) {
    if (serial.mode == SerialMode::ascii) return {};
    const double characters = profile.timing.frame_gap_characters;
    return std::chrono::duration_cast<Duration>(characters * character_time(serial));
}

Duration automatic_gap(const SerialFormat& serial, const PanelProfile& profile) {
    return std::max(silent_interval(serial), asked_gap(serial, profile));
}

}  // namespace panelgate::profile
