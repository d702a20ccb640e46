#include "panelgate/metrics/exposition.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

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
    station.request_duration.observe(1ms);
    station.request_duration.observe(15ms);
    station.request_duration.observe(60s);
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

void expect_lines(const std::string& text, std::initializer_list<const char*> lines) {
    for (const char* line : lines) EXPECT_THAT(text, HasSubstr("\n" + std::string(line) + "\n"));
}

TEST(Exposition, CountsHttpRepliesAndLoginFailures) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("login_failures")));
    snapshot.http.emplace();
    expect_lines(exposition(snapshot), {"panelgate_login_failures_total 0"});
    snapshot.http->requests = {{200, 17}, {421, 2}};
    snapshot.http->login_failures = 3;
    expect_lines(exposition(snapshot), {"# TYPE panelgate_http_requests_total counter",
                                        "panelgate_http_requests_total{code=\"200\"} 17",
                                        "panelgate_http_requests_total{code=\"421\"} 2",
                                        "panelgate_login_failures_total 3"});
}

TEST(Exposition, ShowsTheBrokerWhereThereIsOne) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_mqtt")));
    snapshot.mqtt = {true, 5, 100, 7, 2, 3, 4, 1, 6};
    expect_lines(exposition(snapshot),
                 {"panelgate_mqtt_connected 1", "panelgate_mqtt_stored 5",
                  "panelgate_mqtt_published_total 100", "panelgate_mqtt_dropped_total 7",
                  "panelgate_mqtt_results_dropped_total 6", "panelgate_mqtt_reconnects_total 2",
                  "panelgate_mqtt_writes_total{outcome=\"ok\"} 3",
                  "panelgate_mqtt_writes_total{outcome=\"refused\"} 4",
                  "panelgate_mqtt_writes_total{outcome=\"failed\"} 1"});
}

TEST(Exposition, GivesTheCountersOfAStationExactly) {
    expect_lines(
        exposition(filled()),
        {R"(panelgate_requests_total{line="floor1",station="press",function="3",outcome="ok"} 7)",
         R"(panelgate_retries_total{line="floor1",station="press"} 3)",
         R"(panelgate_late_frames_total{line="floor1",station="press"} 4)",
         R"(panelgate_foreign_frames_total{line="floor1",station="press"} 5)",
         R"(panelgate_damaged_frames_total{line="floor1",station="press"} 6)",
         R"(panelgate_discarded_bytes_total{line="floor1",station="press"} 70)",
         R"(panelgate_exceptions_total{line="floor1",station="press",code="129"} 9)",
         R"(panelgate_station_up{line="floor1",station="press"} 1)",
         R"(panelgate_station_last_success_timestamp_seconds{line="floor1",station="press"} 1700000000.5)"});
}

TEST(Exposition, GivesTheFiguresOfLinesListenersAndTheBuild) {
    expect_lines(
        exposition(filled()),
        {R"(panelgate_broadcasts_total{line="floor1"} 8)", R"(panelgate_line_up{line="floor1"} 1)",
         R"(panelgate_line_reopens_total{line="floor1"} 2)",
         R"(panelgate_bus_busy_seconds_total{line="floor1"} 1.5)",
         R"(panelgate_queue_depth{line="floor1"} 12)",
         R"(panelgate_queue_wait_seconds_count{line="floor1",class="write"} 1)",
         R"(panelgate_queue_wait_seconds_count{line="floor1",class="probe"} 0)",
         R"(panelgate_tcp_connections{listener="127.0.0.1:1502"} 3)",
         R"(panelgate_tcp_connections_total{listener="127.0.0.1:1502"} 30)",
         R"(panelgate_tcp_protocol_errors_total{listener="127.0.0.1:1502"} 1)",
         R"(panelgate_tcp_retransmissions_joined_total{listener="127.0.0.1:1502"} 4)",
         R"(panelgate_build_info{version="1.2.3"} 1)"});
}

TEST(Exposition, CumulatesTheBucketsOfAHistogram) {
    const std::string head =
        R"(panelgate_request_duration_seconds_bucket{line="floor1",station="press",le=)";
    const std::string text = exposition(filled());
    EXPECT_THAT(text, HasSubstr(head + "\"0.001\"} 1\n"));
    EXPECT_THAT(text, HasSubstr(head + "\"0.01\"} 1\n"));
    EXPECT_THAT(text, HasSubstr(head + "\"0.02\"} 2\n"));
    EXPECT_THAT(text, HasSubstr(head + "\"30\"} 2\n"));
    EXPECT_THAT(text, HasSubstr(head + "\"+Inf\"} 3\n"));
    EXPECT_THAT(
        text,
        HasSubstr(
            "panelgate_request_duration_seconds_count{line=\"floor1\",station=\"press\"} 3\n"));
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

TEST(Exposition, ShowsSeriesFromTheStartWithZero) {
    expect_lines(exposition(filled()),
                 {R"(panelgate_exceptions_total{line="floor1",station="other",code="2"} 0)",
                  R"(panelgate_retries_total{line="floor1",station="other"} 0)"});
}

TEST(Exposition, ShowsTheFunctionsOfAPanelWithZeroBeforeTheyAreUsed) {
    Snapshot snapshot = filled();
    snapshot.lines[0].stations[0].requests.clear();
    for (const int function : {1, 2, 3, 4, 5, 6, 15, 16})
        snapshot.lines[0].stations[0].requests[static_cast<std::uint8_t>(function)];
    expect_lines(
        exposition(snapshot),
        {R"(panelgate_requests_total{line="floor1",station="press",function="16",outcome="ok"} 0)"});
    EXPECT_EQ(request_series(snapshot, "press"), 8u);
    EXPECT_EQ(request_series(snapshot, "other"), 0u) << "nobody knows what those are asked";
}

TEST(Exposition, ShowsHowAFunctionEndsOnAnyDayFromItsFirstUseAndTheRestWhenItHappens) {
    Snapshot snapshot = filled();
    expect_lines(
        exposition(snapshot),
        {R"(panelgate_requests_total{line="floor1",station="press",function="3",outcome="exception"} 0)",
         R"(panelgate_requests_total{line="floor1",station="press",function="3",outcome="timeout"} 0)",
         R"(panelgate_requests_total{line="floor1",station="press",function="43",outcome="ok"} 0)",
         R"(panelgate_requests_total{line="floor1",station="press",function="43",outcome="shared"} 2)"});
    EXPECT_EQ(request_series(snapshot, "press"), 3u + 4u);
    snapshot.lines[0].stations[0].requests[3][Outcome::busy] = 1;
    EXPECT_EQ(request_series(snapshot, "press"), 4u + 4u);
}

TEST(Exposition, ShowsHowLateTheLoopCame) {
    Snapshot snapshot;
    snapshot.runtime.loop_lag.observe(3ms);
    expect_lines(exposition(snapshot), {R"(panelgate_loop_lag_seconds_bucket{le="0.002"} 0)",
                                        R"(panelgate_loop_lag_seconds_bucket{le="0.005"} 1)",
                                        "panelgate_loop_lag_seconds_count 1"});
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

TEST(Exposition, P10LeavesOutTheLastSuccessOfAStationThatNeverAnswered) {
    Snapshot snapshot = filled();
    snapshot.lines[0].stations[0].last_success_unix = 0;
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("last_success")));
}

TEST(Exposition, P10LeavesOutTheStateOfAStationThatWasNeverPolled) {
    Snapshot snapshot = filled();
    snapshot.lines[0].stations[0].up.reset();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_station_up{")));
    snapshot.lines[0].stations[0].up = false;
    EXPECT_THAT(exposition(snapshot),
                HasSubstr(R"(panelgate_station_up{line="floor1",station="press"} 0)"));
}

TEST(Exposition, HasNoStateForStationsThatAreNotConfigured) {
    EXPECT_THAT(exposition(filled()),
                Not(HasSubstr(R"(panelgate_station_up{line="floor1",station="other"})")));
}

TEST(Exposition, EscapesLabelValues) {
    Snapshot snapshot;
    snapshot.version = "a\"b\\c\nd";
    EXPECT_THAT(exposition(snapshot), HasSubstr(R"(panelgate_build_info{version="a\"b\\c\nd"} 1)"));
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
    EXPECT_FALSE(parse_stat("42 (cut", {}).cpu_seconds);
    EXPECT_FALSE(parse_stat("42 (cut) S 1", {}).cpu_seconds);
}

TEST(Exposition, P10DriverErrorsAreShownForLinesWhoseDriverCounts) {
    Snapshot snapshot = filled();
    EXPECT_THAT(exposition(snapshot), Not(HasSubstr("panelgate_framing_errors_total{")));
    snapshot.lines[0].device.uart = line::UartErrors{1, 2, 3, 4};
    expect_lines(exposition(snapshot), {R"(panelgate_framing_errors_total{line="floor1"} 1)",
                                        R"(panelgate_parity_errors_total{line="floor1"} 2)",
                                        R"(panelgate_overruns_total{line="floor1"} 3)",
                                        R"(panelgate_breaks_total{line="floor1"} 4)"});
}

}  // namespace
}  // namespace panelgate::metrics::exposition_test
