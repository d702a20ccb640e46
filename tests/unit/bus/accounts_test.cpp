// Who has used a line how much, and how requests ended.
#include "accounts.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::bus::accounts_test {
namespace {

constexpr TimePoint kNow{1h};

class ClientSharesTest : public testing::Test {
  protected:
    std::vector<ClientShare> shares(Duration busy = {}) {
        return client_shares({used, names, accounts, departed, busy}, kNow);
    }
    arbiter::BusShares used;
    ClientNames names;
    ClientAccounts accounts;
    DepartedClients departed;
};

TEST_F(ClientSharesTest, TheGreediestComesFirstWithItsName) {
    used.add(7, 1s);
    used.add(8, 2s);
    used.add(8, 1s);
    names.set(7, "http 10.0.0.7");
    names.set(9, "idle");
    const std::vector<ClientShare> all = shares();
    ASSERT_EQ(all.size(), 2u) << "who has asked for nothing is not shown";
    EXPECT_EQ(all[0].name, "a client without a name");
    EXPECT_EQ(all[0].busy, Duration(3s));
    EXPECT_EQ(all[0].transactions, 2u);
    EXPECT_EQ(all[0].percent, 75);
    EXPECT_EQ(all[1].name, "http 10.0.0.7");
    EXPECT_EQ(all[1].percent, 25);
}

TEST_F(ClientSharesTest, WhereNoTimeWasUsedNobodyHasAShareOfIt) {
    used.add(7, Duration::zero());
    ASSERT_EQ(shares().size(), 1u);
    EXPECT_EQ(shares()[0].percent, 0);
}

TEST_F(ClientSharesTest, OfMoreThanAHundredTheGreediestAreShownWithTheirShareOfAll) {
    for (ClientId client = 1; client <= 200; ++client) {
        used.add(client, client * Duration(1ms));
        names.set(client, "client " + std::to_string(client));
    }
    const std::vector<ClientShare> all = shares();
    ASSERT_EQ(all.size(), 101u);
    EXPECT_EQ(all.front().name, "client 200");
    EXPECT_EQ(all[99].name, "client 101");
    EXPECT_EQ(all.back().name, kOtherClients);
    EXPECT_EQ(all.back().transactions, 100u);
    EXPECT_NEAR(all.back().percent, 100.0 * 5050 / 20100, 1e-9);
    EXPECT_NEAR(all.front().percent, 100.0 * 200 / 20100, 1e-9);
}

TEST_F(ClientSharesTest, TellWhatAClientAskedAndHowItLastFailed) {
    accounts.count_outcome(7, Outcome::timeout, kNow);  // for a departed client
    for (int i = 0; i < 3; ++i) accounts.count_request(7);
    accounts.count_outcome(7, Outcome::ok, kNow);
    accounts.count_outcome(7, Outcome::busy, kNow - 3s);
    accounts.count_outcome(7, Outcome::cached, kNow);
    const std::vector<ClientShare> all = shares();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].requests, 3u);
    EXPECT_EQ(all[0].failed, 1u);
    EXPECT_EQ(all[0].last_error, Outcome::busy);
    EXPECT_EQ(all[0].last_error_ago, 3s);
    accounts.forget(7);
    EXPECT_TRUE(shares().empty());
}

TEST_F(ClientSharesTest, OfMoreClientsThanThereIsRoomForTheFirstAreCounted) {
    for (ClientId client = 1; client <= 2 * ClientAccounts::kClients; ++client)
        accounts.count_request(client);
    EXPECT_EQ(accounts.all().size(), ClientAccounts::kClients);
}

TEST_F(ClientSharesTest, WhatNobodyOfThemHasUsedIsTheOthers) {
    used.add(7, 1s);
    names.set(7, "poll of press");
    departed.leave(kNow - 1s, "http 10.0.0.9 token ops", {2s, 4},
                   {5, 1, Outcome::timeout, kNow - 3s});
    departed.leave(kNow, "relay a to b", {1s, 1}, {});
    const auto all = shares(10s);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[0].name, "http 10.0.0.9 token ops");
    EXPECT_EQ(all[0].gone, Duration(1s));
    EXPECT_EQ(all[0].percent, 20);
    EXPECT_EQ(all[0].last_error_ago, 3s);
    EXPECT_EQ(all[1].percent, 10);
    EXPECT_EQ(all[2].name, kOtherClients);
    EXPECT_EQ(all[2].percent, 70) << "of whom is not shown, and the gateway's own";
}

TEST_F(ClientSharesTest, WhoIsBackIsThere) {
    used.add(7, 1s);
    names.set(7, "http 10.0.0.9");
    departed.leave(kNow - 1s, "http 10.0.0.9", {2s, 4}, {5, 0, {}, {}});
    const auto all = shares(3s);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_FALSE(all[0].gone);
    EXPECT_EQ(all[0].busy, Duration(3s));
    EXPECT_EQ(all[0].requests, 5u);
}

TEST_F(ClientSharesTest, TheDepartedAreOneForAllPortsOfAnAddress) {
    departed.leave(kNow - 2s, "modbus_tcp 10.0.0.7:5000", {1s, 1}, {1, 0, {}, {}});
    departed.leave(kNow - 1s, "modbus_tcp 10.0.0.7:5001", {1s, 1}, {1, 0, {}, {}});
    ASSERT_EQ(departed.rows(kNow).size(), 1u);
    const auto& [name, row] = *departed.rows(kNow).begin();
    EXPECT_EQ(name, "modbus_tcp 10.0.0.7");
    EXPECT_EQ(row.used.transactions, 2u);
    EXPECT_EQ(row.left, kNow - 1s);
}

TEST_F(ClientSharesTest, TheDepartedAreOneForAllAddressesOfAnIpv6Network) {
    departed.leave(kNow - 2s, "http 2001:db8:1:2::7", {1s, 1}, {1, 0, {}, {}});
    departed.leave(kNow - 1s, "http 2001:db8:1:2:a:b:c:d", {1s, 1}, {1, 0, {}, {}});
    const auto all = shares(2s);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].name, "http 2001:db8:1:2::/64");
    EXPECT_EQ(all[0].address, "2001:db8:1:2::/64");
    EXPECT_EQ(all[0].requests, 2u);
}

TEST_F(ClientSharesTest, TheDepartedAreBoundedInTimeAndNumberAndNothingIsLost) {
    departed.apply(ClientSettings{.remembered_for = 5min, .remembered = 2});
    for (int i = 1; i <= 3; ++i)
        departed.leave(kNow + i * 1min, "http 10.0.0." + std::to_string(i), {1s, 1},
                       {1, 0, {}, {}});
    EXPECT_EQ(departed.rows(kNow + 3min).size(), 2u);
    EXPECT_FALSE(departed.rows(kNow + 3min).contains("http 10.0.0.1")) << "it left first";
    EXPECT_EQ(departed.forgotten().used.busy, Duration(1s));
    EXPECT_TRUE(departed.rows(kNow + 1h).empty());
    EXPECT_EQ(departed.forgotten().used.busy, Duration(3s));
    EXPECT_EQ(departed.forgotten().totals.requests, 3u);
}

TEST(ClientNames, P9AreBoundedAndTheLastOneCountsUntilTheClientHasGone) {
    ClientNames names;
    for (ClientId client = 1; client <= ClientNames::kClients + 1; ++client) names.set(client, "x");
    EXPECT_EQ(names.of(ClientNames::kClients), "x");
    EXPECT_EQ(names.of(ClientNames::kClients + 1), "a client without a name");
    names.set(1, "y");
    EXPECT_EQ(names.of(1), "y");
    names.forget(1);
    EXPECT_EQ(names.of(1), "a client without a name");
}

Answer answer(Result<Bytes> pdu, bool transmitted = true) {
    Answer made;
    made.pdu = std::move(pdu);
    made.transmitted = transmitted;
    return made;
}
std::string word(const Answer& answer) { return std::string(label(outcome_of(answer))); }

TEST(OutcomeOf, ToldByWhoAnswered) {
    const Bytes reply = "03 02 00 07"_hex;
    EXPECT_EQ(word(answer(reply)), "ok");
    Answer shared = answer(reply);
    shared.shared = true;
    EXPECT_EQ(word(shared), "shared");
    Answer remembered = answer(reply, false);
    remembered.source = Source::cache;
    EXPECT_EQ(word(remembered), "cached");
    EXPECT_EQ(word(answer("83 02"_hex)), "exception");
    EXPECT_EQ(word(answer("83 02"_hex, false)), "refused") << "the panel was not asked";
    EXPECT_EQ(word(answer(Fault::timeout)), "timeout");
    EXPECT_EQ(word(answer(Fault::busy, false)), "busy");
}

std::uint64_t observed(const Histogram& histogram) {
    return std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::uint64_t{0});
}

class RequestCountersTest : public ::testing::Test {
  protected:
    RequestCountersTest() {
        settings.stations = {settings.unlisted};
        settings.stations[0].id = 17;
    }
    StationReport of(const std::string& station) const {
        for (StationReport& report : counters.report(*make_machine(settings)))
            if (report.station == station) return std::move(report);
        ADD_FAILURE() << "no station " << station;
        return {};
    }
    void ask(std::uint8_t station, std::uint8_t function, Duration took = 1ms) {
        counters.count(station, function, outcome_of(answer(Bytes{function, 0})), took);
    }

    arbiter::Settings settings;
    RequestCounters counters{{{17, {"press"}}}};
};

TEST_F(RequestCountersTest, AStationThatWasNeverAskedIsReportedAllTheSame) {
    const StationReport press = of("press");
    EXPECT_TRUE(press.configured);
    EXPECT_FALSE(press.up);
    EXPECT_TRUE(press.requests.empty());
    EXPECT_EQ(press.last_success_unix, 0);
    EXPECT_FALSE(of("other").configured);
}

TEST_F(RequestCountersTest, WhatAPanelIsLikelyToBeAskedIsCountedFromTheStart) {
    counters = RequestCounters({{17, {.name = "press", .functions = {3, 16}}}});
    const StationReport press = of("press");
    ASSERT_EQ(press.requests.size(), 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::ok], 0u);
    EXPECT_TRUE(press.requests.contains(16));
}

TEST_F(RequestCountersTest, EachFunctionAndEachOutcomeOfAListedStationCountsByItself) {
    ask(17, 3, 2ms);
    ask(17, 3, 4ms);
    ask(17, 6);
    counters.count(17, 3, Outcome::timeout, 500ms);
    const StationReport press = of("press");
    ASSERT_EQ(press.requests.size(), 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::ok], 2u);
    EXPECT_EQ(press.requests.at(3)[Outcome::timeout], 1u);
    EXPECT_EQ(press.requests.at(6)[Outcome::ok], 1u);
    EXPECT_EQ(observed(press.request_duration), 4u);
    EXPECT_TRUE(of("other").requests.empty());
    ask(18, 3);
    EXPECT_EQ(counters.outcomes(17)[Outcome::ok], 3u);
    EXPECT_EQ(counters.outcomes(17)[Outcome::timeout], 1u);
    EXPECT_EQ(counters.outcomes(18)[Outcome::ok], 0u) << "it is among others";
    EXPECT_EQ(counters.outcomes(0)[Outcome::ok], 0u);
}

TEST_F(RequestCountersTest, P10NoClientCanAddASeries) {
    for (unsigned station = 0; station <= 255; ++station) {
        if (station == 17) continue;
        for (unsigned function = 0; function <= 255; ++function)
            ask(static_cast<std::uint8_t>(station), static_cast<std::uint8_t>(function));
    }
    EXPECT_EQ(counters.report(*make_machine(settings)).size(), 2u);
    const StationReport other = of("other");
    EXPECT_LT(other.requests.size(), 25u) << "those of the standard, and one for all the others";
    EXPECT_EQ(observed(other.request_duration), 255u * 256u);
}

TEST_F(RequestCountersTest, TheLastSuccessIsThatOfItsStation) {
    counters.succeeded(17, 1000.5);
    counters.succeeded(99, 2000.5);
    EXPECT_EQ(of("press").last_success_unix, 1000.5);
    EXPECT_EQ(of("other").last_success_unix, 2000.5);
}

}  // namespace
}  // namespace panelgate::bus::accounts_test
