#include "panelgate/standby/seat.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace panelgate::standby {
namespace {

constexpr Duration kLook = 100ms;

class SeatTest : public testing::Test {
  protected:
    /// Looks until `until`; returns the first deed.
    std::optional<Deed> wait(Seat& seat, Duration duration) {
        for (const TimePoint until = now + duration; now < until;) {
            now += kLook;
            if (const auto deed = seat.look(now)) return deed;
        }
        return std::nullopt;
    }
    void become_master(Seat& seat) {
        seat.on_line(now, true);
        ASSERT_EQ(wait(seat, 3s), Deed::probe);
        ASSERT_EQ(seat.on_probed(now, true), Deed::drive);
    }

    TimePoint now{1h};
};

TEST_F(SeatTest, ASilentLineIsClaimedAndAnAnswerMakesTheMaster) {
    Seat seat(0);
    seat.on_line(now, true);
    const TimePoint begin = now;
    EXPECT_EQ(wait(seat, 3s), Deed::probe);
    EXPECT_LE(now - begin, Seat::kPatience + 2 * kLook);
    EXPECT_FALSE(seat.may_send(now));
    EXPECT_EQ(seat.on_probed(now, true), Deed::drive);
    EXPECT_TRUE(seat.may_send(now));
}

TEST_F(SeatTest, RankOneWaitsHalfASecondLonger) {
    Seat seat(1);
    seat.on_line(now, true);
    const TimePoint begin = now;
    EXPECT_EQ(wait(seat, 3s), Deed::probe);
    EXPECT_GE(now - begin, Seat::kPatience + Seat::kPatienceOfRank);
}

TEST_F(SeatTest, WhatIsHeardHoldsAClaimOff) {
    Seat seat(1);
    seat.on_line(now, true);
    for (int i = 0; i < 100; ++i) {
        now += Seat::kSilence;
        EXPECT_EQ(seat.look(now), std::nullopt);
        seat.on_heard(now);
    }
    EXPECT_EQ(seat.role(), Role::listening);
}

TEST_F(SeatTest, ThePeerThatSaysItIsMasterHoldsAClaimOffWhileItsWordIsFresh) {
    Seat seat(1);
    seat.on_line(now, true);
    seat.on_peer(now + 1s, true);
    EXPECT_EQ(wait(seat, 3s), std::nullopt);
    EXPECT_EQ(wait(seat, 3s), Deed::probe) << "nothing was heard of it since";
}

TEST_F(SeatTest, WithoutAnAnswerItStaysBackAndTriesLessOften) {
    Seat seat(1);
    seat.on_line(now, true);
    std::vector<TimePoint> probes;
    for (int i = 0; i < 6; ++i) {
        ASSERT_EQ(wait(seat, 2min), Deed::probe);
        probes.push_back(now);
        EXPECT_EQ(seat.on_probed(now, false), Deed::listen);
        EXPECT_TRUE(seat.is_deaf());
    }
    EXPECT_GT(probes[5] - probes[4], 2 * (probes[2] - probes[1]));
    seat.on_heard(now);
    EXPECT_FALSE(seat.is_deaf());
}

TEST_F(SeatTest, PanelsThatWereNotAskedYetAreAskedSoonInEachRound) {
    Seat seat(1);
    seat.on_line(now, true);
    ASSERT_EQ(wait(seat, 3s), Deed::probe);
    for (int round = 0; round < 4; ++round) {
        for (int i = 0; i < 6; ++i) {
            EXPECT_EQ(seat.on_probed(now, false, false), Deed::listen);
            const TimePoint begin = now;
            ASSERT_EQ(wait(seat, 3s), Deed::probe);
            EXPECT_LE(now - begin, Seat::kRetry + kLook);
        }
        EXPECT_EQ(seat.on_probed(now, false, true), Deed::listen);
        ASSERT_EQ(wait(seat, 1min), Deed::probe);
    }
}

TEST_F(SeatTest, SilenceCountsWhenItIsLongerThanAMasterMayBeSilent) {
    Seat seat(1);
    seat.set_quiet(5s);
    seat.on_line(now, true);
    EXPECT_EQ(wait(seat, 5900ms), std::nullopt);
    EXPECT_EQ(wait(seat, 1s), Deed::probe);
    EXPECT_EQ(wait(seat, 5s), std::nullopt) << "a panel may think so long";
    EXPECT_EQ(wait(seat, 2s), Deed::listen);
}

TEST_F(SeatTest, AMasterThatNobodyAnswersLeavesAndStaysBackForAWhile) {
    Seat seat(0);
    EXPECT_EQ(seat.on_unanswered(now), std::nullopt);
    become_master(seat);
    EXPECT_EQ(seat.on_unanswered(now), Deed::listen);
    EXPECT_EQ(wait(seat, Seat::kLeaves - kLook), std::nullopt);
    EXPECT_EQ(wait(seat, 1s), Deed::probe);
}

TEST_F(SeatTest, AnActiveMasterIsNeverSilentForLong) {
    Seat seat(0);
    become_master(seat);
    seat.on_sent(now);
    const TimePoint begin = now;
    EXPECT_EQ(wait(seat, 1s), Deed::keep_alive);
    EXPECT_LE(now - begin, Seat::kSilence);
    seat.on_sent(now);
    EXPECT_EQ(wait(seat, Seat::kKeepAlive - kLook), std::nullopt);
}

TEST_F(SeatTest, RankOneLeavesToAnotherMasterAndRankZeroStays) {
    Seat one(1);
    become_master(one);
    EXPECT_EQ(one.on_foreign_request(now), Deed::listen);
    EXPECT_FALSE(one.may_send(now));
    Seat zero(0);
    become_master(zero);
    EXPECT_EQ(zero.on_foreign_request(now), Deed::keep_alive) << "the other box hears it";
    EXPECT_TRUE(zero.may_send(now));
}

TEST_F(SeatTest, AClaimEndsWhereAnotherMasterIsHeard) {
    Seat seat(0);
    seat.on_line(now, true);
    ASSERT_EQ(wait(seat, 3s), Deed::probe);
    EXPECT_EQ(seat.on_foreign_request(now), Deed::listen);
    EXPECT_EQ(seat.on_probed(now, true), std::nullopt) << "too late";
}

TEST_F(SeatTest, WhoWasStoppedSendsNothingAndListensFirst) {
    Seat seat(0);
    become_master(seat);
    now += Seat::kStopped;
    EXPECT_FALSE(seat.may_send(now)) << "before its first look";
    EXPECT_EQ(seat.look(now), Deed::listen);
    EXPECT_EQ(seat.role(), Role::listening);
}

TEST_F(SeatTest, ALineThatIsDownHasNoMasterHere) {
    Seat seat(0);
    become_master(seat);
    EXPECT_EQ(seat.on_line(now, false), Deed::listen);
    EXPECT_EQ(wait(seat, 1min), std::nullopt);
    seat.on_line(now, true);
    EXPECT_EQ(wait(seat, 3s), Deed::probe);
}

/// Two boxes at one line, in virtual time. A frame reaches the other box unless the line is cut or
/// that box is deaf or stopped.
class World {
  public:
    explicit World(unsigned seed) : random_(seed) {
        for (Box& box : boxes_) box.seat.on_line(now_, true);
    }

    void run(Duration duration) {
        for (const TimePoint until = now_ + duration; now_ < until; now_ += 10ms) {
            for (std::size_t i = 0; i < boxes_.size(); ++i) step(i);
            watch();
        }
    }
    void stop(std::size_t box, Duration duration) { boxes_[box].stopped = now_ + duration; }
    void deafen(std::size_t box, Duration duration) { boxes_[box].deaf = now_ + duration; }
    void cut(Duration duration) { cut_ = now_ + duration; }
    void part(Duration duration) { parted_ = now_ + duration; }
    unsigned dice(unsigned sides) { return static_cast<unsigned>(random_() % sides); }
    TimePoint now() const { return now_; }

    std::size_t masters() const {
        return static_cast<std::size_t>(std::ranges::count_if(
            boxes_, [this](const Box& box) { return box.seat.may_send(now_); }));
    }
    std::vector<Duration> pauses{};
    std::size_t take_overs = 0;
    std::size_t shared_frames = 0;  ///< sent while both boxes were master on one whole line
    std::size_t most_shared = 0;    ///< of them in one encounter
    bool somebody_deaf = false;

  private:
    struct Box {
        Seat seat;
        TimePoint stopped{};
        TimePoint deaf{};
        TimePoint next_look{};
        TimePoint next_frame{};
        TimePoint probed{};
    };

    bool hears(const Box& box) const { return now_ >= box.deaf && now_ >= box.stopped; }

    void send(std::size_t from) {
        if (now_ >= cut_) {
            last_frame_ = now_;
            Box& other = boxes_[1 - from];
            if (hears(other))
                obey(1 - from, other.seat.role() == Role::listening
                                   ? other.seat.on_heard(now_)
                                   : other.seat.on_foreign_request(now_));
        }
        const bool both = boxes_[0].seat.may_send(now_) && boxes_[1].seat.may_send(now_);
        if (!both || now_ < cut_ || !hears(boxes_[0]) || !hears(boxes_[1])) {
            encounter_ = 0;
            return;
        }
        ++shared_frames;
        most_shared = std::max(most_shared, ++encounter_);
    }

    void obey(std::size_t which, std::optional<Deed> deed) {
        if (!deed) return;
        Box& box = boxes_[which];
        if (*deed == Deed::probe) {
            box.probed = now_ + 50ms;
            send(which);
        }
        if (*deed == Deed::keep_alive) send(which);
        if (*deed == Deed::drive) {
            ++take_overs;
            pauses.push_back(now_ - last_master_);
            box.next_frame = now_;
        }
    }

    void step(std::size_t which) {
        Box& box = boxes_[which];
        if (now_ < box.stopped) return;
        if (box.seat.role() == Role::claiming && now_ >= box.probed)
            obey(which, box.seat.on_probed(now_, now_ >= box.deaf));
        if (now_ >= box.next_look) {
            box.next_look = now_ + kLook;
            if (now_ >= parted_)
                box.seat.on_peer(now_, boxes_[1 - which].seat.role() == Role::active &&
                                           now_ >= boxes_[1 - which].stopped);
            obey(which, box.seat.look(now_));
        }
        if (now_ >= box.next_frame && box.seat.may_send(now_)) {
            box.next_frame = now_ + std::chrono::milliseconds(20 + dice(400));
            box.seat.on_sent(now_);
            send(which);
        }
    }

    void watch() {
        const bool any = std::ranges::any_of(boxes_, [this](const Box& box) {
            return box.seat.may_send(now_) && now_ >= box.stopped;
        });
        if (any) last_master_ = now_;
    }

    std::mt19937 random_;
    TimePoint now_{1h};
    TimePoint last_frame_{};
    TimePoint last_master_{1h};
    TimePoint cut_{};
    TimePoint parted_{};
    std::size_t encounter_ = 0;
    std::array<Box, 2> boxes_{{{Seat(0)}, {Seat(1)}}};
};

TEST(StandbyWorld, AThousandTakeOversMeetInOneFrameAtMost) {
    World world(20261130);
    world.run(10s);
    while (world.take_overs < 1000) {
        const std::size_t box = world.dice(2);
        switch (world.dice(5)) {
            case 0:
                world.stop(box, std::chrono::milliseconds(500 + world.dice(8000)));
                break;
            case 1:
                world.deafen(box, std::chrono::milliseconds(500 + world.dice(8000)));
                break;
            case 2:
                world.cut(std::chrono::milliseconds(500 + world.dice(8000)));
                break;
            case 3:
                world.part(std::chrono::seconds(world.dice(20)));
                break;
            default:
                world.stop(box, 10s);
                break;
        }
        world.run(12s);
        ASSERT_LT(world.now(), TimePoint(1000h));
    }
    EXPECT_LE(world.most_shared, 1U) << "after the first frame the other box knows";
    std::ranges::sort(world.pauses);
    const Duration p99 = world.pauses[world.pauses.size() * 99 / 100];
    EXPECT_LT(p99, 3s);
}

}  // namespace
}  // namespace panelgate::standby
