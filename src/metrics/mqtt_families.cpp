#include "mqtt_families.hpp"

#include <cstdint>

namespace panelgate::metrics {
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

}  // namespace panelgate::metrics
