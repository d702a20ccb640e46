#include "families.hpp"

#include <prometheus/text_serializer.h>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "panelgate/tls/counters.hpp"

namespace panelgate::metrics {

using prometheus::ClientMetric;
using prometheus::MetricType;

void Families::push_back(prometheus::MetricFamily family) {
    if (ended_ || family.metric.empty()) return;
    std::vector<prometheus::MetricFamily> one;
    one.push_back(std::move(family));
    std::ostringstream text;
    prometheus::TextSerializer{}.Serialize(text, one);
    ended_ = !sink_(text.view());
}

Family::Family(std::string name, std::string help, MetricType type) {
    family_.name = std::move(name);
    family_.help = std::move(help);
    family_.type = type;
}

ClientMetric& Family::add(Labels labels) {
    ClientMetric& metric = family_.metric.emplace_back();
    metric.label = std::move(labels);
    return metric;
}

void Family::counter(Labels labels, double value) { add(std::move(labels)).counter.value = value; }

void Family::gauge(Labels labels, double value) { add(std::move(labels)).gauge.value = value; }

void Family::histogram(Labels labels, const Histogram& histogram) {
    ClientMetric::Histogram& out = add(std::move(labels)).histogram;
    for (std::size_t i = 0; i < Histogram::kBounds.size(); ++i) {
        out.sample_count += histogram.counts[i];
        out.bucket.push_back({out.sample_count, Histogram::kBounds[i]});
    }
    out.sample_count += histogram.counts.back();
    out.sample_sum = histogram.sum;
}

Family make_counter(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Counter};
}

Family make_gauge(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Gauge};
}

Family make_histogram(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Histogram};
}

namespace {

void add_handshakes(Family& family, const std::string& listener, const tls::Counters& tls) {
    for (std::size_t i = 0; i < tls.handshakes.size(); ++i)
        family.counter({{"listener", listener}, {"outcome", std::string(tls::kOutcomeWords[i])}},
                       tls.handshakes[i]);
}

}  // namespace

void add_tls(Families& out, const Snapshot& snapshot) {
    Family handshakes = make_counter("panelgate_tls_handshakes_total",
                                     "TLS handshakes of clients, by how they ended.");
    Family expiry =
        make_gauge("panelgate_certificate_expiry_timestamp_seconds",
                   "When the certificate that a listener shows to new clients stops being "
                   "valid, or the one that the gateway shows to its MQTT broker.");
    const auto add = [&](const std::string& listener, const tls::Counters& tls) {
        if (tls.certificate_expiry == 0) return;
        add_handshakes(handshakes, listener, tls);
        expiry.gauge({{"listener", listener}}, static_cast<double>(tls.certificate_expiry));
    };
    for (const tcp_server::Counters& listener : snapshot.listeners)
        add(listener.listener, listener.tls);
    if (snapshot.http) add(snapshot.http->listener, snapshot.http->tls);
    if (snapshot.mqtt && snapshot.mqtt->certificate_expiry != 0)
        expiry.gauge({{"listener", snapshot.mqtt->broker}},
                     static_cast<double>(snapshot.mqtt->certificate_expiry));
    Family renewals = make_counter("panelgate_certificate_renewals_total",
                                   "New certificate files of a listener, by what became of them: "
                                   "replaced those in use, or not taken, so that those were kept.");
    for (const auto& [listener, count] : snapshot.renewals) {
        renewals.counter({{"listener", listener}, {"outcome", "replaced"}}, count.replaced);
        renewals.counter({{"listener", listener}, {"outcome", "kept"}}, count.kept);
    }
    out.push_back(handshakes.take());
    out.push_back(expiry.take());
    out.push_back(renewals.take());
}

void add_http(Families& out, const Snapshot& snapshot) {
    if (!snapshot.http) return;
    Family requests =
        make_counter("panelgate_http_requests_total", "HTTP requests answered, by status.");
    for (const auto& [code, count] : snapshot.http->requests) {
        requests.counter({{"code", std::to_string(code)}}, count);
    }
    Family failures =
        make_counter("panelgate_login_failures_total", "HTTP requests with an unknown token.");
    failures.counter({}, snapshot.http->login_failures);
    Family uses = make_gauge("panelgate_token_last_use_timestamp_seconds",
                             "When a request came with the token last; absent until the first.");
    for (const auto& [token, when] : snapshot.http->token_uses)
        uses.gauge({{"token", token}}, when);
    out.push_back(requests.take());
    out.push_back(failures.take());
    out.push_back(uses.take());
}

namespace {

void add_counter(Families& out, const char* name, const char* help, std::uint64_t value) {
    Family family = make_counter(name, help);
    family.counter({}, value);
    out.push_back(family.take());
}

void add_writes(Families& out, const mqtt::Counters& mqtt) {
    Family writes =
        make_counter("panelgate_mqtt_writes_total", "Writes of points that came by the broker.");
    writes.counter({{"outcome", "ok"}}, mqtt.writes_ok);
    writes.counter({{"outcome", "refused"}}, mqtt.writes_refused);
    writes.counter({{"outcome", "failed"}}, mqtt.writes_failed);
    out.push_back(writes.take());
}

}  // namespace

void add_mqtt(Families& out, const Snapshot& snapshot) {
    if (!snapshot.mqtt) return;
    const mqtt::Counters& mqtt = *snapshot.mqtt;
    Family connected =
        make_gauge("panelgate_mqtt_connected", "1 while the broker has accepted the gateway.");
    connected.gauge({}, mqtt.connected ? 1 : 0);
    out.push_back(connected.take());
    Family stored =
        make_gauge("panelgate_mqtt_stored", "Changes that the broker has not acknowledged yet.");
    stored.gauge({}, static_cast<double>(mqtt.stored));
    out.push_back(stored.take());
    add_counter(out, "panelgate_mqtt_published_total",
                "Messages handed to the broker, repetitions included.", mqtt.published);
    add_counter(out, "panelgate_mqtt_dropped_total",
                "Changes lost because the broker was away for longer than the store lasts.",
                mqtt.dropped);
    add_counter(out, "panelgate_mqtt_results_dropped_total",
                "Answers to writes lost because too many waited for the broker.",
                mqtt.results_dropped);
    add_counter(out, "panelgate_mqtt_reconnects_total",
                "Connections to the broker after the first.", mqtt.reconnects);
    add_writes(out, mqtt);
}

void add_audit(Families& out, const Snapshot& snapshot) {
    if (!snapshot.audit) return;
    const audit::Counters& audit = *snapshot.audit;
    Family up = make_gauge("panelgate_audit_up", "1 while records of the audit reach the disk.");
    up.gauge({}, audit.failing ? 0 : 1);
    out.push_back(up.take());
    add_counter(out, "panelgate_audit_records_total", "Records of the audit that are on the disk.",
                audit.records);
    add_counter(out, "panelgate_audit_lost_total",
                "Records lost because the disk took nothing for longer than the buffer lasts.",
                audit.lost);
    add_counter(out, "panelgate_audit_failures_total", "Times that writing the audit has failed.",
                audit.failures);
    add_counter(out, "panelgate_audit_rotations_total", "Files of the audit that have been filled.",
                audit.rotations);
}

void add_store(Families& out, const Snapshot& snapshot) {
    if (!snapshot.store) return;
    const store::Counters& store = *snapshot.store;
    const auto gauge = [&out](const char* name, const char* text, double value) {
        Family one = make_gauge(name, text);
        one.gauge({}, value);
        out.push_back(one.take());
    };
    gauge("panelgate_store_up", "1 while the store takes events and values.",
          store.failing ? 0 : 1);
    gauge("panelgate_store_bytes", "Size of the store.", static_cast<double>(store.bytes));
    add_counter(out, "panelgate_store_writes_total", "Events and blocks of values that are stored.",
                store.written);
    add_counter(out, "panelgate_store_lost_total",
                "Events and blocks of values that queue or disk did not take.", store.lost);
}

void add_alarms(Families& out, const Snapshot& snapshot) {
    if (snapshot.alarms.empty()) return;
    Family active = make_gauge("panelgate_alarm_active",
                               "1 while the alarm's condition holds, acknowledged or not.");
    for (const Snapshot::Alarm& alarm : snapshot.alarms)
        active.gauge({{"alarm", alarm.name}, {"severity", alarm.severity}}, alarm.active ? 1 : 0);
    out.push_back(active.take());
}

void add_points(Families& out, const Snapshot& snapshot) {
    Family value = make_gauge("panelgate_point_value",
                              "Value of a point; absent when the last attempt to read it failed.");
    Family age = make_gauge("panelgate_point_age_seconds",
                            "Time since a point was read; absent when it never was.");
    for (const points::PointSample& point : snapshot.points) {
        const Labels labels{
            {"line", point.line}, {"station", point.station}, {"point", point.point}};
        if (point.age) age.gauge(labels, *point.age);
        if (!point.value) continue;
        Labels with_unit = labels;
        with_unit.push_back({"unit", point.unit});
        value.gauge(std::move(with_unit), *point.value);
    }
    out.push_back(value.take());
    out.push_back(age.take());
}

void add_relays(Families& out, const Snapshot& snapshot) {
    Family up = make_gauge("panelgate_relay_up", "1 when the last transfer of a relay succeeded.");
    Family reads = make_counter("panelgate_relay_reads_total", "Reads of a relay's source.");
    Family writes = make_counter("panelgate_relay_writes_total", "Writes of a relay's target.");
    Family repairs =
        make_counter("panelgate_relay_repairs_total",
                     "Writes of a relay's target because another client had written to it.");
    Family failures =
        make_counter("panelgate_relay_failures_total", "Reads and writes of a relay that failed.");
    for (const points::RelaySample& relay : snapshot.relays) {
        up.gauge({{"relay", relay.relay}}, relay.ok ? 1 : 0);
        const auto side = [&](Family& family, const char* name, std::uint64_t count) {
            family.counter({{"relay", relay.relay}, {"side", name}}, static_cast<double>(count));
        };
        reads.counter({{"relay", relay.relay}}, static_cast<double>(relay.reads));
        writes.counter({{"relay", relay.relay}}, static_cast<double>(relay.writes));
        repairs.counter({{"relay", relay.relay}}, static_cast<double>(relay.repairs));
        side(failures, "source", relay.read_failures);
        side(failures, "target", relay.write_failures);
    }
    out.push_back(up.take());
    out.push_back(reads.take());
    out.push_back(writes.take());
    out.push_back(repairs.take());
    out.push_back(failures.take());
}

namespace {

using serial_server::Counters;

struct MasterCounter {
    const char* name;
    const char* help;
    std::uint64_t Counters::* field;
};
constexpr MasterCounter kCounters[] = {
    {"panelgate_serial_master_requests_total",
     "Requests of a serial master to units that are served, broadcasts and repetitions included.",
     &Counters::requests},
    {"panelgate_serial_master_broadcasts_total", "Broadcasts of a serial master.",
     &Counters::broadcasts},
    {"panelgate_serial_master_repeated_total",
     "Requests of a serial master that got the answer of the same one before.",
     &Counters::repeated},
    {"panelgate_serial_master_replies_total", "Replies sent to a serial master.",
     &Counters::replies},
    {"panelgate_serial_master_exceptions_total", "Exceptions among the replies.",
     &Counters::exceptions},
    {"panelgate_serial_master_silent_total", "Failures answered to a serial master by silence.",
     &Counters::silent},
    {"panelgate_serial_master_superseded_total",
     "Requests given up because the serial master had begun to talk again.", &Counters::superseded},
    {"panelgate_serial_master_late_total",
     "Replies not sent because the serial master's timeout had passed.", &Counters::late},
    {"panelgate_serial_master_foreign_frames_total",
     "Good frames to and of units that are not served on a serial master's port.",
     &Counters::foreign},
    {"panelgate_serial_master_damaged_frames_total",
     "Bytes on a serial master's port that became no good frame, counted once a frame.",
     &Counters::damaged},
    {"panelgate_serial_master_reopens_total",
     "Successful opens of a serial master's port after the first.", &Counters::reopens},
};

}  // namespace

void add_serial_masters(Families& out, const Snapshot& snapshot) {
    if (snapshot.serial_masters.empty()) return;
    Family up = make_gauge("panelgate_serial_master_up", "1 while a serial master's port is open.");
    for (const Counters& master : snapshot.serial_masters)
        up.gauge({{"master", master.master}}, master.up ? 1 : 0);
    out.push_back(up.take());
    for (const MasterCounter& counter : kCounters) {
        Family family = make_counter(counter.name, counter.help);
        for (const Counters& master : snapshot.serial_masters)
            family.counter({{"master", master.master}}, master.*counter.field);
        out.push_back(family.take());
    }
}

}  // namespace panelgate::metrics
