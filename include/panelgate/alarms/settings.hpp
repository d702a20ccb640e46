#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::alarms {

struct Settings {
    static constexpr std::size_t kMost = 1000;  ///< alarms of a gateway

    std::string name{};
    std::string station{};  ///< of the point, or that may be offline
    std::string point{};    ///< "": the alarm is of no point
    std::string line{};     ///< that may be down
    std::string finding{};  ///< a cause, or "any"; "": the alarm is of no finding
    // The condition: exactly one of these, or `finding`.
    std::optional<double> above{};
    std::optional<double> below{};
    std::optional<double> equals{};
    bool stale = false;    ///< of the point
    bool offline = false;  ///< of the station
    bool down = false;     ///< of the line

    std::optional<double> back{};  ///< where `above` and `below` end; nullopt: at the limit
    Duration delay{};              ///< how long the condition must hold
    std::string severity = "high";
    std::string text{};  ///< for operators; "": the name

    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::alarms
