#include "panelgate/gateway/findings.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "panelgate/rt/log.hpp"
#include "panelgate/tls/judge.hpp"

namespace panelgate::gateway {

using web::Finding;

namespace {

constexpr double kFull = 95;       // % of a minute
constexpr double kStillFull = 80;  // ... for an overload that stands
constexpr std::size_t kClients = 10;
constexpr std::int64_t kDay = 24 * 3600;

bool is_about_the_same(const Finding& one, const Finding& other) {
    return one.cause == other.cause && one.name == other.name;
}

std::string percent(double value) { return std::to_string(std::lround(value)) + " %"; }

/// "10.0.0.7 (87 %), poll of press (9 %)"
std::string who_asks(const std::vector<bus::HostUse>& hosts) {
    constexpr std::size_t kNamed = 3;
    std::string text;
    for (std::size_t i = 0; i < std::min(hosts.size(), kNamed); ++i)
        text += (i > 0 ? ", " : "") + hosts[i].name + " (" + percent(hosts[i].percent) + ')';
    return text;
}

Finding broker(const std::string& name) {
    return {.cause = "broker-away",
            .line = {},
            .name = name,
            .text = "The MQTT broker " + name + " is not connected: values do not reach it.",
            .advice =
                "See whether the broker runs and can be reached; `mqtt not connected` in the "
                "log says why.",
            .evidence = {}};
}

Finding audit(const std::string& file, bool writes_stop) {
    return {
        .cause = "audit-fails",
        .line = {},
        .name = file,
        .text = "The audit cannot be written to " + file +
                (writes_stop ? ", so every write is refused." : ": records wait, then are lost."),
        .advice =
            "`audit fails` in the log says why: a full disk, a folder that is not there, "
            "or rights.",
        .evidence = {}};
}

Finding store(const std::string& file, const std::string& why) {
    return {
        .cause = "store-fails",
        .line = {},
        .name = file,
        .text = "Events and history cannot be written to " + file + ": they are lost meanwhile.",
        .advice =
            "A full disk, a folder that is not there, or rights: mend it, or name another "
            "file in `store`.",
        .evidence = why};
}

std::string why_of(const web::ReloadVerdict& verdict) {
    if (verdict.faults.empty()) return verdict.why;
    const auto& fault = verdict.faults.front();
    std::string place = fault.file;
    if (fault.line > 0)
        place += ':' + std::to_string(fault.line) + ':' + std::to_string(fault.column);
    return place + ": " + fault.text;
}

Finding reload(const web::ReloadVerdict& verdict) {
    return {.cause = "reload-refused",
            .line = {},
            .name = "configuration",
            .text =
                "The last reload was refused: the gateway goes on with the former "
                "configuration, and would not start with the file as it is.",
            .advice = "Mend the file (`panelgate check`), and reload.",
            .evidence = why_of(verdict)};
}

Finding certificate(const Findings::Certificate& one, std::int64_t now) {
    const bool has_ended = one.end <= now;
    const auto days = static_cast<std::uint64_t>(std::max<std::int64_t>(one.end - now, 0) / kDay);
    const std::string date = tls::date_text(one.end);
    return {.cause = "certificate-expires",
            .line = {},
            .name = one.listener,
            .text = "The certificate of " + one.listener +
                    (has_ended ? " has expired on " + date + ": the other side refuses it."
                               : " expires on " + date + ", in " + std::to_string(days) + " days."),
            .advice = "Put a new certificate in its place; the gateway takes it over by itself.",
            .evidence = {},
            .figures = {{"days", days}}};
}

void log_change(const Finding& finding, bool is_new) {
    const std::string about = finding.cause + ' ' + finding.name;
    if (is_new)
        rt::log_about(about, rt::LogLevel::warn, "gateway finding",
                      {{"cause", finding.cause}, {"name", finding.name}, {"text", finding.text}});
    else
        rt::log_about(about, rt::LogLevel::info, "gateway finding gone",
                      {{"cause", finding.cause}, {"name", finding.name}});
}

}  // namespace

void Findings::tell(const Finding& finding, bool is_new) const {
    log_change(finding, is_new);
    if (tell_) tell_(finding, is_new);
}

const Finding* Findings::find(const Finding& like) const {
    const auto found = std::ranges::find_if(
        list_, [&](const Finding& one) { return is_about_the_same(one, like); });
    return found == list_.end() ? nullptr : &*found;
}

/// An overload that stands goes when the line has some rest, and refused nothing for a minute.
std::optional<Finding> Findings::overload(const web::LineUsage& usage) const {
    const bus::MinuteUse& minute = usage.minute;
    Finding finding{.cause = "overload",
                    .line = usage.line,
                    .name = usage.line,
                    .text = {},
                    .advice = {},
                    .evidence = {}};
    const bool stands = find(finding) != nullptr;
    const bool is_full = minute.load_percent > (stands ? kStillFull : kFull);
    const bool refuses = stands ? minute.all.no_turn > 0 : minute.refuses;
    if (minute.span < 1min || (!is_full && !refuses)) return std::nullopt;
    finding.text = "Line " + usage.line + " is overloaded: " + percent(minute.load_percent) +
                   " of the last minute it was in use" +
                   (minute.all.no_turn > 0 ? ", and requests found no turn." : ".");
    finding.advice =
        "Ask less often or in blocks, give stations a `max_age`, raise the baud, or take stations "
        "to a second line.";
    finding.evidence = std::to_string(minute.all.no_turn) + " of " +
                       std::to_string(minute.all.requests) + " requests found no turn";
    if (!minute.hosts.empty()) finding.evidence += "; most is asked by " + who_asks(minute.hosts);
    finding.figures = {
        {"load_percent", static_cast<std::uint64_t>(std::lround(minute.load_percent))},
        {"no_turn", minute.all.no_turn},
        {"requests", minute.all.requests}};
    finding.clients = minute.hosts;
    if (finding.clients.size() > kClients) finding.clients.resize(kClients);
    return finding;
}

bool Findings::is_broker_away(TimePoint now, const std::string& broker) {
    if (broker.empty())
        broker_away_since_.reset();
    else if (!broker_away_since_)
        broker_away_since_ = now;
    return broker_away_since_ && now - *broker_away_since_ >= kBrokerMayBeAway;
}

void Findings::judge(TimePoint now, WallTime wall, const State& state) {
    std::vector<Finding> found;
    for (const web::LineUsage& usage : state.lines)
        if (auto finding = overload(usage)) found.push_back(std::move(*finding));
    if (is_broker_away(now, state.broker_away)) found.push_back(broker(state.broker_away));
    if (!state.audit_fails.empty()) found.push_back(audit(state.audit_fails, state.writes_stop));
    if (!state.store_fails.empty()) found.push_back(store(state.store_fails, state.store_why));
    if (state.refused) found.push_back(reload(*state.refused));
    const auto seconds = static_cast<std::int64_t>(wall_seconds_of(wall));
    for (const Certificate& one : state.certificates)
        if (one.end - seconds < tls::kAnnouncedDays * kDay)
            found.push_back(certificate(one, seconds));
    for (Finding& finding : found) {
        const Finding* const before = find(finding);
        finding.since = before != nullptr ? before->since : wall;
        if (before == nullptr) tell(finding, true);
    }
    for (const Finding& before : list_)
        if (std::ranges::none_of(
                found, [&](const Finding& one) { return is_about_the_same(one, before); }))
            tell(before, false);
    list_ = std::move(found);
}

}  // namespace panelgate::gateway
