// Alarms: their rows, and what an alarm can be of.

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/doctor/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using alarms::Settings;
using yaml::Node;

constexpr Duration kLongest = 24h;

/// STATION/POINT
bool read_point(Reader& in, Settings& alarm) {
    const auto text = in.text("point");
    if (!text) return false;
    const auto path = parse_point_path(*text);
    if (!path) {
        in.problem("point", "point must be STATION/POINT such as oven/temperature, not " +
                                yaml::quote(*text));
        return false;
    }
    alarm.station = path->station;
    alarm.point = path->point;
    return true;
}

template <class List, class Name>
std::vector<std::string_view> names_in(const List& list, Name name) {
    std::vector<std::string_view> names;
    for (const auto& one : list) names.push_back(std::invoke(name, one));
    return names;
}

void check_station(Reader& in, const Settings& alarm) {
    if (alarm.point.empty())
        find_station(in, "station", alarm.station);
    else
        find_point(in.loading, in.mark("point"), {alarm.station, alarm.point});
}

void check_place(Reader& in, const Settings& alarm) {
    const std::vector<Line>& lines = in.loading.config.lines;
    if (!alarm.station.empty()) check_station(in, alarm);
    if (!alarm.line.empty() && std::ranges::find(lines, alarm.line, &Line::name) == lines.end())
        in.problem("line", yaml::no_such("line", alarm.line, names_in(lines, &Line::name)));
}

/// A condition belongs to what it is a condition of.
struct PlacedCondition {
    std::string_view key;
    std::string_view of;
    bool is_given = false;
};

/// A value that could not be read is given, too: its own fault is enough.
std::vector<PlacedCondition> conditions_of(Reader& in, const Settings& alarm) {
    std::vector<PlacedCondition> given{
        {"above", "point", in.has("above")},   {"below", "point", in.has("below")},
        {"equals", "point", in.has("equals")}, {"stale", "point", alarm.stale},
        {"offline", "station", alarm.offline}, {"down", "line", alarm.down},
        {"finding", "", in.has("finding")}};
    std::erase_if(given, [](const PlacedCondition& one) { return !one.is_given; });
    return given;
}

void check_condition(Reader& in, const Settings& alarm) {
    const std::vector<PlacedCondition> given = conditions_of(in, alarm);
    if (given.size() != 1)
        return in.problem("name",
                          "an alarm has one condition: above, below, equals or stale of a point, "
                          "offline of a station, down of a line, or finding");
    const std::string key(given.front().key);
    for (const std::string_view place : {"point", "station", "line"}) {
        const bool fits = given.front().of == place;
        const std::string name(place);
        if (fits && !in.has(place))
            in.problem(key,
                       key + " is a condition of a " + name + ": say which, by the key " + name);
        if (!fits && in.has(place)) in.problem(place, name + " does not go with " + key);
    }
    const bool wrong = alarm.back && ((alarm.above && *alarm.back > *alarm.above) ||
                                      (alarm.below && *alarm.back < *alarm.below));
    if (wrong || (alarm.back && !alarm.above && !alarm.below))
        in.problem("back", "back is where the alarm ends: below `above`, or above `below`");
}

/// TOPIC/alarm/NAME is the alarm's topic, and that of the point NAME of a station `alarm`.
void check_topic(Reader& in, const Settings& alarm) {
    const Config& config = in.loading.config;
    if (!config.mqtt || config.mqtt->format != mqtt::Format::json) return;
    for (const Line& line : config.lines)
        for (const Station& station : line.stations)
            if (station.name == "alarm" &&
                std::ranges::find(station.points, alarm.name, &points::Point::name) !=
                    station.points.end())
                in.problem("name", "the MQTT topic alarm/" + alarm.name +
                                       " is already that of the point alarm/" + alarm.name +
                                       "; name the alarm otherwise");
}

}  // namespace

std::optional<Settings> load_alarm(Reader& root, const Node& node) {
    Reader in(root.loading, node, "an alarm", "{name: hot, point: oven/temperature, above: 80}");
    Settings alarm;
    alarm_keys().read(in, alarm);
    check_unique(in, "alarm", alarm.name);
    check_condition(in, alarm);
    check_place(in, alarm);
    check_topic(in, alarm);
    in.finish();
    return alarm;
}

const Keys<alarms::WebhookSettings>& webhook_keys() {
    using alarms::WebhookSettings;
    using Format = WebhookSettings::Format;
    static constexpr Words<Format, 2> kFormats{
        {{"alertmanager", Format::alertmanager}, {"json", Format::json}}};
    const auto fault = [](std::string_view typed) {
        return alarms::parse_url(typed) ? std::string()
                                        : "url must be http://HOST:PORT/PATH or https://, such as "
                                          "http://alertmanager:9093/api/v2/alerts, not " +
                                              yaml::quote(typed);
    };
    static const auto kKeys =
        Keys<WebhookSettings>()
            .text("url", &WebhookSettings::url, {"^https?://.", false, 0, fault},
                  "Where changes of alarms are posted to, by http:// or https://.")
            .required()
            .example("http://127.0.0.1:9093/api/v2/alerts")
            .path("ca", &WebhookSettings::ca,
                  "File of the CA that has signed the server's certificate; with https://.")
            .example("/etc/panelgate/ca.crt")
            .word("format", &WebhookSettings::format, kFormats,
                  "alertmanager: what is active, again and again, and each end. json: each change "
                  "once.")
            .duration("every", &WebhookSettings::every, 1s, 1h,
                      "With alertmanager: how often what is active is told again.");
    return kKeys;
}

void check_webhook(Reader& in, alarms::WebhookSettings& hook) {
    const auto url = alarms::parse_url(hook.url);
    if (!url) return;
    if (url->secure && hook.ca.empty())
        in.problem("url", "https needs ca: the file of the CA that has signed the certificate of " +
                              url->host);
    if (!url->secure && !hook.ca.empty()) in.problem("ca", "ca is for https://");
    if (url->secure && !hook.ca.empty() && !in.loading.content_of(hook.ca))
        in.problem("ca", "cannot read " + hook.ca);
}

const Keys<Settings>& alarm_keys() {
    static constexpr Words<std::string_view, 4> kSeverities{
        {{"low", "low"}, {"medium", "medium"}, {"high", "high"}, {"urgent", "urgent"}}};
    static const auto kFindings = [] {
        Words<std::string_view, 1 + doctor::kCauses.size() + alarms::kGatewayCauses.size()> words{
            {{"any", "any"}}};
        const auto twice = [](std::string_view one) { return std::pair(one, one); };
        const auto rest = std::ranges::transform(doctor::kCauses, words.begin() + 1, twice).out;
        std::ranges::transform(alarms::kGatewayCauses, rest, twice);
        return words;
    }();
    static const auto kKeys =
        Keys<Settings>()
            .text("name", &Settings::name, name_form(), "Name of the alarm; unique.")
            .required()
            .example("oven-hot")
            .value(text_shape("point", {"^[^/]+/."}, "STATION/POINT that is watched."), read_point,
                   [](const Settings& of) {
                       return of.point.empty() ? "" : of.station + '/' + of.point;
                   })
            .example("oven/temperature")
            .value(
                text_shape("station", {}, "Station that may be offline."),
                [](Reader& in, Settings& into) {
                    const auto name = in.text("station");
                    if (name) into.station = *name;
                    return name.has_value();
                },
                [](const Settings& of) { return of.point.empty() ? of.station : ""; })
            .example("press")
            .text("line", &Settings::line, {}, "Line that may be down.")
            .example("floor1")
            .word("finding", &Settings::finding, kFindings,
                  "Cause of a finding of a line or of the gateway, or any.")
            .example("any")
            .boolean("stale", &Settings::stale, "The point's value is too old or unreadable.")
            .boolean("offline", &Settings::offline,
                     "The station does not answer, or its line is down.")
            .boolean("down", &Settings::down, "The line cannot be opened.")
            .number("above", &Settings::above, "Raised above this value.")
            .example("80")
            .number("below", &Settings::below, "Raised below this value.")
            .example("10")
            .number("equals", &Settings::equals, "Raised at this value.")
            .example("3")
            .number("back", &Settings::back, "Value at which it ends; without it the limit itself.")
            .example("78")
            .duration("for", &Settings::delay, 0ms, kLongest,
                      "How long the condition must hold before it is raised.")
            .word("severity", &Settings::severity, kSeverities, "How bad it is.")
            .text("text", &Settings::text, {}, "What operators read; without it the name.")
            .example("The oven is too hot");
    return kKeys;
}

}  // namespace panelgate::config
