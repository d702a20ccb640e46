// What the observer of a driven line is told of its stations, and with what else. The same of a
// line in listen mode: listening_bus_test.
#include <gmock/gmock.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "bus_case.hpp"
#include "panelgate/bus/bus.hpp"
#include "support/memory_line.hpp"

namespace panelgate::bus::health_events_test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

class HealthEventsTest : public BusCase {
  protected:
    HealthEventsTest() {
        settings.arbiter.unlisted.retries = 0;
        settings.arbiter.offline.after = 6;
        list({17, 18});
        settings.stations[18].name = "oven";
        settings.observe = [this](const BusEvent& event) { remember(event); };
        start_bus();
    }
    /// Findings are line events as well.
    void remember(const BusEvent& event) {
        const auto* of_line = std::get_if<LineEvent>(&event);
        if (of_line != nullptr && !of_line->up) told += " down";
        if (of_line != nullptr && of_line->up) told += of_line->why.empty() ? " up" : "";
        if (const auto* of_station = std::get_if<arbiter::StationEvent>(&event)) {
            told += ' ' + std::to_string(of_station->station) + ':';
            told += label(of_station->kind);
        }
    }
    /// As many silent reads as take the station offline.
    void silence(std::uint8_t station) {
        for (int i = 0; i < settings.arbiter.offline.after; ++i) ask_silent(station);
    }
    std::string causes() const {
        std::string text;
        for (const LineFinding& finding : bus->status().findings) text += finding.cause + ' ';
        return text;
    }

    std::string told;  ///< events of the line and of its stations
};

TEST_F(HealthEventsTest, P10ALineThatIsDownTakesWhatIsKnownOfItsStationsAlong) {
    ask(17);
    EXPECT_EQ(told, " up 17:online") << "nobody has asked the other one";
    line->events()->on_down("pulled");
    EXPECT_EQ(bus->station_status(17).state, Health::unknown);
    line->events()->on_down("there is no such device");
    EXPECT_EQ(told, " up 17:online down 17:unknown down");
    line->events()->on_up();
    EXPECT_EQ(bus->station_status(17).state, Health::unknown) << "until it is asked again";
    ask(17);
    EXPECT_EQ(told, " up 17:online down 17:unknown down up 17:online");
}

TEST_F(HealthEventsTest, P10OneThatWasOfflineIsToldSoAgainWhenItsProbeIsSilent) {
    ask(17);
    silence(17);
    EXPECT_EQ(told, " up 17:online 17:suspect 17:offline");
    line->reply.clear();
    line->events()->on_down("pulled");
    line->events()->on_up();
    EXPECT_THAT(told, EndsWith(" down 17:unknown up"));
    ASSERT_TRUE(run_until([&] { return told.ends_with("17:offline"); }));
    EXPECT_EQ(bus->station_status(17).state, Health::offline);
}

/// It is heard, so it is not silent (P4); no request gets a value, so it is no success.
TEST_F(HealthEventsTest, P10APanelThatIsAlwaysLateIsSuspectWhereverOneLooks) {
    line->think = 9500us;
    std::string lates;
    for (int i = 0; i < settings.arbiter.offline.after + 3; ++i) {
        line->reply.back() = static_cast<std::uint8_t>(i);
        EXPECT_EQ(ask(17).pdu.error(), Fault::timeout);
        clock.advance(50ms);  // it comes, and a silence ends it
        lates += " 17:late";
    }
    EXPECT_EQ(told, " up 17:suspect" + lates);
    EXPECT_EQ(bus->station_status(17).state, Health::suspect);
    EXPECT_FALSE(bus->station_status(17).last_success);
    EXPECT_TRUE(bus->station_status(17).last_reply);
    const LineReport report = bus->report();
    ASSERT_EQ(report.stations.size(), 3u);
    EXPECT_EQ(report.stations[1].up, true) << "not offline";
    EXPECT_EQ(report.stations[1].last_success_unix, 0);
}

TEST_F(HealthEventsTest, P10ALineThatIsReplacedIsDownForAllUntilTheNewOneIsOpen) {
    ask(18);
    silence(17);
    ask(18);
    ASSERT_THAT(causes(), HasSubstr("station-silent"));
    told.clear();
    auto other = std::make_unique<test::MemoryLine>(clock);
    test::MemoryLine* const next = other.get();
    next->up_at_start = false;
    next->reply = kReply;
    bus->apply(settings, std::move(other), nullptr);
    ASSERT_TRUE(run_until([&] { return !bus->status().up; }));
    EXPECT_THAT(told, EndsWith(" down 17:unknown 18:unknown"));
    EXPECT_EQ(bus->station_status(18).state, Health::unknown);
    EXPECT_THAT(causes(), Not(HasSubstr("station-silent"))) << "nobody knows";
    next->events()->on_up();
    ask(18);
    EXPECT_THAT(told, HasSubstr(" up"));
    EXPECT_THAT(told, HasSubstr(" 18:online"));
}

TEST_F(HealthEventsTest, P10OneThatHasNeverAnsweredIsNotUpInMetrics) {
    const auto up = [&] { return bus->report().stations[1].up; };
    ask_silent(17);
    EXPECT_EQ(bus->station_status(17).state, Health::suspect);
    EXPECT_EQ(up(), std::nullopt);
    silence(17);
    EXPECT_EQ(up(), false);
}

TEST_F(HealthEventsTest, P10OneThatIsTakenOutOrRenamedIsUnknownWhileItsNameIsKnown) {
    ask(17);
    ask(18);
    told.clear();
    Settings next = settings;
    next.stations.erase(17);
    next.stations[18].name = "kiln";
    bus->apply(next, nullptr, nullptr);
    EXPECT_EQ(told, " 17:unknown 18:unknown");
    bus->apply(next, nullptr, nullptr);
    EXPECT_EQ(told, " 17:unknown 18:unknown");
    ask(18);
    EXPECT_THAT(told, EndsWith(" 18:online"));
}

TEST_F(HealthEventsTest, P10ALineThatIsTakenOutIsDownAndItsStationsUnknown) {
    ask(17);
    told.clear();
    bus->stop();
    EXPECT_EQ(told, " down 17:unknown");
    bus->stop();
    EXPECT_EQ(told, " down 17:unknown");
    bus.reset();
    EXPECT_EQ(told, " down 17:unknown");
}

TEST_F(HealthEventsTest, AddressesThatNobodyListedAreToldOnlyOnceTheyAreHeard) {
    ask_silent(99);
    EXPECT_EQ(told, " up");
    clock.advance(1s);
    ask(99);
    EXPECT_EQ(told, " up 99:online");
}

}  // namespace
}  // namespace panelgate::bus::health_events_test
