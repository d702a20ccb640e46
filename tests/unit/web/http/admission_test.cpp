#include "admission.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <sstream>
#include <string>

namespace panelgate::web::admission_test {
namespace {

class LoginsTest : public ::testing::Test {
  protected:
    void fail(unsigned times, const std::string& address = "a") {
        for (unsigned i = 0; i < times; ++i) logins.failed(now, address);
    }
    bool held(const std::string& address = "a") const {
        return logins.hold(now, address) > Duration::zero();
    }
    LoginSettings settings;
    Logins logins{settings};
    TimePoint now{1h};
};

TEST_F(LoginsTest, ThrottleAnAddressThatGuessesAndNoneForAFewMistakes) {
    fail(settings.free);
    EXPECT_FALSE(held());
    fail(1);
    EXPECT_EQ(logins.hold(now, "a"), settings.hold);
    EXPECT_FALSE(held("b"));
}

TEST_F(LoginsTest, LookAtAnAddressThatGuessesNoFasterThanItsGuessesAreAnswered) {
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
    fail(settings.free + 1);
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero()) << "the first is looked at at once";
    const Duration pause = Duration(1s) / settings.checks_per_second;
    EXPECT_EQ(logins.turn(now, "a"), pause);
    EXPECT_EQ(logins.turn(now, "a"), 2 * pause) << "whether the one before has hung up or not";
    for (int i = 0; i < 1000; ++i) EXPECT_LE(logins.turn(now, "a"), settings.longest_turn);
    EXPECT_EQ(logins.turn(now, "b"), Duration::zero());
    now += settings.longest_turn + pause;
    EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
    EXPECT_GT(settings.hold / pause, 40 + 10)
        << "so many turns pass while each of forty guessers waits for its answer";
}

TEST_F(LoginsTest, ARightTokenUsesUpNoTurn) {
    fail(settings.free + 10);
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(logins.turn(now, "a"), Duration::zero());
        logins.succeeded("a");
    }
}

TEST_F(LoginsTest, ForgiveWithTime) {
    fail(1000);
    now += settings.forgiven_after;
    EXPECT_TRUE(held());
    now += settings.forgiven_after * settings.remembered;
    EXPECT_FALSE(held());
    fail(settings.free);
    EXPECT_FALSE(held());
}

TEST_F(LoginsTest, ForgiveAnAddressWithMoreRightTokensThanWrongOnes) {
    fail(settings.free + 1);
    logins.succeeded("a");
    EXPECT_FALSE(held());
    for (unsigned i = 0; i < 100; ++i) logins.succeeded("a");
    EXPECT_EQ(logins.addresses(), 0u);
    fail(settings.free + 1);
    EXPECT_TRUE(held());
}

TEST_F(LoginsTest, RememberSoManyAddressesAndForgetTheOneThatFailedLongestAgo) {
    fail(settings.free + 1, "old");
    now += 1ms;
    for (unsigned i = 0; i + 1 < settings.addresses; ++i) fail(1, std::to_string(i));
    EXPECT_TRUE(held("old"));
    fail(1, "one more");
    EXPECT_FALSE(held("old"));
    EXPECT_EQ(logins.addresses(), settings.addresses);
}

/// Places for three connections, two of an address, two streams and two throttled ones of an
/// address, two probes. Plays moves: "4a" is the arrival of connection 4 from address a, behind it
/// what comes of it: "?" a place for probes only, "-2" connection 2 leaves. "b1" is busy(1),
/// "i1" idle(1), "l1" leave(1), "s1" suspect(1), "w1" wrong(1), "e1" an event stream, "e1!" too
/// many.
void play(const std::string& moves) {
    Settings settings;
    settings.max_connections = 3;
    settings.max_connections_per_address = 2;
    settings.max_streams_per_address = 2;
    settings.max_throttled = 2;
    settings.probe_places = 2;
    Places places(settings);
    std::istringstream in(moves);
    for (std::string move; in >> move;) {
        SCOPED_TRACE(moves + ": " + move);
        if (std::isdigit(static_cast<unsigned char>(move[0])) != 0) {
            const std::size_t address = move.find_first_of("abcde");
            const auto arrival = places.arrive(std::stoull(move), std::string(1, move.at(address)));
            std::string came = arrival.probes_only ? "?" : "";
            if (arrival.leaves) came += '-' + std::to_string(*arrival.leaves);
            EXPECT_EQ(came, move.substr(address + 1));
            continue;
        }
        const Places::Id id = std::stoull(move.substr(1));
        if (move[0] == 'b') places.busy(id);
        if (move[0] == 'i') places.idle(id);
        if (move[0] == 'l') places.leave(id);
        if (move[0] == 's') places.suspect(id);
        if (move[0] == 'w') places.wrong(id);
        if (move[0] == 'e') {
            EXPECT_EQ(places.stream(id), move.back() != '!');
        }
        EXPECT_EQ(places.is_throttled(id), move[0] == 'w');
    }
}

TEST(Places, AreTakenFromTheLongestIdleOneAndFromNoneThatHasARequest) {
    play("1a 2b 3c b1 i1 4d-2 5d-3 6e-1");
    play("1b 2a 3a 4a-2");  // an address with many connections displaces only its own
    play("1a 2a 3b b1 b2 b3 4a? 5c? i3 6c-3");
    play("1a 2a 3b b1 b2 b3 l1 4a b4 l1 b1 i1 5a?");  // that of a closed one is free
    std::string probes = "1a 2a 3b b1 b2 b3 4a? b4 5a? b5";
    for (int id = 6; id < 100; ++id) {
        const std::string name = std::to_string(id);
        probes += ' ' + name + "a?-" + std::to_string(id - 2) + " b" + name;
    }
    play(probes);  // there is always one for a probe
}

TEST(Places, OfAWrongTokenAreFreeAndItKeepsItsConnection) {
    play("1a 2a b1 b2 w2 3a b3 4a?");       // the place is taken once
    play("1a w1 2a w2 3a-1 w3 4b");         // so many of an address, then the oldest leaves
    play("1b 2a 3a b2 b3 w2 4c-2 5d-1");    // in a full house before those that are idle
    play("1a 2a 3b b1 b2 b3 s2 4a? 5c-2");  // a guessing address gives way to another only
    play("1a 2a 3b b1 b2 b3 s2 b2 4c?");    // not if its token was found right
}

/// A proxy is one address, and each tab keeps a stream open all day.
TEST(Places, OfAnAddressAreNotTakenByItsEventStreams) { play("1a b1 e1 2a b2 e2 3a e3! l1 e3"); }

constexpr TimePoint kStart{1h};

RateLimitSettings rate_settings() {
    RateLimitSettings made;
    made.request = 1ms;
    made.bytes_per_second = 1000 * 1000;
    made.burst = 100ms;
    made.longest_wait = 2s;
    return made;
}

/// Returns how many requests of this size are answered in ten seconds if the client never pauses.
int answered(RateLimiter& rate_limit, const std::string& address, std::size_t bytes) {
    int count = 0;
    for (TimePoint now = kStart; now < kStart + 10s; ++count)
        now += rate_limit.take(now, address, bytes);
    return count;
}

TEST(RateLimiter, AnAddressHasItsRateAndABurst) {
    RateLimiter rate_limit(rate_settings());
    EXPECT_NEAR(answered(rate_limit, "a", 0), 10'000 + 100, 2);
    EXPECT_NEAR(answered(rate_limit, "b", 9'000), 1'000 + 10, 2) << "and is alone with its share";
}

TEST(RateLimiter, ARareClientNeverWaitsAndNoneOfABusyAddressForever) {
    RateLimiter rate_limit(rate_settings());
    for (TimePoint now = kStart; now < kStart + 10s; now += 50ms)
        ASSERT_EQ(rate_limit.take(now, "rare", 40'000), Duration::zero());
    Duration longest{};
    for (int i = 0; i < 100; ++i)
        longest = std::max(longest, rate_limit.take(kStart, "busy", 1'000'000));
    EXPECT_EQ(longest, Duration(2s));
}

}  // namespace
}  // namespace panelgate::web::admission_test
