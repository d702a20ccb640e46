// What the gateway tells of itself: findings, usage, metrics.
#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/gateway/build_info.hpp"
#include "panelgate/gateway/gateway.hpp"
#include "panelgate/gateway/reloader.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/rt/loop.hpp"
#include "panelgate/tls/judge.hpp"

namespace panelgate::gateway {

/// Takes what one line has counted, and then the next: all lines at once would take long.
void Gateway::look_for_findings() {
    const std::size_t count = snapshot_->lines.size();
    next_line_ = count > 0 ? (next_line_ + 1) % count : 0;
    if (next_line_ < count)
        minutes_[snapshot_->config->lines[next_line_].name] =
            snapshot_->lines[next_line_]->record_minute();
    findings();
    const auto share = static_cast<std::int64_t>(std::max<std::size_t>(count, 1));
    looking_->arm(clock_.now() + bus::LastMinute::kStep / share, [this] { look_for_findings(); });
}

std::vector<web::LineUsage> Gateway::usage() const {
    std::vector<web::LineUsage> usage;
    for (std::size_t i = 0; i < snapshot_->lines.size(); ++i)
        usage.push_back({snapshot_->config->lines[i].name, snapshot_->lines[i]->last_minute()});
    return usage;
}

Findings::State Gateway::state() const {
    const config::Config& config = *snapshot_->config;
    Findings::State state;
    for (const config::Line& line : config.lines)
        if (const auto known = minutes_.find(line.name); known != minutes_.end())
            state.lines.push_back({line.name, known->second});
    const auto broker = northbound_.counters();
    if (broker && !broker->connected && config.mqtt) state.broker_away = config.mqtt->broker();
    if (audit_.is_kept() && audit_.counters().failing) state.audit_fails = config.audit->file;
    state.writes_stop = audit_.refuses_writes();
    if (const auto store = journal_.counters(); store && store->failing) {
        state.store_fails = journal_.file();
        state.store_why = journal_.why();
    }
    if (!reloads_->counters().last_succeeded) state.refused = reloads_->last();
    for (const ServedCertificate& one : certificates())
        if (const std::int64_t end = tls::summary_of(one.settings.material.certificate).end;
            end > 0)
            state.certificates.push_back({one.listener, end});
    return state;
}

/// As they are now, but for a second; overloads as of the line's last look.
const std::vector<web::Finding>& Gateway::findings() {
    constexpr Duration kRest = 1s;
    if (clock_.now() - looked_ >= kRest) {
        looked_ = clock_.now();
        findings_.judge(looked_, rt::wall_now(), state());
    }
    return findings_.list();
}

/// All figures but those of points, and of the process.
metrics::Snapshot Gateway::figures() {
    metrics::Snapshot figures;
    for (const auto& line : snapshot_->lines) figures.lines.push_back(line->bus().report());
    for (const web::Finding& one : findings())
        figures.findings.push_back({one.line, one.cause, one.name});
    for (const web::StandbyView::Line& line : standby_.view().lines)
        figures.active[line.name] = line.role == standby::label(standby::Role::active);
    figures.relays = relay_samples(relays_->status());
    servers_.copy_figures(figures);
    figures.mqtt = northbound_.counters();
    figures.store = journal_.counters();
    for (const web::AlarmView& alarm : alarms_.list())
        figures.alarms.push_back(
            {alarm.settings.name, alarm.settings.severity, alarm.status.is_active()});
    if (certificates_) figures.renewals = certificates_->renewals();
    if (audit_.is_kept()) figures.audit = audit_.counters();
    if (reloads_->barred(false).empty()) figures.reloads = reloads_->counters();
    figures.version = PANELGATE_VERSION;
    figures.commit = build_commit();
    figures.compiler = build_compiler();
    figures.runtime.log_lines_dropped = rt::log_lines_dropped();
    figures.runtime.loop_lag = lag_.seconds();
    return figures;
}

std::function<std::string()> Gateway::metrics_text() {
    const auto copy = std::make_shared<metrics::Snapshot>(figures());
    return [copy, points = seen_points(snapshot_->plant, clock_.now()),
            snapshot = rt::lend(loops_.plant, std::shared_ptr<const Snapshot>(snapshot_))] {
        copy->points = samples_of(points);
        copy->process = metrics::read_process_facts();
        return metrics::exposition(*copy);
    };
}

/// A finding that comes or goes is an entry of the journal.
void Gateway::on_finding(const web::Finding& finding, bool is_new) {
    store::Entry entry;
    entry.kind = is_new ? store::Kind::finding : store::Kind::finding_gone;
    entry.severity = is_new ? "warning" : "info";
    entry.line = finding.line;
    entry.text = finding.cause + ": " + finding.text;
    journal_.add(std::move(entry));
}

}  // namespace panelgate::gateway
