// What panels that do not answer, or not always, cost the other panels (P4), in virtual time.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "support/bus_script.hpp"
#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::costs_test {
namespace {

using test::BusScript;

constexpr std::uint8_t kFlaky = 3;
constexpr std::array<std::uint8_t, 4> kHealthy{1, 2, 4, 5};
constexpr Duration kQuick = 3ms;
const Bytes kRead = "03 00 00 00 01"_hex;
const Bytes kWrite = "06 00 00 00 01"_hex;

Settings stations_up_to(std::uint8_t last) {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    for (std::uint8_t id = 1; id <= last; ++id) {
        StationSettings station;
        station.id = id;
        settings.stations.push_back(station);
    }
    return settings;
}

/// Panels on a line, and clients: each client asks again as soon as its request is answered.
class Plant {
  public:
    /// Think time of station 3 for its n-th request; empty: no answer.
    using Pattern = std::function<std::optional<Duration>(int)>;

    explicit Plant(Pattern pattern, std::uint8_t panels = 5)
        : bus(stations_up_to(panels)), pattern_(std::move(pattern)), panels_(panels) {}

    /// A client that asks these stations in turn.
    void add_client(std::vector<std::uint8_t> stations) {
        clients_.push_back({std::move(stations)});
    }
    void add_writer(std::uint8_t station) {
        clients_.push_back({{station}});
        clients_.back().writes = true;
    }
    void run_for(Duration span) {
        const TimePoint end = bus.now() + span;
        while (bus.now() < end) {
            ask();
            TimePoint next = std::min(end, bus.now() + 1ms);
            if (const auto due = bus.arbiter().next_deadline())
                next = std::min(next, std::max(*due, bus.now()));
            for (const Reply& reply : replies_)
                next = std::min(next, std::max(reply.at, bus.now()));
            bus.run_until(next);
            speak();
        }
    }
    void forget() { vain_.clear(), started_ = bus.now(), answers.clear(), faults.clear(); }
    /// Share of the time since then taken by requests to these stations that were not answered in
    /// time.
    double share_in_vain(std::uint8_t from, std::uint8_t to) const {
        Duration all{};
        for (const auto& [station, cost] : vain_) {
            if (station >= from && station <= to) all += cost;
        }
        return to_seconds(all) / to_seconds(bus.now() - started_);
    }

    BusScript bus;
    std::set<std::uint8_t> dead;
    std::uint8_t ignores_writes = 0;
    std::map<std::uint8_t, int> answers;
    std::map<std::uint8_t, int> faults;
    std::map<std::uint8_t, int> asked;  ///< on the wire

  private:
    struct ClientOf {
        std::vector<std::uint8_t> stations;
        bool writes = false;
        unsigned next = 0;
        Ticket open = 0;
        std::uint8_t station = 0;
    };
    struct Reply {
        TimePoint at;
        std::uint8_t station;
        std::uint8_t count;
    };

    void ask() {
        for (std::size_t i = 0; i < clients_.size(); ++i) {
            ClientOf& client = clients_[i];
            if (client.open != 0 && !bus.answered(client.open)) continue;
            if (client.open != 0)
                ++(bus.answer(client.open).pdu ? answers : faults)[client.station];
            client.open = 0;
            const unsigned number = client.next++;
            client.station = client.stations[number % client.stations.size()];
            const auto ticket =
                bus.try_submit(client.station, client.writes ? kWrite : kRead, i + 1);
            if (ticket) client.open = *ticket;
        }
    }
    /// Handles what was sent since the last call, and what is heard now.
    void speak() {
        for (; seen_ < bus.sent.size(); ++seen_) {
            const auto& [at, adu, what] = bus.sent[seen_];
            if (open_ != 0) vain_[open_] += at - open_since_;
            open_ = adu[0];
            open_since_ = at;
            const int number = asked[open_]++;
            const auto after = open_ == kFlaky ? pattern_(number) : std::optional<Duration>(kQuick);
            const TimePoint end = at + wire_time(bus.settings().serial, adu.size());
            if (open_ == ignores_writes && adu[1] == 6) continue;
            if (open_ > panels_ || !after || dead.contains(open_)) continue;
            replies_.push_back({end + *after, open_, adu[5]});
        }
        const auto due = std::ranges::find_if(
            replies_, [&](const Reply& reply) { return reply.at <= bus.now(); });
        if (due == replies_.end()) return;
        const auto [at, station, count] = *due;
        replies_.erase(due);
        if (open_ == station) open_ = 0;
        Writer reply;
        reply.u8(3).u8(2 * count).u16(++value_);
        for (unsigned i = 1; i < count; ++i) reply.u16(i);
        bus.hear_reply(station, reply.take());
    }

    Pattern pattern_;
    std::uint8_t panels_;
    std::vector<ClientOf> clients_;
    std::vector<Reply> replies_;
    std::size_t seen_ = 0;
    std::uint8_t open_ = 0;  ///< asked last, and not answered yet
    TimePoint open_since_;
    TimePoint started_;
    std::map<std::uint8_t, Duration> vain_;
    std::uint16_t value_ = 0;
};

void add_one_client_each(Plant& plant) {
    for (std::uint8_t id = 1; id <= 5; ++id) plant.add_client({id});
}

std::optional<Duration> when(bool answers, Duration after = kQuick) {
    return answers ? std::optional(after) : std::nullopt;
}

struct Row {
    Plant::Pattern pattern;
    double share;
};
class Intermittent : public testing::TestWithParam<Row> {};

TEST_P(Intermittent, P4PanelsFailuresTakeAFifthOfALineThatOthersWant) {
    Plant plant(GetParam().pattern);
    add_one_client_each(plant);
    plant.run_for(10s);
    plant.forget();
    plant.run_for(100s);
    EXPECT_LE(plant.share_in_vain(kFlaky, kFlaky), GetParam().share);
    EXPECT_GT(plant.asked[kFlaky], 20) << "and it is asked all the same";
    EXPECT_EQ(plant.faults[1], 0);
}

INSTANTIATE_TEST_SUITE_P(
    Every, Intermittent,
    testing::Values(Row{[](int n) { return when(n % 2 == 0); }, 0.21},    // every second
                    Row{[](int n) { return when(n % 100 < 50); }, 0.21},  // now and then dead
                    Row{[](int) { return std::optional<Duration>(600ms); }, 0.21},  // always late
                    Row{[](int) { return std::optional<Duration>(1000ms); }, 0.21},
                    Row{[](int n) { return when(true, n % 2 == 0 ? 3ms : 700ms); }, 0.21},
                    Row{[](int n) { return when(n % 3 == 0); }, 0.21},
                    Row{[](int n) { return when(n % 3 == 0, 400ms); }, 0.21},
                    Row{[](int n) { return when(n % 4 != 0); }, 0.21},  // each fourth is missed
                    Row{[](int n) { return when(n % 4 != 0, 400ms); }, 0.21},
                    Row{[](int n) { return when(n % 5 != 0); }, 0.21},
                    Row{[](int n) { return when(n % 8 != 0); }, 0.21}));

TEST(Costs, P4APanelThatLosesOneFrameInFortyHardlyNotices) {
    std::uint32_t random = 1;
    Plant plant([&](int) {
        random = random * 1664525 + 1013904223;
        return when((random >> 16) % 40 != 0);
    });
    add_one_client_each(plant);
    plant.run_for(300s);
    // Both of two attempts fail in one of 1,600.
    EXPECT_GT(plant.answers[kFlaky], 2000);
    EXPECT_LT(plant.faults[kFlaky] * 200, plant.answers[kFlaky]);
}

TEST(Costs, P4APanelThatNeedsAlmostItsTimeoutIsNeverCutShort) {
    Plant plant([](int n) { return when(n % 20 != 7, 480ms); });
    add_one_client_each(plant);
    plant.run_for(120s);
    EXPECT_EQ(plant.faults[kFlaky], 0);
    EXPECT_GT(plant.answers[kFlaky], 100);
}

/// Reads of the same panel between the writes had paid for them, and a writer took the line.
TEST(Costs, P4T14WritesThatAPanelIgnoresTakeAFifthWhoeverReadsBetween) {
    Plant plant([](int) { return when(true); });
    add_one_client_each(plant);
    plant.ignores_writes = kFlaky;
    plant.add_writer(kFlaky);
    plant.run_for(10s);
    plant.forget();
    plant.run_for(60s);
    EXPECT_LE(plant.share_in_vain(kFlaky, kFlaky), 0.2);
    for (const std::uint8_t id : kHealthy) EXPECT_EQ(plant.faults[id], 0);
}

int of_healthy(const std::map<std::uint8_t, int>& counts) {
    int sum = 0;
    for (const auto& [station, count] : counts) sum += station <= 10 ? count : 0;
    return sum;
}

/// Each of the ten panels is waited for before its silence is known (T1).
TEST(Costs, P4TenOfTwentyThatDieAtOnceLeaveTheLineToTheOthersAfterTheirFirstSilences) {
    for (const Duration lived : {300ms, 1000ms, 2000ms}) {
        Plant plant([](int) { return kQuick; }, 20);
        for (std::uint8_t id = 1; id <= 20; ++id) plant.add_client({id});
        plant.run_for(lived);
        const int rate = 2 * of_healthy(plant.answers);  // of the ten, with the line for them
        for (std::uint8_t id = 11; id <= 20; ++id) plant.dead.insert(id);
        plant.run_for(15s);
        plant.forget();
        plant.run_for(7s);
        EXPECT_EQ(of_healthy(plant.faults), 0);
        EXPECT_GT(of_healthy(plant.answers) * lived, 0.6 * rate * Duration(7s));
    }
}

/// Clients ask for many ids without a panel.
TEST(Costs, P4UnheardIdsTakeAFifthAndThoseOfOfflineStationsALittle) {
    Plant plant([](int) { return std::nullopt; });
    for (const std::uint8_t id : kHealthy) plant.add_client({id});
    plant.add_client({kFlaky});
    plant.run_for(20s);
    std::vector<std::uint8_t> strangers;
    for (std::uint8_t id = 6; id < 247; ++id) strangers.push_back(id);
    for (int i = 0; i < 3; ++i) plant.add_client(strangers);
    plant.forget();
    const int before = plant.asked[kFlaky];
    plant.run_for(100s);
    EXPECT_LE(plant.share_in_vain(6, 247), 0.25);
    EXPECT_LE(plant.share_in_vain(kFlaky, kFlaky), 0.05);
    EXPECT_GT(plant.asked[kFlaky] - before, 4) << "the configured station is probed all the same";
    for (const std::uint8_t id : kHealthy) EXPECT_EQ(plant.faults[id], 0);
}

}  // namespace
}  // namespace panelgate::arbiter::costs_test
