#include "panelgate/metrics/exposition.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/metrics/process.hpp"

namespace panelgate::metrics::exposition_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

bus::StationReport press() {
    bus::StationReport station;
    station.station = "press";
    station.configured = true;
    station.up = true;
    station.last_success_unix = 1700000000.5;
    station.requests[3][Outcome::ok] = 7;
    station.requests[43][Outcome::shared] = 2;
    station.wire.retries = 3;
    station.wire.late_frames = 4;
    station.wire.foreign_frames = 5;
    station.wire.damaged_frames = 6;
    station.wire.discarded_bytes = 70;
    station.wire.exceptions[0x81] = 9;
    for (const Duration took : {1ms, 15ms, 60'000ms}) station.request_duration.observe(took);
    return station;
}

Snapshot filled() {
    bus::LineReport line;
    line.line = "floor1";
    line.up = true;
    line.queue_depth = 12;
    line.wire.broadcasts = 8;
    line.wire.busy = 1500ms;
    line.wire.queue_wait[0].observe(3ms);
    line.device.reopens = 2;
    line.stations.push_back(press());
    line.stations.emplace_back().station = "other";
    Snapshot snapshot;
    snapshot.lines.push_back(line);
    snapshot.listeners.push_back({"127.0.0.1:1502", 3, 30, 1});
    snapshot.listeners.back().joined = 4;
    snapshot.version = "1.2.3";
    snapshot.process = read_process_facts();
    return snapshot;
}

/// Each sample is `NAME{LABELS} VALUE`, without "panelgate_". LINE, PRESS and OTHER stand for the
/// labels of the line and its stations.
std::string spelled(std::string sample) {
    const std::pair<std::string_view, std::string_view> names[] = {
        {"LINE", R"(line="floor1")"},
        {"PRESS", R"(line="floor1",station="press")"},
        {"OTHER", R"(line="floor1",station="other")"},
    };
    for (const auto& [name, labels] : names)
        if (const auto at = sample.find(name); at != sample.npos)
            sample.replace(at, name.size(), labels);
    return "\npanelgate_" + sample + '\n';
}

void expect_samples(const Snapshot& snapshot, std::initializer_list<const char*> samples) {
    const std::string text = exposition(snapshot);
    for (const char* sample : samples) EXPECT_THAT(text, HasSubstr(spelled(sample)));
}

TEST(Exposition, GivesTheCountersOfAStationExactly) {
    expect_samples(
        filled(), {R"(requests_total{PRESS,function="3",outcome="ok"} 7)", "retries_total{PRESS} 3",
                   "late_frames_total{PRESS} 4", "foreign_frames_total{PRESS} 5",
                   "damaged_frames_total{PRESS} 6", "discarded_bytes_total{PRESS} 70",
                   R"(exceptions_total{PRESS,code="129"} 9)", "station_up{PRESS} 1",
                   "station_last_success_timestamp_seconds{PRESS} 1700000000.5",
                   R"(exceptions_total{OTHER,code="2"} 0)", "retries_total{OTHER} 0"});
}

TEST(Exposition, GivesTheFiguresOfLinesListenersAndTheBuild) {
    expect_samples(filled(),
                   {"broadcasts_total{LINE} 8", "line_up{LINE} 1", "line_reopens_total{LINE} 2",
                    "bus_busy_seconds_total{LINE} 1.5", "queue_depth{LINE} 12",
                    R"(queue_wait_seconds_count{LINE,class="write"} 1)",
                    R"(queue_wait_seconds_count{LINE,class="probe"} 0)",
                    R"(tcp_connections{listener="127.0.0.1:1502"} 3)",
                    R"(tcp_connections_total{listener="127.0.0.1:1502"} 30)",
                    R"(tcp_protocol_errors_total{listener="127.0.0.1:1502"} 1)",
                    R"(tcp_retransmissions_joined_total{listener="127.0.0.1:1502"} 4)",
                    R"(build_info{version="1.2.3"} 1)"});
}

TEST(Exposition, CumulatesTheBucketsOfAHistogram) {
    expect_samples(filled(), {R"(request_duration_seconds_bucket{PRESS,le="0.001"} 1)",
                              R"(request_duration_seconds_bucket{PRESS,le="0.01"} 1)",
                              R"(request_duration_seconds_bucket{PRESS,le="0.02"} 2)",
                              R"(request_duration_seconds_bucket{PRESS,le="30"} 2)",
                              R"(request_duration_seconds_bucket{PRESS,le="+Inf"} 3)",
                              "request_duration_seconds_count{PRESS} 3"});
}

TEST(Exposition, CountsHttpRepliesAndLoginFailures) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("login_failures")));
    snapshot.http.emplace();
    expect_samples(snapshot, {"login_failures_total 0"});
    snapshot.http->requests = {{200, 17}, {421, 2}};
    snapshot.http->login_failures = 3;
    expect_samples(snapshot, {R"(http_requests_total{code="200"} 17)",
                              R"(http_requests_total{code="421"} 2)", "login_failures_total 3"});
    EXPECT_THAT(exposition(snapshot),
                HasSubstr("\n# TYPE panelgate_http_requests_total counter\n"));
}

TEST(Exposition, ShowsTheBrokerWhereThereIsOne) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_mqtt")));
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_audit")));
    snapshot.audit = {100, 7, 2, 3, false};
    expect_samples(snapshot, {"audit_up 1", "audit_records_total 100", "audit_lost_total 7",
                              "audit_failures_total 2", "audit_rotations_total 3"});
    snapshot.mqtt = {true, 5, 100, 7, 2, 3, 4, 1, 6};
    expect_samples(snapshot, {"mqtt_connected 1", "mqtt_stored 5", "mqtt_published_total 100",
                              "mqtt_dropped_total 7", "mqtt_results_dropped_total 6",
                              "mqtt_reconnects_total 2", R"(mqtt_writes_total{outcome="ok"} 3)",
                              R"(mqtt_writes_total{outcome="refused"} 4)",
                              R"(mqtt_writes_total{outcome="failed"} 1)"});
}

/// Returns the station's series of requests_total.
std::size_t request_series(const Snapshot& snapshot, const std::string& station) {
    const std::string head =
        "panelgate_requests_total{line=\"floor1\",station=\"" + station + "\",";
    const std::string text = exposition(snapshot);
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(head, at)) != std::string::npos; ++at) ++count;
    return count;
}

TEST(Exposition, ShowsTheFunctionsOfAPanelWithZeroBeforeTheyAreUsed) {
    Snapshot snapshot = filled();
    auto& requests = snapshot.lines[0].stations[0].requests;
    requests.clear();
    constexpr std::uint8_t kAsked[] = {1, 2, 3, 4, 5, 6, 15, 16};
    for (const std::uint8_t function : kAsked) requests[function];
    expect_samples(snapshot, {R"(requests_total{PRESS,function="16",outcome="ok"} 0)"});
    EXPECT_EQ(request_series(snapshot, "press"), 8u);
    EXPECT_EQ(request_series(snapshot, "other"), 0u) << "nobody knows what those are asked";
}

TEST(Exposition, ShowsHowAFunctionEndsOnAnyDayFromItsFirstUseAndTheRestWhenItHappens) {
    Snapshot snapshot = filled();
    expect_samples(snapshot, {R"(requests_total{PRESS,function="3",outcome="exception"} 0)",
                              R"(requests_total{PRESS,function="3",outcome="timeout"} 0)",
                              R"(requests_total{PRESS,function="43",outcome="ok"} 0)",
                              R"(requests_total{PRESS,function="43",outcome="shared"} 2)"});
    EXPECT_EQ(request_series(snapshot, "press"), 3u + 4u);
    snapshot.lines[0].stations[0].requests[3][Outcome::busy] = 1;
    EXPECT_EQ(request_series(snapshot, "press"), 4u + 4u);
}

TEST(Exposition, ShowsHowLateTheLoopCame) {
    Snapshot snapshot;
    snapshot.runtime.loop_lag.observe(3ms);
    expect_samples(snapshot,
                   {R"(loop_lag_seconds_bucket{le="0.002"} 0)",
                    R"(loop_lag_seconds_bucket{le="0.005"} 1)", "loop_lag_seconds_count 1"});
}

TEST(Exposition, GivesEachFamilyAsOneTextAndStopsWhenNoMoreIsWanted) {
    std::vector<std::string> pieces;
    exposition(filled(), [&](std::string_view piece) {
        pieces.emplace_back(piece);
        return pieces.size() < 3;
    });
    ASSERT_EQ(pieces.size(), 3u);
    for (const std::string& piece : pieces) {
        EXPECT_THAT(piece, ::testing::StartsWith("# HELP panelgate_"));
        EXPECT_EQ(piece.find("# HELP", 1), std::string::npos);
    }
}

TEST(Exposition, P10LeavesOutWhatAStationNeverSaidAndOthersCannotSay) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot),
                Not(HasSubstr(R"(panelgate_station_up{line="floor1",station="other"})")));
    bus::StationReport& station = snapshot.lines[0].stations[0];
    station.last_success_unix = 0;
    station.up.reset();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("last_success")));
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_station_up{")));
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_station_condition{")));
    station.up = false;
    station.condition = Condition::failing;
    expect_samples(snapshot, {"station_up{PRESS} 0", "station_condition{PRESS} 4"});
}

TEST(Exposition, P10DriverErrorsAreShownForLinesWhoseDriverCounts) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_framing_errors_total{")));
    snapshot.lines[0].device.uart = line::UartErrors{1, 2, 3, 4};
    expect_samples(snapshot, {"framing_errors_total{LINE} 1", "parity_errors_total{LINE} 2",
                              "overruns_total{LINE} 3", "breaks_total{LINE} 4"});
}

TEST(Exposition, EscapesLabelValues) {
    Snapshot snapshot;
    snapshot.version = "a\"b\\c\nd";
    expect_samples(snapshot, {R"(build_info{version="a\"b\\c\nd"} 1)"});
}

TEST(Exposition, PassesPromtool) {
    if (std::system("command -v promtool >/dev/null 2>&1") != 0) GTEST_SKIP() << "no promtool";
    const std::string path = testing::TempDir() + "exposition." + std::to_string(getpid()) + ".txt";
    std::ofstream(path) << exposition(filled());
    EXPECT_EQ(std::system(("promtool check metrics < " + path).c_str()), 0);
    std::remove(path.c_str());
}

TEST(Process, ReadsItsOwnFacts) {
    const ProcessFacts facts = read_process_facts();
    EXPECT_GE(facts.cpu_seconds.value(), 0);
    EXPECT_GT(facts.resident_bytes.value(), 100'000);
    EXPECT_GT(facts.virtual_bytes.value(), facts.resident_bytes.value());
    EXPECT_GE(facts.open_fds.value(), 3);
    EXPECT_GE(facts.max_fds.value(), facts.open_fds.value());
    EXPECT_GT(facts.start_time_unix.value(), 1.6e9);
}

TEST(Process, UnderstandsANameWithBlanksAndParentheses) {
    const char* stat =
        "42 (a ) b) S 1 42 42 0 -1 4194560 100 0 0 0 150 50 0 0 20 0 1 0 3000 8192 2 "
        "18446744073709551615";
    ProcUnits units;
    units.boot_unix = 1000;
    const ProcessFacts facts = parse_stat(stat, units);
    EXPECT_EQ(facts.cpu_seconds, 2.0);
    EXPECT_EQ(facts.start_time_unix, 1030.0);
    EXPECT_EQ(facts.virtual_bytes, 8192.0);
    EXPECT_EQ(facts.resident_bytes, 8192.0);
}

TEST(Process, HasNoFiguresForATextThatIsNoStat) {
    for (const char* stat : {"42 (cut", "42 (cut) S 1"})
        EXPECT_FALSE(parse_stat(stat, {}).cpu_seconds) << stat;
}

}  // namespace
}  // namespace panelgate::metrics::exposition_test
