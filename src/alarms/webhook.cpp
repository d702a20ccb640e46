#include "panelgate/alarms/webhook.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>

#include "panelgate/base/text.hpp"

namespace panelgate::alarms {

namespace json = boost::json;

namespace {

constexpr Duration kFirstPause = 1s;
constexpr Duration kLongestPause = 60s;

/// An alert of Alertmanager's API (POST /api/v2/alerts). Without `endsAt` it is active.
json::object alert_of(const Settings& alarm, const Status& status) {
    json::object labels{{"alertname", alarm.name}, {"severity", alarm.severity}};
    if (!alarm.station.empty()) labels["station"] = alarm.station;
    if (!alarm.point.empty()) labels["point"] = alarm.point;
    if (!alarm.line.empty()) labels["line"] = alarm.line;
    json::object annotations{{"summary", alarm.shown()}};
    if (status.value) annotations["value"] = number_text(*status.value);
    return {{"labels", std::move(labels)},
            {"annotations", std::move(annotations)},
            {"startsAt", rfc3339(status.since)}};
}

std::string_view word(Change::Kind kind) {
    if (kind == Change::Kind::raised) return "raised";
    return kind == Change::Kind::cleared ? "cleared" : "acknowledged";
}

}  // namespace

std::optional<Url> parse_url(std::string_view text) {
    Url url;
    url.secure = text.starts_with("https://");
    if (!url.secure && !text.starts_with("http://")) return std::nullopt;
    if (url.secure) url.port = 443;
    text.remove_prefix(text.find("//") + 2);
    const std::size_t end = std::min(text.find('/'), text.size());
    std::string_view place = text.substr(0, end);
    url.path = end == text.size() ? "/" : std::string(text.substr(end));
    const std::size_t colon = place.rfind(':');
    const std::size_t bracket = place.rfind(']');
    if (colon != place.npos && (bracket == place.npos || colon > bracket)) {
        const auto port = to_number<std::uint16_t>(place.substr(colon + 1));
        if (!port || *port == 0) return std::nullopt;
        url.port = *port;
        place = place.substr(0, colon);
    }
    if (place.starts_with('[') && place.ends_with(']')) place = place.substr(1, place.size() - 2);
    url.host = place;
    const bool odd = place.empty() || place.find_first_of("@ \t\"'<>\\") != place.npos;
    if (odd || url.path.find_first_of(" \t\r\n") != std::string::npos) return std::nullopt;
    return url;
}

json::object describe(const Settings& alarm, const Status& status) {
    json::object object;
    object["name"] = alarm.name;
    object["state"] = label(status.state);
    object["severity"] = alarm.severity;
    object["since"] = nullptr;
    if (status.since != WallTime()) object["since"] = rfc3339(status.since);
    object["value"] = nullptr;
    if (status.value) object["value"] = *status.value;
    object["text"] = alarm.shown();
    object["acknowledged_by"] = nullptr;
    if (!status.by.empty()) object["acknowledged_by"] = status.by;
    object["station"] = alarm.station;
    object["point"] = alarm.point;
    return object;
}

void Webhook::on_change(const Change& change) {
    fresh_ = true;
    if (settings_.format == WebhookSettings::Format::json) {
        json::object text = describe(*change.alarm, change.now);
        text["change"] = word(change.kind);
        changes_.push_back(json::serialize(text));
        if (changes_.size() <= kWaiting) return;
        changes_.pop_front();
        ++lost_;
        return;
    }
    Alert& alert = alerts_[change.alarm->name];
    if (change.kind == Change::Kind::raised) alert = {alert_of(*change.alarm, change.now)};
    if (change.kind == Change::Kind::cleared) {
        if (alert.text.empty()) alert.text = alert_of(*change.alarm, change.now);
        alert.text["endsAt"] = rfc3339(change.now.since);
        alert.ended = true;
    }
    if (alert.text.empty()) alerts_.erase(change.alarm->name);
}

std::string Webhook::all_alerts() {
    json::array list;
    for (auto& [name, alert] : alerts_) {
        list.push_back(alert.text);
        alert.told = alert.ended;
    }
    return json::serialize(list);
}

std::optional<std::string> Webhook::next(TimePoint now) {
    const bool is_due = again_ ? *again_ <= now : fresh_;
    if (!is_due && !(fresh_ && pause_ == Duration())) return std::nullopt;
    again_.reset();
    fresh_ = false;
    if (settings_.format == WebhookSettings::Format::json) {
        if (changes_.empty()) return std::nullopt;
        return changes_.front();
    }
    if (alerts_.empty()) return std::nullopt;
    return all_alerts();
}

void Webhook::settle(TimePoint now, bool taken) {
    if (!taken) {
        pause_ = pause_ == Duration() ? kFirstPause : std::min(2 * pause_, kLongestPause);
        again_ = now + pause_;
        return;
    }
    pause_ = Duration();
    if (settings_.format == WebhookSettings::Format::json) {
        changes_.pop_front();
        fresh_ = !changes_.empty();
        return;
    }
    std::erase_if(alerts_, [](const auto& one) { return one.second.told; });
    if (!alerts_.empty()) again_ = now + settings_.every;
}

std::optional<TimePoint> Webhook::due() const {
    if (fresh_ && pause_ == Duration()) return TimePoint();
    return again_;
}

}  // namespace panelgate::alarms
