#include "world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <ostream>
#include <string>
#include <variant>

#include "panelgate/modbus/function.hpp"
#include "panelgate/tap/matcher.hpp"

namespace panelgate::tap::test::world_test {
namespace {

struct Score {
    std::size_t asked = 0;
    std::size_t answerable = 0;  ///< to which the panel has sent a reply, damaged or not
    std::size_t right = 0;
    std::size_t doubtful = 0;
    std::size_t wrong = 0;
    std::size_t invented = 0;  ///< reported without doubt, but never asked
    std::string example{};
};

std::ostream& operator<<(std::ostream& out, const Score& score) {
    return out << score.asked << " asked, " << score.answerable << " answered, " << score.right
               << " right, " << score.doubtful << " in doubt, " << score.wrong << " wrong, "
               << score.invented << " invented; " << score.example;
}

/// Compares what is reported with what really happened.
class Judge {
  public:
    Judge(const World& world, Duration latency) : world_(world), slack_(latency + 2ms) {}

    void hear(const Event& event) {
        if (const auto* made = std::get_if<Transaction>(&event)) return judge(*made);
        const auto& frame = std::get<Frame>(event);
        history_.push_back(std::to_string(to_seconds(frame.at.time_since_epoch())) + ' ' +
                           std::string(label(frame.kind)) + ' ' + to_hex(frame.bytes, ""));
        constexpr std::size_t kKept = 8;
        if (history_.size() > kKept) history_.pop_front();
    }
    Score score;

  private:
    void judge(const Transaction& made) {
        if (made.doubtful) {
            ++score.doubtful;
            return;
        }
        const Asked* asked = find(made);
        if (made.end == End::unasked) return;  // a broadcast has no values
        if (asked == nullptr) return complain(score.invented, "invented", made);
        if (made.end != End::answered) return;
        // A function without a length rule has no values, and such frames may be lost when joined.
        const bool has_values = modbus::is_known(made.request[0]);
        if (has_values && !asked->replies.contains(made.reply) && !answers_same(made))
            return complain(score.wrong, "wrong", made);
        ++score.right;
    }
    /// The request that was asked then.
    const Asked* find(const Transaction& made) {
        const auto& all = world_.asked();
        for (std::size_t i = all.size(); i-- > 0 && made.asked - all[i].begin < 10s;) {
            if (all[i].station != made.station || all[i].pdu != made.request) continue;
            if (std::chrono::abs(made.asked - all[i].begin) <= slack_) return &all[i];
        }
        return nullptr;
    }
    /// An equal earlier request has this answer, and its values are reported as that old.
    bool answers_same(const Transaction& made) {
        const auto& all = world_.asked();
        for (std::size_t i = all.size(); i-- > 0 && made.asked - all[i].begin < 10s;) {
            const bool same = all[i].station == made.station && all[i].pdu == made.request;
            if (same && all[i].replies.contains(made.reply))
                return made.sampled <= all[i].begin + slack_;
        }
        return false;
    }
    void complain(std::size_t& count, const char* word, const Transaction& made) {
        constexpr std::size_t kShown = 3;
        if (++count > kShown) return;
        for (const std::string& frame : history_) score.example += "\n    " + frame;
        score.example += std::string("\n  ") + word + ' ' + std::to_string(made.station) + ": " +
                         to_hex(made.request, "") + " -> " + to_hex(made.reply, "") + " asked at " +
                         std::to_string(to_seconds(made.asked.time_since_epoch()));
    }

    const World& world_;
    Duration slack_;
    std::deque<std::string> history_;  ///< frames
};

Score play(const Manner& manner, std::size_t turns) {
    World world(manner);
    Judge judge(world, manner.latency);
    Matcher matcher(Settings{World::kSerial});
    const auto collect = [&] {
        while (const auto event = matcher.poll_action()) judge.hear(*event);
    };
    TimePoint last{};
    for (std::size_t i = 0; i < turns; ++i) {
        world.turn();
        if (i % 50 != 49) continue;  // chunks hold bytes of more than one turn
        for (const World::Chunk& chunk : world.take_chunks()) {
            for (auto next = matcher.next_deadline(); next && *next < chunk.at;
                 next = matcher.next_deadline()) {
                matcher.on_deadline(*next);
                collect();
            }
            last = std::max(last, chunk.at);
            matcher.on_rx(last, chunk.bytes);
            collect();
        }
    }
    judge.score.asked = world.asked().size();
    for (const Asked& asked : world.asked())
        judge.score.answerable += asked.replies.empty() ? 0u : 1u;
    return judge.score;
}

std::size_t turns() {
    const char* const set = std::getenv("PANELGATE_TAP_TURNS");
    return set != nullptr ? std::stoul(set) : 100'000;
}

TEST(TapWorld, EachPairIsFoundOnAHealthyLine) {
    for (const Duration latency : {0ms, 4ms, 16ms}) {
        const Score score = play({.latency = latency}, 20'000);
        EXPECT_EQ(score.wrong + score.invented, 0u) << score;
        // T11: a write behind a broadcast to the same place.
        EXPECT_LE(score.doubtful * 80, score.asked) << score;
        // Frames of no known length, joined: only a silence or the next frame can end them.
        const std::size_t least =
            latency == 0ms ? score.answerable - 2 : score.answerable * 96 / 100;
        EXPECT_GE(score.right + score.doubtful, least) << score;
    }
}

TEST(TapWorld, EachReadIsFoundOnALineThatReturnsRequests) {
    const Score score = play({.echo = true}, 20'000);
    EXPECT_EQ(score.wrong + score.invented, 0u) << score;
    EXPECT_GT(score.right * 100, score.answerable * 60) << score;
}

TEST(TapWorld, NoPairIsWrongAmongPanelsWithFaults) {
    Manner manner{.silent = 0.02, .late = 0.02, .damaged = 0.02, .noise = 0.01};
    manner.holes = manner.doubled = 0.01;
    manner.announced = 0.002;
    manner.broadcast = 0.05;
    manner.slow = 0.02;
    for (const Duration latency : {0ms, 16ms}) {
        manner.latency = latency;
        const Score score = play(manner, turns());
        EXPECT_EQ(score.wrong, 0u) << score;
        EXPECT_LT(score.invented * 2000, score.asked) << score;
        EXPECT_LT(score.doubtful * 20, score.asked) << score;
        EXPECT_GT(score.right * 20, score.answerable * 17) << score;
        std::cout << score << '\n';
    }
}

/// A request that only the tap has not heard is no threat of the list: the late reply to such a
/// request is taken for the reply to an equal request.
TEST(TapWorld, HardlyAPairIsWrongForATapThatMishears) {
    Manner manner{.silent = 0.01, .late = 0.01, .misheard = 0.02};
    for (const unsigned seed : {1u, 2u}) {
        manner.seed = seed;
        const Score score = play(manner, turns());
        EXPECT_LT(score.wrong * 10'000, score.asked) << score;
        EXPECT_LT(score.invented * 300, score.asked) << score;
        std::cout << score << '\n';
    }
}

}  // namespace
}  // namespace panelgate::tap::test::world_test
