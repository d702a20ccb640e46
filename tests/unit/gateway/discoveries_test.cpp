#include "panelgate/gateway/discoveries.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "panelgate/sim/station.hpp"
#include "support/fake_bus.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::gateway::discoveries_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using State = web::DiscoveryReport::State;

/// floor1 has press 31; on its wire are an unlisted GT at 20 and further stations where a test adds
/// them. A request takes 10 ms if it is answered and 40 ms if not.
class DiscoveriesTest : public testing::Test {
  protected:
    DiscoveriesTest() {
        floor.name = "floor1";
        floor.device.serial = {38400, 8, Parity::none, 1};
        floor.stations.resize(1);
        floor.stations[0].id = 31;
        floor.stations[0].name = "press";
        floor.stations[0].profile = shipped.find("generic");
        plant.add(floor, bus, nullptr);
        listener->take();
        bus.shares.push_back({"discovery", {}});
        bus.script = [this](const bus::Request& request) { return answer(request); };
    }
    std::optional<bus::Answer> answer(const bus::Request& request) {
        EXPECT_TRUE(request.poll);
        EXPECT_TRUE(request.request.is_read());
        EXPECT_NE(request.station, 31) << "it is listed";
        if (request.station == unanswered) return std::nullopt;
        const bool is_there = request.station == 20;
        bus.shares[0].busy += is_there ? 10ms : 40ms;
        if (!is_there) return test::FakeBus::fault(Fault::timeout, true);
        return test::FakeBus::reply(gt.handle(clock.now(), 0, request.request.pdu()));
    }
    /// Runs until all is done, or a request stays unanswered.
    void run() {
        io.restart();
        io.poll();
        while (bus.open() == 0 && clock.jump()) {
            io.restart();
            io.poll();
        }
    }
    void start_and_run(const char* stations, unsigned share_percent) {
        EXPECT_FALSE(discoveries.start("floor1", stations, share_percent));
        EXPECT_EQ(report().state, State::running);
        run();
    }
    web::DiscoveryReport report() const { return discoveries.report("floor1"); }

    boost::asio::io_context io;
    test::ManualClock clock;
    test::FakeBus bus{io.get_executor()};
    profile::Catalogue shipped = profile::Catalogue::shipped();
    sim::Station gt{*shipped.find("panasonic-gt"), 20};
    config::Line floor;
    Plant plant;
    web::EventOutlet events{std::make_shared<web::EventHub>(), {}};
    web::EventHub& hub = *events.hub();
    std::shared_ptr<web::EventHub::Listener> listener = hub.listen({});
    std::uint8_t unanswered = 0;  ///< a station that does not answer yet
    Discoveries discoveries{clock,
                            [this] {
                                return Discoveries::Place{plant,
                                                          std::shared_ptr<const profile::Catalogue>(
                                                              std::shared_ptr<void>(), &shipped)};
                            },
                            events};
};

TEST_F(DiscoveriesTest, FindsAnUnlistedPanelAndSaysWhatToPaste) {
    EXPECT_EQ(report().state, State::never);
    const TimePoint began = clock.now();
    start_and_run("18-31", 10);
    const web::DiscoveryReport told = report();
    EXPECT_EQ(told.state, State::done);
    EXPECT_EQ(told.asked, 13u);
    EXPECT_EQ(told.of, 13u);
    EXPECT_EQ(told.asked_stations, "18-30");
    EXPECT_EQ(told.silent_stations, "18-19,21-30");
    ASSERT_EQ(told.stations.size(), 1u);
    EXPECT_EQ(told.stations[0].id, 20);
    EXPECT_THAT(told.stations[0].profiles, ElementsAre("panasonic-gt"));
    EXPECT_THAT(told.stations[0].evidence, HasSubstr("as its manual says"));
    EXPECT_EQ(told.yaml, "      - {id: 20, name: floor1-20, profile: panasonic-gt}\n");
    EXPECT_EQ(told.bus, bus.shares[0].busy);
    EXPECT_EQ(told.took, clock.now() - began);
    EXPECT_LE(to_seconds(told.bus), 0.1 * to_seconds(told.took) + 0.041);
    EXPECT_GE(to_seconds(told.bus), 0.09 * to_seconds(told.took)) << "nor is time wasted";
    EXPECT_EQ(bus.names.size(), 1u);
    EXPECT_EQ(bus.cancelled.size(), 1u) << "the bus need not know it any more";
}

TEST_F(DiscoveriesTest, TellsHowFarItIs) {
    start_and_run("18-20", 50);
    const std::string text = listener->take();
    EXPECT_THAT(text, HasSubstr(R"(event: discovery)"));
    EXPECT_THAT(text, HasSubstr(R"({"line":"floor1","state":"running","asked":1,"of":3,)"));
    EXPECT_THAT(text, HasSubstr(R"("state":"done","asked":3,"of":3,"found":1})"));
}

TEST_F(DiscoveriesTest, SomebodyEndsItAndWhatWasFoundStays) {
    unanswered = 22;
    start_and_run("18-40", 50);
    EXPECT_EQ(report().state, State::running);
    EXPECT_EQ(bus.open(), 1u);
    discoveries.stop("floor1");
    EXPECT_EQ(bus.open(), 0u) << "what waits is taken back";
    run();
    EXPECT_EQ(report().state, State::stopped);
    EXPECT_EQ(report().stations.size(), 1u);
    EXPECT_EQ(report().why, "it was ended by a request");
    const std::size_t asked = bus.requests.size();
    clock.advance(60s);
    EXPECT_EQ(bus.requests.size(), asked);
}

TEST_F(DiscoveriesTest, CanBeDoneAgain) {
    start_and_run("20", 50);
    unanswered = 21;
    EXPECT_FALSE(discoveries.start("floor1", "21", 20));
    EXPECT_EQ(report().state, State::running);
    EXPECT_EQ(report().share_percent, 20u);
    EXPECT_TRUE(report().stations.empty());
    discoveries.stop_all();
    EXPECT_EQ(report().why, "the gateway ends");
}

TEST_F(DiscoveriesTest, WhoAnsweredLateIsAskedOnceMore) {
    bus.script = [this](const bus::Request& request) -> std::optional<bus::Answer> {
        if (request.station == 20 && bus.requests.size() == 1) {
            bus.stations[20].last_reply = Duration::zero();  // a moment after its timeout
            return test::FakeBus::fault(Fault::timeout, true);
        }
        return answer(request);
    };
    start_and_run("20-22", 50);
    ASSERT_EQ(report().stations.size(), 1u);
    EXPECT_THAT(report().stations[0].evidence, HasSubstr("answers late"));
}

TEST_F(DiscoveriesTest, WhomTheLineRefusesToAskIsTriedAgainAFewTimes) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::offline, false); };
    start_and_run("1-30", 10);
    EXPECT_EQ(report().state, State::done);
    EXPECT_EQ(bus.requests.size(), 5u * 30u);
    EXPECT_EQ(report().asked, 0u);
    EXPECT_EQ(report().refused, 30u);
}

TEST_F(DiscoveriesTest, GivesUpOnALineThatTakesNothing) {
    bus.script = [](const bus::Request&) { return test::FakeBus::fault(Fault::line_down, false); };
    start_and_run("1-30", 10);
    EXPECT_EQ(report().state, State::stopped);
    EXPECT_EQ(report().asked, 0u);
}

TEST_F(DiscoveriesTest, SaysWhatIsWrongWithAList) {
    EXPECT_EQ(discoveries.start("floor1", "0-3", 10),
              "is not a list of addresses from 1 to 247 such as 1-31 or 5,17,20-31");
    EXPECT_EQ(report().state, State::never);
    EXPECT_FALSE(discoveries.start("floor1", "31", 10));
    EXPECT_EQ(report().state, State::done) << "all of them are listed";
}

}  // namespace
}  // namespace panelgate::gateway::discoveries_test
