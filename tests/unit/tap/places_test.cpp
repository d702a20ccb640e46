#include "panelgate/tap/places.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "heard_line.hpp"
#include "panelgate/base/bytes.hpp"

namespace panelgate::tap::test::places_test {
namespace {

using Registers = std::vector<unsigned>;

/// What the panel holds at a place, in the n-th request.
using Holds = std::function<Registers(std::size_t place, unsigned n)>;

/// A panel of some places, each of which is asked for by one request.
struct Panel {
    std::size_t places = 8;
    unsigned count = 4;   ///< registers of a place
    bool in_turn = true;  ///< its master asks for one after the other
    unsigned copies = 0;  ///< one of so many replies is the one before it once more; 0: none
};

struct Score {
    std::size_t right = 0;
    std::size_t wrong = 0;
    std::size_t doubtful = 0;  ///< although it was right
    std::size_t refused = 0;   ///< copies
};

Bytes reply_of(const Registers& registers) {
    Writer out;
    out.u8(0x03).u8(static_cast<unsigned>(2 * registers.size()));
    for (const unsigned one : registers) out.u16(one);
    return out.take();
}

Score play(const Panel& panel, const Holds& holds, unsigned turns, unsigned seed) {
    std::mt19937 random(seed);
    Line line;
    std::vector<Bytes> truths;
    Bytes last;
    std::size_t asked = 0;
    for (unsigned n = 0; n < turns; ++n) {
        const bool copy = panel.copies != 0 && n % panel.copies == panel.copies - 1;
        std::size_t place = panel.in_turn ? n % panel.places : random() % panel.places;
        // What the same place says again is the same as far as is known.
        if (copy) place = (place + (asked == place ? 1 : 0)) % panel.places;
        asked = place;
        Writer request;
        request.u8(0x03).u16(static_cast<unsigned>(4 * place)).u16(panel.count);
        truths.push_back(reply_of(holds(place, n)));
        if (!copy) last = truths.back();
        line.say(10ms, "5:" + to_hex(request.take(), ""));
        line.say(6ms, "5:" + to_hex(last, ""));
    }
    line.settle();
    EXPECT_EQ(line.transactions.size(), turns);
    Score score;
    for (std::size_t i = 0; i < line.transactions.size(); ++i) {
        const Transaction& made = line.transactions[i];
        if (made.reply == truths[i])
            ++(made.doubtful ? score.doubtful : score.right);
        else
            ++(made.doubtful ? score.refused : score.wrong);
    }
    return score;
}

class Numbers {
  public:
    unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }

  private:
    std::mt19937 random_{1};
};

/// Marks, a clock, and a register that is written now and again.
Registers marked(std::size_t place, unsigned n) {
    const unsigned mark = 0x57D0 + 4 * static_cast<unsigned>(place);
    return {mark, 7 * n & 0xFFFF, 0, mark ^ 0xFFFF};
}

TEST(Places, APanelThatAnswersWithItsLastReplyIsFoundOut) {
    for (const bool in_turn : {false, true}) {
        for (unsigned seed = 1; seed <= 10; ++seed) {
            const Score score = play({.in_turn = in_turn, .copies = 11}, marked, 600, seed);
            EXPECT_LE(score.wrong, 5u) << seed;
            EXPECT_GE(score.refused, 49u) << seed;
            EXPECT_EQ(score.doubtful, 0u) << seed;
        }
    }
}

/// Its two bytes may be chance, or one bit of them: it takes longer.
TEST(Places, OneRegisterTellsLessThanFour) {
    const auto level = [](std::size_t place, unsigned n) {
        return Registers{static_cast<unsigned>(300 * place) + n % 3};
    };
    for (unsigned seed = 1; seed <= 10; ++seed) {
        const Panel panel{.count = 1, .in_turn = false, .copies = 11};
        const Score score = play(panel, level, 600, seed);
        EXPECT_LE(score.wrong, 14u) << seed;
        EXPECT_EQ(score.doubtful, 0u) << seed;
    }
}

void expect_good(const char* name, Panel panel, const Holds& holds, std::size_t lost) {
    constexpr unsigned kTurns = 2000;
    for (const bool in_turn : {true, false}) {
        panel.in_turn = in_turn;
        const Score score = play(panel, holds, kTurns, 1);
        EXPECT_EQ(score.wrong, 0u) << name;
        EXPECT_LE(score.doubtful, lost) << name;
        std::cout << name << (in_turn ? ", in turn: " : ": ") << score.doubtful << " in doubt\n";
    }
}

/// Values that are equal by nature are none of another place.
TEST(Places, EqualValuesStayGood) {
    expect_good("zeros", {}, [](std::size_t, unsigned) { return Registers(4, 0); }, 0);
    const auto constants = [](std::size_t place, unsigned) {
        return Registers(4, place % 3 == 0 ? 215 : 300);
    };
    expect_good("constants", {}, constants, 0);
    Numbers number;
    const auto flags = [&](std::size_t place, unsigned) {
        return Registers{place == 0 ? 1u : place < 3 ? number.below(8) / 7 : 0u};
    };
    expect_good("flags", {.places = 6, .count = 1}, flags, 0);
    const auto set_points = [](std::size_t place, unsigned n) {
        return Registers{n / 100 >= place ? 500u : 20u * static_cast<unsigned>(place)};
    };
    expect_good("set points that become equal", {.count = 1}, set_points, 8);
}

TEST(Places, MirroredValuesStayGood) {
    const auto counter = [](std::size_t, unsigned n) { return Registers{0, n / 2, 0, 0x1234}; };
    expect_good("a counter twice", {.places = 2}, counter, 0);
    Numbers number;
    Registers measured;
    for (const unsigned moves : {1u, 2u, 5u, 20u}) {
        const auto mirror = [&](std::size_t, unsigned n) {
            if (n % moves == 0)
                measured = {215u + number.below(3), 300u + number.below(3), 18u,
                            500u + number.below(9)};
            return measured;
        };
        expect_good("measured values twice", {.places = 2}, mirror, 5);
    }
}

}  // namespace
}  // namespace panelgate::tap::test::places_test
