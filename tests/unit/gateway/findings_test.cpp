#include "panelgate/gateway/findings.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/alarms/settings.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway::findings_test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FindingsTest : public ::testing::Test {
  protected:
    /// The causes after another look.
    std::vector<std::string> look(Duration later = 10s) {
        now += later;
        wall += std::chrono::duration_cast<WallTime::duration>(later);
        findings.judge(now, wall, state);
        std::vector<std::string> causes;
        for (const web::Finding& one : findings.list()) {
            EXPECT_THAT(alarms::kGatewayCauses, Contains(one.cause))
                << "an alarm may name the cause";
            causes.push_back(one.cause);
        }
        return causes;
    }
    bus::MinuteUse& use(double load, std::uint64_t no_turn = 0) {
        if (state.lines.empty()) state.lines.push_back({.line = "floor1", .minute = {}});
        bus::MinuteUse& made = state.lines[0].minute;
        made.span = 65s;
        made.load_percent = load;
        made.all = {.requests = 1000, .errors = no_turn, .no_turn = no_turn};
        made.refuses = false;
        return made;
    }

    Findings findings;
    Findings::State state;
    TimePoint now{1h};
    WallTime wall{std::chrono::seconds(1'800'000'000)};
    rt::LogTap log;
};

TEST_F(FindingsTest, AFullLineIsOverloadedAndItsClientsAreNamed) {
    bus::MinuteUse& minute = use(95.5);
    minute.hosts = {{.name = "10.0.0.7", .requests = 900, .percent = 87},
                    {.name = "poll of press", .requests = 100, .percent = 13}};
    minute.span = 59s;
    EXPECT_THAT(look(), IsEmpty()) << "not yet a minute";
    minute.span = 60s;
    EXPECT_THAT(look(), ElementsAre("overload"));
    const WallTime begin = wall;
    const web::Finding& found = findings.list()[0];
    EXPECT_EQ(found.line, "floor1");
    EXPECT_THAT(found.text, HasSubstr("Line floor1 is overloaded: 96 % of the last minute"));
    EXPECT_THAT(found.evidence, HasSubstr("10.0.0.7 (87 %), poll of press (13 %)"));
    EXPECT_EQ(found.clients.size(), 2U);
    use(85);
    EXPECT_THAT(look(), ElementsAre("overload")) << "it has hardly any rest";
    EXPECT_EQ(findings.list()[0].since, begin);
    use(79);
    EXPECT_THAT(look(), IsEmpty());
    EXPECT_EQ(log.count("warn gateway finding cause=overload name=floor1"), 1U);
    EXPECT_EQ(log.count("info gateway finding gone cause=overload name=floor1"), 1U);
    use(94);
    EXPECT_THAT(look(), IsEmpty());
}

TEST_F(FindingsTest, ALineThatRefusesAllTheMinuteIsOverloadedToo) {
    use(40, 3);
    EXPECT_THAT(look(), IsEmpty()) << "a burst";
    use(40, 3).refuses = true;
    EXPECT_THAT(look(), ElementsAre("overload"));
    EXPECT_THAT(findings.list()[0].evidence, HasSubstr("3 of 1000 requests found no turn"));
    use(40, 1);
    EXPECT_THAT(look(), ElementsAre("overload"));
    use(40, 0);
    EXPECT_THAT(look(), IsEmpty());
}

TEST_F(FindingsTest, ABrokerMayBeAwayForAMoment) {
    state.broker_away = "mqtt://broker:1883";
    EXPECT_THAT(look(), IsEmpty());
    EXPECT_THAT(look(9s), IsEmpty());
    EXPECT_THAT(look(1s), ElementsAre("broker-away"));
    EXPECT_THAT(findings.list()[0].text, HasSubstr("mqtt://broker:1883"));
    state.broker_away.clear();
    EXPECT_THAT(look(), IsEmpty());
    state.broker_away = "mqtt://broker:1883";
    EXPECT_THAT(look(), IsEmpty());
}

TEST_F(FindingsTest, AuditReloadAndCertificates) {
    state.audit_fails = "/var/log/panelgate/audit.jsonl";
    state.writes_stop = true;
    web::ReloadVerdict verdict;
    verdict.faults.push_back({"/etc/panelgate.yaml", 7, 3, "unknown key 'baudd'"});
    state.refused = std::make_shared<const web::ReloadVerdict>(verdict);
    const std::int64_t seconds = 1'800'000'010;
    constexpr std::int64_t kDay = 24 * 3600;
    state.certificates = {{"http 127.0.0.1:8443", seconds + 13 * kDay + 5},
                          {"modbus_tcp 127.0.0.1:802", seconds - 1},
                          {"mqtt mqtts://broker:8883", seconds + 15 * kDay}};
    EXPECT_THAT(look(), ElementsAre("audit-fails", "reload-refused", "certificate-expires",
                                    "certificate-expires"));
    const auto& list = findings.list();
    EXPECT_THAT(list[0].text, HasSubstr("so every write is refused"));
    EXPECT_EQ(list[1].evidence, "/etc/panelgate.yaml:7:3: unknown key 'baudd'");
    EXPECT_THAT(list[2].text, HasSubstr("in 13 days"));
    EXPECT_THAT(list[3].text, HasSubstr("modbus_tcp 127.0.0.1:802 has expired on 2027-01-15"));
    state = {};
    EXPECT_THAT(look(), IsEmpty());
    EXPECT_EQ(log.count("gateway finding gone"), 4U);
}

}  // namespace
}  // namespace panelgate::gateway::findings_test
