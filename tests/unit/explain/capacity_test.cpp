#include "panelgate/explain/capacity.hpp"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::explain::capacity_test {
namespace {

using config::load_valid;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

constexpr const char* kTwoLines = R"(lines:
  - name: a
    device: sim
    serial: {baud: 9600, data_bits: 8, parity: none, stop_bits: 1}
    timing: {think_time: 5ms}
    stations:
      - id: 1
        name: press
        profile: generic
        poll: [{read: 400001, count: 32, every: 1s}]
        points: [{name: level, at: "000181", every: 5s}]
      - {id: 2, name: quick, profile: generic, timing: {think_time: 2ms}}
  - name: b
    device: sim
    stations: [{id: 3, name: meter, profile: autonics-arm}]
relays:
  - {from: press/400101, count: 2, to: quick/400201, every: 2s, on_change: true, refresh: 20s}
  - {from: meter/300201, to: quick/400301, every: 4s}
http: {listen: "127.0.0.1:8080"}
)";

constexpr const char* kResting = R"(lines:
  - {name: a, device: sim, quarantine: line, timing: {late_window: 5s}, stations: [{id: 1, name: x}]}
  - {name: b, device: sim, quarantine: line, timing: {response_timeout: 300ms}, stations: [{id: 2, name: y}]}
  - {name: c, device: sim, stations: [{id: 3, name: z}]}
  - {name: d, device: /dev/ttyS0, mode: listen,
     stations: [{id: 4, name: t, points: [{name: p, at: "400001"}]}]}
http: {listen: "127.0.0.1:8080"}
)";

TEST(Capacity, P4CountsTheRestOfAWholeLine) {
    const config::Config config = load_valid(kResting);
    const std::vector<Capacity> all = capacities(config);
    EXPECT_EQ(all[0].line.stations[0].line_rest, Duration(5s));
    EXPECT_EQ(all[1].line.stations[0].line_rest, Duration(300ms));
    EXPECT_EQ(all[2].line.stations[0].line_rest, Duration(0));
}

TEST(Capacity, ALineThatListensCarriesNothingOfOursAndSaysOnlyThat) {
    const config::Config config = load_valid(kResting);
    const std::vector<Capacity> all = capacities(config);
    EXPECT_EQ(all[3].plan.load, 0);
    EXPECT_THAT(plan_text(all[3]), HasSubstr("it only listens"));
    EXPECT_THAT(plan_text(all[3]), Not(HasSubstr("left for clients")));
}

TEST(Capacity, TakesFromAConfigurationWhatLoadsEachLine) {
    const config::Config config = load_valid(kTwoLines);
    const std::vector<Capacity> all = capacities(config);
    ASSERT_THAT(all, SizeIs(2));
    const plan::LinePlan& a = all[0].plan;
    ASSERT_THAT(a.polls, SizeIs(2));
    EXPECT_EQ(all[0].line.stations[0].think_time, Duration(5ms)) << "the line's";
    EXPECT_EQ(all[0].line.stations[1].think_time, Duration(2ms)) << "its own";
    ASSERT_THAT(a.relays, SizeIs(3));
    EXPECT_EQ(a.relays[1].every, Duration(20s));
    EXPECT_EQ(a.relays[2].station, "quick");
    ASSERT_THAT(all[1].plan.relays, SizeIs(1));
    EXPECT_EQ(all[1].plan.relays[0].station, "meter");
}

TEST(Capacity, TellsWhatIsTooMuchAndWhatWouldHelp) {
    std::string text = kTwoLines;
    text.replace(text.find("every: 1s"), 9, "every: 100ms");
    const config::Config config = load_valid(text);
    const std::vector<Capacity> all = capacities(config);
    EXPECT_EQ(plan::verdict(all[0].plan), plan::Verdict::high);
    EXPECT_THAT(overload_text(all[0]), HasSubstr("line a is planned to be busy for "));
    EXPECT_THAT(overload_text(all[0]), HasSubstr("serial: {baud: 19200}"));
    EXPECT_THAT(plan_text(all[0]), HasSubstr("  advice: serial: {baud: 19200}"));
    EXPECT_THAT(plan_text(all[1]), Not(HasSubstr("advice")));
}

}  // namespace
}  // namespace panelgate::explain::capacity_test
