#include "admission.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <sstream>
#include <string>

namespace panelgate::web::admission_test {
namespace {

TEST(WrongTokens, OfAnAddressBarItUntilItsMinuteIsOver) {
    const WrongTokenSettings settings;
    WrongTokens wrong{settings};
    TimePoint now{1h};
    for (unsigned i = 0; i < settings.most; ++i) wrong.add(now, HostKey("a"));
    EXPECT_EQ(wrong.barred_for(now, HostKey("a")), Duration::zero());
    now += 20s;
    wrong.add(now, HostKey("a"));
    EXPECT_EQ(wrong.barred_for(now, HostKey("a")), 40s);
    EXPECT_EQ(wrong.barred_for(now, HostKey("b")), Duration::zero());
    now += 40s;
    EXPECT_EQ(wrong.barred_for(now, HostKey("a")), Duration::zero());
    for (unsigned i = 0; i < settings.most; ++i) wrong.add(now, HostKey("a"));
    EXPECT_EQ(wrong.barred_for(now, HostKey("a")), Duration::zero()) << "another minute";
}

TEST(WrongTokens, AreCountedOfSoManyAddresses) {
    WrongTokenSettings settings;
    settings.addresses = 2;
    settings.most = 0;
    WrongTokens wrong{settings};
    const TimePoint now{1h};
    const auto is_barred = [&](const char* address) {
        return wrong.barred_for(now + 3ms, HostKey(address)) > Duration::zero();
    };
    wrong.add(now, HostKey("a"));
    wrong.add(now + 1ms, HostKey("b"));
    wrong.add(now + 2ms, HostKey("b"));
    EXPECT_TRUE(is_barred("a")) << "no other address has come";
    wrong.add(now + 3ms, HostKey("c"));
    EXPECT_FALSE(is_barred("a"));
    EXPECT_TRUE(is_barred("b"));
    EXPECT_TRUE(is_barred("c"));
}

/// Places for three connections, two of an address, two streams of an address, two probes. Plays
/// moves: "4a" is the arrival of connection 4 from address a, behind it what comes of the arrival:
/// "?" a place for probes only, "-2" connection 2 leaves. "b1" is busy(1), "i1" idle(1),
/// "l1" leave(1), "e1" an event stream, "e1!" a stream too many.
void play(const std::string& moves) {
    Settings settings;
    settings.max_connections = 3;
    settings.max_connections_per_address = 2;
    settings.max_streams_per_address = 2;
    settings.probe_places = 2;
    Places places(settings);
    std::istringstream in(moves);
    for (std::string move; in >> move;) {
        SCOPED_TRACE(moves + ": " + move);
        if (std::isdigit(static_cast<unsigned char>(move[0])) != 0) {
            const std::size_t address = move.find_first_of("abcde");
            const auto arrival = places.arrive(std::stoull(move), HostKey(move.substr(address, 1)));
            std::string came = arrival.probes_only ? "?" : "";
            if (arrival.leaves) came += '-' + std::to_string(*arrival.leaves);
            EXPECT_EQ(came, move.substr(address + 1));
            continue;
        }
        const Places::Id id = std::stoull(move.substr(1));
        if (move[0] == 'b') places.busy(id);
        if (move[0] == 'i') places.idle(id);
        if (move[0] == 'l') places.leave(id);
        if (move[0] == 'e') {
            EXPECT_EQ(places.stream(id), move.back() != '!');
        }
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

/// A proxy is one address, and each tab keeps a stream open all day.
TEST(Places, OfAnAddressAreNotTakenByItsEventStreams) { play("1a b1 e1 2a b2 e2 3a e3! l1 e3"); }

constexpr TimePoint kStart{1h};

}  // namespace
}  // namespace panelgate::web::admission_test
