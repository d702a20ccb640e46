// How a tap matches replies after it has learned the master's timeout.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <string>
#include <string_view>

#include "heard_line.hpp"

namespace panelgate::tap::test::patience_test {
namespace {

using testing::ElementsAre;

TEST(Patience, AMasterThatALateReplyDisturbsHasNotGivenUpByTime) {
    Line line;
    for (int i = 0; i < 4; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(5ms, 31, "03020064");
        line.say(10ms, 31, "0300640001");
        line.say(500ms, 31, "0300C80002");  // its timeout
        line.say(50ms, 31, "03020065");     // late, and no answer to that: it is an error at once
        line.say(80ms, 5, "0300640001");
        line.say(5ms, 5, "03020064");
    }
    line.wait(6s);
    line.told();
    for (const Duration think : {150ms, 170ms, 200ms, 160ms}) {
        line.say(10ms, 31, "0300640001");
        line.say(think, 31, "03020064");
    }
    const std::string good = "31: 0300640001 -> 03020064";
    EXPECT_THAT(line.told(), ElementsAre(good, good, good, good));
}

TEST(Patience, FollowsAMasterThatWaitsLongerThanItDid) {
    Line line;
    for (int i = 0; i < 10; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(140ms, 5, "0300640001");  // given up
        line.say(5ms, 5, "03020064");
    }
    line.wait(6s);
    line.told();
    for (int i = 0; i < 8; ++i) {
        line.say(10ms, 31, "0300640001");
        line.say(150ms + 10ms * (i % 3), 31, "03020064");
    }
    const std::string good = "31: 0300640001 -> 03020064";
    EXPECT_THAT(line.told(),
                ElementsAre(good + " ?", good + " ?", good + " ?", good, good, good, good, good));
}

/// A master that waits for 500 ms, takes what has the right length, and a panel that is silent or
/// late as often as not.
class Trouble {
  public:
    Trouble(Line& line, unsigned seed) : line_(line), random_(seed) {}

    void go_on() {
        for (int i = 0; i < 120; ++i) {
            const Exchange& asked = next();
            line_.say(1ms * (5 + random_() % 60), 31, asked.request);
            let_answer(asked.reply);
            hear(asked.reply, line_.now() + 500ms);
        }
        while (!coming_.empty()) hear("", line_.now() + 1s);
        line_.wait(100ms);
    }
    /// Each reply comes late, and in time.
    void calm_down(int exchanges) {
        for (int i = 0; i < exchanges; ++i) {
            const Exchange& asked = next();
            line_.say(20ms, 31, asked.request);
            line_.say(1ms * (150 + random_() % 50), 31, asked.reply);
        }
    }

  private:
    struct Exchange {
        std::string_view request;
        std::string_view reply;
    };
    static constexpr std::array<Exchange, 3> kExchanges{
        {{"0300640001", "03020064"}, {"0300C80002", "030400C800C9"}, {"03012C0001", "0302012C"}}};

    /// Not the last request's: a late reply belongs to another request.
    const Exchange& next() { return kExchanges[last_ = (last_ + 1 + random_() % 2) % 3]; }
    void let_answer(std::string_view reply) {
        const unsigned fate = random_() % 10;
        if (fate < 2) return;
        const Duration think =
            fate < 6 ? 1ms * (5 + random_() % 60) : 1ms * (500 + random_() % 400);
        coming_.emplace(line_.now() + think, reply);
    }
    void hear(std::string_view expected, TimePoint until) {
        while (!coming_.empty() && coming_.begin()->first < until) {
            const auto [at, reply] = *coming_.begin();
            coming_.erase(coming_.begin());
            line_.say(std::max<Duration>(at - line_.now(), 2ms), 31, reply);
            if (reply.size() == expected.size() || random_() % 2 == 0) return;
        }
        line_.wait(std::max<Duration>(until - line_.now(), Duration::zero()));
    }

    Line& line_;
    std::mt19937 random_;
    std::size_t last_ = 0;
    std::multimap<TimePoint, std::string_view> coming_;
};

TEST(Patience, BelievesSlowRepliesAgainWhateverTroubleThereWas) {
    for (unsigned seed = 0; seed < 100; ++seed) {
        Line line;
        Trouble trouble(line, seed);
        trouble.go_on();
        trouble.calm_down(60);
        line.transactions.clear();
        trouble.calm_down(50);
        ASSERT_EQ(line.transactions.size(), 50u) << seed;
        EXPECT_EQ(std::ranges::count(line.transactions, true, &Transaction::doubtful), 0) << seed;
    }
}

}  // namespace
}  // namespace panelgate::tap::test::patience_test
