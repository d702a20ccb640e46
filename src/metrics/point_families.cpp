#include "point_families.hpp"

namespace panelgate::metrics {

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
    Family repairs = make_counter("panelgate_relay_repairs_total",
                                  "Writes of a relay's target that somebody else had written.");
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

}  // namespace panelgate::metrics
