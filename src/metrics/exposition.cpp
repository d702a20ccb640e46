#include "panelgate/metrics/exposition.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "families.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::metrics {
namespace {

using bus::LineReport;
using bus::StationReport;

Labels of_line(const LineReport& line) { return {{"line", line.line}}; }

Labels of_station(const LineReport& line, const StationReport& station) {
    return {{"line", line.line}, {"station", station.station}};
}

Labels with(Labels labels, std::string name, std::string value) {
    labels.push_back({std::move(name), std::move(value)});
    return labels;
}

template <class Add>
void each_station(const Snapshot& snapshot, Add add) {
    for (const LineReport& line : snapshot.lines) {
        for (const StationReport& station : line.stations) add(line, station);
    }
}

/// Outcomes that every function can have at any time; exported with 0 from its first use on.
constexpr std::array kUsualOutcomes{Outcome::ok, Outcome::exception, Outcome::timeout};

bool is_usual(Outcome outcome) {
    return std::ranges::find(kUsualOutcomes, outcome) != kUsualOutcomes.end();
}

bool is_used(const OutcomeCounts& counts) {
    return std::ranges::any_of(kAllOutcomes, [&](Outcome outcome) { return counts[outcome] > 0; });
}

std::string function_label(std::uint8_t function) {
    return function == bus::kOtherFunctions ? "other" : std::to_string(function);
}

void add_requests_of(Family& family, const StationReport& station, const Labels& labels) {
    const auto add = [&](std::uint8_t function, Outcome outcome, std::uint64_t count) {
        family.counter(with(with(labels, "function", function_label(function)), "outcome",
                            std::string(label(outcome))),
                       count);
    };
    for (const auto& [function, counts] : station.requests) {
        const bool used = is_used(counts);
        for (const Outcome outcome : kAllOutcomes) {
            const bool expected = used ? is_usual(outcome) : outcome == Outcome::ok;
            if (expected || counts[outcome] > 0) add(function, outcome, counts[outcome]);
        }
    }
}

void add_requests(Families& out, const Snapshot& snapshot) {
    Family requests = make_counter("panelgate_requests_total",
                                   "Requests answered, by function code and outcome.");
    each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
        add_requests_of(requests, station, of_station(line, station));
    });
    out.push_back(requests.take());
}

void add_translated(Families& out, const Snapshot& snapshot) {
    Family family = make_counter(
        "panelgate_translated_requests_total",
        "Requests that went out with a function that the panel has instead of the one asked.");
    each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
        for (const auto& [functions, count] : station.translated) {
            family.counter(
                with(with(of_station(line, station), "function", std::to_string(functions.first)),
                     "sent_as", std::to_string(functions.second)),
                count);
        }
    });
    out.push_back(family.take());
}

void add_times(Families& out, const Snapshot& snapshot, const char* name, const char* help,
               const Histogram& (*of)(const StationReport&)) {
    if (out.ended()) return;
    Family family = make_histogram(name, help);
    each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
        family.histogram(of_station(line, station), of(station));
    });
    out.push_back(family.take());
}

void add_station_times(Families& out, const Snapshot& snapshot) {
    using Station = const StationReport&;
    using Times = const Histogram&;
    add_times(out, snapshot, "panelgate_request_duration_seconds",
              "Time from the arrival of a request to its answer.",
              [](Station station) -> Times { return station.request_duration; });
    add_times(out, snapshot, "panelgate_bus_transaction_seconds",
              "Time from the first bit out to the last bit in.",
              [](Station station) -> Times { return station.wire.bus_transaction; });
    add_times(out, snapshot, "panelgate_turnaround_seconds",
              "Time a panel takes from a request to its reply.",
              [](Station station) -> Times { return station.wire.turnaround; });
}

struct WireCounter {
    const char* name;
    const char* help;
    std::uint64_t arbiter::StationCounters::* field;
};
constexpr std::array kWireCounters = {
    WireCounter{"panelgate_retries_total", "Requests sent once more after silence or damage.",
                &arbiter::StationCounters::retries},
    WireCounter{"panelgate_late_frames_total",
                "Good frames that answer a request already given up; thrown away.",
                &arbiter::StationCounters::late_frames},
    WireCounter{"panelgate_foreign_frames_total",
                "Good frames of another station, or that answer no request; discarded.",
                &arbiter::StationCounters::foreign_frames},
    WireCounter{"panelgate_damaged_frames_total",
                "Bytes that never became a good frame, counted once a frame.",
                &arbiter::StationCounters::damaged_frames},
    WireCounter{"panelgate_echo_mismatch_total",
                "Requests whose echo was not what was sent: collisions.",
                &arbiter::StationCounters::echo_mismatches},
    WireCounter{"panelgate_discarded_bytes_total", "Bytes received and thrown away.",
                &arbiter::StationCounters::discarded_bytes},
};

void add_wire_counters(Families& out, const Snapshot& snapshot) {
    for (const WireCounter& counter : kWireCounters) {
        Family family = make_counter(counter.name, counter.help);
        each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
            family.counter(of_station(line, station), station.wire.*counter.field);
        });
        out.push_back(family.take());
    }
}

void add_exceptions(Families& out, const Snapshot& snapshot) {
    Family family =
        make_counter("panelgate_exceptions_total", "Modbus exceptions that panels answered.");
    each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
        auto exceptions = station.wire.exceptions;
        for (std::uint8_t code = 1; code <= 4; ++code) exceptions.try_emplace(code, 0);
        for (const auto& [code, count] : exceptions) {
            family.counter(with(of_station(line, station), "code", std::to_string(code)), count);
        }
    });
    out.push_back(family.take());
}

void add_line_counters(Families& out, const Snapshot& snapshot) {
    Family broadcasts = make_counter("panelgate_broadcasts_total", "Broadcasts sent.");
    Family reopens = make_counter("panelgate_line_reopens_total",
                                  "Successful opens of the line's device after the first.");
    Family busy = make_counter("panelgate_bus_busy_seconds_total",
                               "Time the line was in use: request, gaps, think time and reply.");
    for (const LineReport& line : snapshot.lines) {
        broadcasts.counter(of_line(line), line.wire.broadcasts);
        reopens.counter(of_line(line), line.device.reopens);
        busy.counter(of_line(line), to_seconds(line.wire.busy));
    }
    out.push_back(broadcasts.take());
    out.push_back(reopens.take());
    out.push_back(busy.take());
}

struct UartCounter {
    const char* name;
    const char* help;
    std::uint64_t line::UartErrors::* field;
};
constexpr std::array kUartCounters = {
    UartCounter{"panelgate_framing_errors_total",
                "Characters without a stop bit, as the driver counts them: a wrong rate, or noise.",
                &line::UartErrors::framing},
    UartCounter{"panelgate_parity_errors_total",
                "Characters with a wrong parity bit, as the driver counts them.",
                &line::UartErrors::parity},
    UartCounter{
        "panelgate_overruns_total",
        "Times that characters were lost between UART and driver or in the driver's buffer.",
        &line::UartErrors::overruns},
    UartCounter{"panelgate_breaks_total",
                "Times that the line was low for longer than a character.",
                &line::UartErrors::breaks},
};

/// Exports only lines whose driver counts: an unknown number is absent, not 0 (P10).
void add_uart_counters(Families& out, const Snapshot& snapshot) {
    for (const UartCounter& counter : kUartCounters) {
        Family family = make_counter(counter.name, counter.help);
        for (const LineReport& line : snapshot.lines) {
            if (line.device.uart) family.counter(of_line(line), (*line.device.uart).*counter.field);
        }
        out.push_back(family.take());
    }
}

void add_line_state(Families& out, const Snapshot& snapshot) {
    Family up = make_gauge("panelgate_line_up", "1 while the line's device is open.");
    Family depth = make_gauge("panelgate_queue_depth", "Requests that wait for the line.");
    Family wait = make_histogram("panelgate_queue_wait_seconds",
                                 "Time a request waits before its transmission.");
    for (const LineReport& line : snapshot.lines) {
        up.gauge(of_line(line), line.up ? 1 : 0);
        depth.gauge(of_line(line), static_cast<double>(line.queue_depth));
        for (std::size_t i = 0; i < kPriorityClasses; ++i) {
            const std::string name(label(static_cast<PriorityClass>(i)));
            wait.histogram(with(of_line(line), "class", name), line.wire.queue_wait[i]);
        }
    }
    Family active = make_gauge("panelgate_active",
                               "1 while this box drives the line, 0 while it is the standby.");
    for (const auto& [line, is_active] : snapshot.active)
        active.gauge({{"line", line}}, is_active ? 1 : 0);
    out.push_back(up.take());
    if (!snapshot.active.empty()) out.push_back(active.take());
    out.push_back(depth.take());
    out.push_back(wait.take());
}

void add_findings(Families& out, const Snapshot& snapshot) {
    Family found = make_gauge("panelgate_findings",
                              "1 while this is found, by the line doctor or of the gateway itself; "
                              "absent otherwise. Station all: the whole line.");
    for (const LineReport& line : snapshot.lines) {
        for (const bus::FindingReport& finding : line.findings)
            found.gauge(
                with(with(of_line(line), "station", finding.station), "cause", finding.cause), 1);
    }
    for (const FindingSample& one : snapshot.findings)
        found.gauge(one.line.empty() ? Labels{{"cause", one.cause}, {"name", one.name}}
                                     : Labels{{"line", one.line},
                                              {"station", std::string(kAllStations)},
                                              {"cause", one.cause}},
                    1);
    out.push_back(found.take());
}

void add_denials(Families& out, const Snapshot& snapshot) {
    Family denied = make_counter("panelgate_access_denied_total",
                                 "Requests that a rule of access denied, never sent; rule default: "
                                 "that no rule allowed.");
    std::map<std::string, std::uint64_t> sums;
    for (const LineReport& line : snapshot.lines) {
        for (const auto& [rule, count] : line.denials) sums[rule] += count;
    }
    for (const auto& [rule, count] : sums) denied.counter({{"rule", rule}}, count);
    out.push_back(denied.take());
}

void add_station_state(Families& out, const Snapshot& snapshot) {
    Family up = make_gauge(
        "panelgate_station_up",
        "1 while a configured station answers; absent until it has answered or is offline.");
    Family success =
        make_gauge("panelgate_station_last_success_timestamp_seconds",
                   "When a configured station last answered; absent while it never did.");
    Family condition = make_gauge(
        "panelgate_station_condition",
        "How a configured station has done lately: 0 well, 1 unheard, 2 missed, 3 flaky, 4 "
        "failing, 5 offline; absent like panelgate_station_up, and in listen mode.");
    each_station(snapshot, [&](const LineReport& line, const StationReport& station) {
        if (!station.configured) return;
        if (station.condition)
            condition.gauge(of_station(line, station), static_cast<int>(*station.condition));
        if (station.up) up.gauge(of_station(line, station), *station.up ? 1 : 0);
        if (station.last_success_unix > 0) {
            success.gauge(of_station(line, station), station.last_success_unix);
        }
    });
    out.push_back(up.take());
    out.push_back(condition.take());
    out.push_back(success.take());
}

void add_listeners(Families& out, const Snapshot& snapshot) {
    Family open = make_gauge("panelgate_tcp_connections", "Modbus/TCP connections open now.");
    Family total =
        make_counter("panelgate_tcp_connections_total", "Modbus/TCP connections accepted.");
    Family refused = make_counter("panelgate_tcp_connections_refused_total",
                                  "Connections refused: no place, and none that gives way.");
    Family evicted = make_counter("panelgate_tcp_connections_evicted_total",
                                  "Connections that gave way to newer ones, idle ones first.");
    Family errors = make_counter("panelgate_tcp_protocol_errors_total",
                                 "Modbus/TCP frames that broke the protocol.");
    Family joined = make_counter("panelgate_tcp_retransmissions_joined_total",
                                 "Requests that were sent again before their answer, and got it.");
    for (const tcp_server::Counters& listener : snapshot.listeners) {
        const Labels labels{{"listener", listener.listener}};
        open.gauge(labels, static_cast<double>(listener.connections));
        total.counter(labels, listener.connections_total);
        refused.counter(labels, listener.refused);
        evicted.counter(labels, listener.evicted);
        errors.counter(labels, listener.protocol_errors);
        joined.counter(labels, listener.joined);
    }
    out.push_back(open.take());
    out.push_back(total.take());
    out.push_back(refused.take());
    out.push_back(evicted.take());
    out.push_back(errors.take());
    out.push_back(joined.take());
}

void add_loop(Families& out, const Snapshot& snapshot) {
    Family lag = make_histogram("panelgate_loop_lag_seconds",
                                "How late the event loop serves a timer, sampled once a second.");
    lag.histogram({}, snapshot.runtime.loop_lag);
    out.push_back(lag.take());
}

void add_reloads(Families& out, const Snapshot& snapshot) {
    if (!snapshot.reloads) return;
    const config::ReloadCounters& reloads = *snapshot.reloads;
    Family total =
        make_counter("panelgate_config_reloads_total", "Reloads of the configuration, by outcome.");
    for (const ReloadOutcome outcome : kReloadOutcomes)
        total.counter({{"outcome", std::string(label(outcome))}},
                      reloads.reloads[static_cast<std::size_t>(outcome)]);
    out.push_back(total.take());
    Family good = make_gauge("panelgate_config_last_reload_successful",
                             "Whether the last reload, if there was one, was served.");
    good.gauge({}, reloads.last_succeeded ? 1 : 0);
    out.push_back(good.take());
    Family last = make_gauge("panelgate_config_last_reload_success_timestamp_seconds",
                             "When the configuration was last read and served; the start counts.");
    last.gauge({}, reloads.last_success_unix);
    out.push_back(last.take());
}

void add_process(Families& out, const Snapshot& snapshot) {
    Family build = make_gauge("panelgate_build_info",
                              "1, with the version and what it was built from as labels.");
    Labels built{{"version", snapshot.version}};
    if (!snapshot.commit.empty()) built.push_back({"commit", snapshot.commit});
    if (!snapshot.compiler.empty()) built.push_back({"compiler", snapshot.compiler});
    build.gauge(std::move(built), 1);
    out.push_back(build.take());

    Family dropped = make_counter("panelgate_log_lines_dropped_total",
                                  "Log lines lost because stderr was not read.");
    dropped.counter({}, snapshot.runtime.log_lines_dropped);
    out.push_back(dropped.take());

    const ProcessFacts& process = snapshot.process;
    if (process.cpu_seconds) {
        Family cpu = make_counter("process_cpu_seconds_total",
                                  "Total user and system CPU time spent in seconds.");
        cpu.counter({}, *process.cpu_seconds);
        out.push_back(cpu.take());
    }
    const auto gauge = [&](const char* name, const char* help, std::optional<double> value) {
        if (!value) return;
        Family family = make_gauge(name, help);
        family.gauge({}, *value);
        out.push_back(family.take());
    };
    gauge("process_resident_memory_bytes", "Resident memory size in bytes.",
          process.resident_bytes);
    gauge("process_virtual_memory_bytes", "Virtual memory size in bytes.", process.virtual_bytes);
    gauge("process_open_fds", "Number of open file descriptors.", process.open_fds);
    gauge("process_max_fds", "Maximum number of open file descriptors.", process.max_fds);
    gauge("process_start_time_seconds", "Start time of the process since unix epoch in seconds.",
          process.start_time_unix);
}

using Part = void (*)(Families&, const Snapshot&);
constexpr Part kParts[] = {
    add_requests,      add_translated,    add_station_times, add_wire_counters, add_exceptions,
    add_line_counters, add_uart_counters, add_line_state,    add_findings,      add_denials,
    add_station_state, add_points,        add_relays,        add_listeners,     add_serial_masters,
    add_tls,           add_http,          add_mqtt,          add_audit,         add_store,
    add_alarms,        add_loop,          add_reloads,       add_process,
};

}  // namespace

void exposition(const Snapshot& snapshot, const TextSink& take) {
    Families families(take);
    for (const Part add : kParts) {
        if (families.ended()) return;
        add(families, snapshot);
    }
}

std::string exposition(const Snapshot& snapshot) {
    std::string text;
    exposition(snapshot, [&](std::string_view piece) {
        text += piece;
        return true;
    });
    return text;
}

}  // namespace panelgate::metrics
