#pragma once

#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "panelgate/alarms/alarms.hpp"
#include "panelgate/alarms/settings.hpp"

namespace panelgate::alarms {

/// An alarm as REST, events, MQTT and webhooks tell it.
boost::json::object describe(const Settings& alarm, const Status& status);

/// Decides what a webhook sends, and when. What was not taken is sent again, after 1 s, then twice
/// as long, up to a minute. Pure; time is an argument.
class Webhook {
  public:
    static constexpr std::size_t kWaiting = 1000;  ///< changes of format json; then the oldest go

    explicit Webhook(WebhookSettings settings) : settings_(std::move(settings)) {}

    /// Takes new settings of the same format. Waiting changes are posted to the new URL.
    void apply(WebhookSettings settings) { settings_ = std::move(settings); }
    void on_change(const Change& change);
    /// The body of a request that is due. settle() must follow before the next call.
    std::optional<std::string> next(TimePoint now);
    /// The request was answered with 2xx, or not.
    void settle(TimePoint now, bool taken);
    /// When next() should be called again; nullopt: after the next change.
    std::optional<TimePoint> due() const;
    const WebhookSettings& settings() const { return settings_; }
    /// Changes that were never sent.
    std::uint64_t lost() const { return lost_; }

  private:
    /// An alarm that is active, or whose end was not sent yet.
    struct Alert {
        boost::json::object text{};
        bool ended = false;
        bool told = false;  ///< the end is in the request that is under way
    };

    std::string all_alerts();

    WebhookSettings settings_;
    std::map<std::string, Alert> alerts_;  ///< of format alertmanager, by name
    std::deque<std::string> changes_;      ///< of format json
    bool fresh_ = false;                   ///< something changed since the last request
    std::optional<TimePoint> again_{};
    Duration pause_{};  ///< of the next retry
    std::uint64_t lost_ = 0;
};

}  // namespace panelgate::alarms
