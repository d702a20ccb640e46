#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::alarms {

/// Causes of findings of the gateway, not of a line: an alarm may name each.
inline constexpr std::array<std::string_view, 6> kGatewayCauses{
    "broker-away",    "audit-fails",         "store-fails",
    "reload-refused", "certificate-expires", "overload"};

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

    /// What operators read.
    const std::string& shown() const { return text.empty() ? name : text; }
    friend bool operator==(const Settings&, const Settings&) = default;
};

/// Where changes of alarms are sent to.
struct WebhookSettings {
    enum class Format : std::uint8_t {
        alertmanager,  ///< all that is active, again and again, and each end
        json           ///< each change once
    };
    std::string url{};  ///< parse_url() takes it
    std::string ca{};   ///< file of the CA that has signed the server's certificate, for https
    Format format = Format::alertmanager;
    Duration every = 60s;  ///< between two reports of what stays active

    friend bool operator==(const WebhookSettings&, const WebhookSettings&) = default;
};

/// The parts of "http://alerts.plant:9093/api/v2/alerts".
struct Url {
    bool secure = false;      ///< https
    std::string host{};       ///< without brackets
    std::uint16_t port = 80;  ///< 443 of https, where the text names none
    std::string path{};       ///< with its query; begins with '/'
};
/// Nothing if the text is no URL of HTTP, or names a user.
std::optional<Url> parse_url(std::string_view text);

}  // namespace panelgate::alarms
