#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "panelgate/mqtt/settings.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::mqtt {

/// A station as Home Assistant knows a device. Borrowed for the call.
struct HomeStation {
    std::string_view name;
    std::string_view profile;
    std::vector<const points::Point*> points{};
};

/// A message that never changes: retained, sent with each connection.
struct Notice {
    std::string topic;
    std::string payload;
};

/// The message by which Home Assistant (2024.11 and later) finds a station's points: device
/// discovery of its MQTT integration, with one component a point.
Notice home_assistant_notice(const Settings& settings, const HomeStation& station);
/// What is told before `now`, so that Home Assistant drops components that `now` lacks: `now`, with
/// the platform alone of each component that goes. "" if none goes. Both are payloads of
/// home_assistant_notice().
std::string home_assistant_farewell(std::string_view before, std::string_view now);

}  // namespace panelgate::mqtt
