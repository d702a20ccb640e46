#include "panelgate/store/entry.hpp"

#include <algorithm>
#include <array>

namespace panelgate::store {

namespace {

constexpr std::array<std::string_view, 17> kKinds = {
    "start",        "stop",           "reload",          "line_up",
    "line_down",    "station_online", "station_offline", "finding",
    "finding_gone", "write",          "refused",         "login_failed",
    "discovery",    "alarm_raised",   "alarm_cleared",   "alarm_acknowledged",
    "standby"};

}  // namespace

std::string_view label(Kind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

std::optional<Kind> kind_of(std::string_view label) {
    const auto* const found = std::ranges::find(kKinds, label);
    if (found == kKinds.end()) return std::nullopt;
    return static_cast<Kind>(found - kKinds.begin());
}

std::string known_kinds() {
    std::string text;
    for (const std::string_view kind : kKinds) {
        if (!text.empty()) text += kind == kKinds.back() ? " and " : ", ";
        text += kind;
    }
    return text;
}

}  // namespace panelgate::store
