// What is made of bytes: frames that were heard, the outcome of one request, a panel's profile.
#include <gmock/gmock.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <random>
#include <vector>

#include "attempt.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/sim/station.hpp"
#include "recogniser.hpp"
#include "support/hex.hpp"
#include "virtual_line.hpp"

namespace panelgate::scan::replies_test {
namespace {

using ::testing::HasSubstr;
using Kind = Outcome::Kind;

const SerialFormat k9600{9600, 8, Parity::none, 1};
const SerialFormat k38400{38400, 8, Parity::none, 1};
const TimePoint kSent{1h};
const Bytes kReply = modbus::encode_adu(7, "03 02 00 05"_hex);

Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

TEST(TakeApart, FindsRequestsAndRepliesBetweenNoise) {
    const Bytes request = modbus::encode_adu(3, "04 00 10 00 02"_hex);
    const Bytes write = modbus::encode_adu(0, "10 00 01 00 01 02 00 05"_hex);
    const Heard heard = extract_frames(joined({"AB"_hex, request, kReply, "CD EF"_hex, write}));
    ASSERT_EQ(heard.frames.size(), 3u);
    EXPECT_EQ(heard.damaged, 3u);
    EXPECT_EQ(heard.frames[0].pdu, "04 00 10 00 02"_hex);
    EXPECT_EQ(heard.frames[2].station, 0);
    EXPECT_TRUE(extract_frames({}).frames.empty());
}

TEST(TakeApart, AFrameThatIsCutOffIsDamageAndHidesNoOther) {
    const Bytes cut(kReply.begin(), kReply.end() - 1);
    const Heard heard = extract_frames(joined({cut, kReply, cut}));
    ASSERT_EQ(heard.frames.size(), 1u);
    EXPECT_EQ(heard.frames[0].station, 7);
    EXPECT_EQ(heard.frames[0].pdu, "03 02 00 05"_hex);
    EXPECT_EQ(heard.damaged, 2 * cut.size());
}

TEST(TakeApart, AnExceptionIsAFrameAndWhatNobodyOnALineSaysIsNone) {
    const Heard exception = extract_frames(modbus::encode_adu(7, "83 02"_hex));
    ASSERT_EQ(exception.frames.size(), 1u);
    EXPECT_EQ(exception.frames[0].pdu, "83 02"_hex);
    for (const Bytes& adu :
         {modbus::encode_adu(248, "03 02 00 05"_hex), modbus::encode_adu(7, "41 02 00 05"_hex),
          modbus::encode_adu(0, "03 00 00 00 01"_hex)}) {
        const Heard heard = extract_frames(adu);
        EXPECT_TRUE(heard.frames.empty()) << to_hex(adu);
        EXPECT_EQ(heard.damaged, adu.size());
    }
}

TEST(TakeApart, EveryByteIsInAFrameOrDamaged) {
    std::mt19937 random(5);
    for (int i = 0; i < 2000; ++i) {
        Bytes noise(random() % 40);
        for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
        const Bytes bytes = joined({noise, kReply, noise});
        const Heard heard = extract_frames(bytes);
        std::size_t framed = 0;
        for (const Frame& frame : heard.frames) framed += frame.pdu.size() + 3;
        ASSERT_EQ(framed + heard.damaged, bytes.size()) << to_hex(bytes);
    }
}

Attempt make() {
    return {*ReadRequest::make(7, "03 00 00 00 01"_hex), k9600, kSent, {100ms, 60ms}};
}
Outcome hearing(std::initializer_list<Bytes> parts) {
    Attempt attempt = make();
    attempt.on_rx(kSent + 20ms, joined(parts));
    return attempt.finish();
}

TEST(Attempt, WaitsFromTheEndOfTheRequestAndEndsWhenNothingFollowsTheReply) {
    EXPECT_EQ(make().ends_at(), kSent + wire_time(k9600, 8) + 100ms);
    EXPECT_EQ(make().finish().kind, Kind::silent);
    Attempt attempt = make();
    attempt.on_rx(kSent + 20ms, kReply);
    EXPECT_EQ(attempt.ends_at(), kSent + 80ms);
    EXPECT_EQ(attempt.finish().kind, Kind::replied);
    EXPECT_EQ(attempt.finish().reply, "03 02 00 05"_hex);
}

TEST(Attempt, WaitsForTheRestOfWhatHasBegunButNotForBabble) {
    Attempt attempt = make();
    attempt.on_rx(kSent + 107ms, Bytes(kReply.begin(), kReply.begin() + 3));
    EXPECT_EQ(attempt.ends_at(), kSent + 167ms);
    for (int i = 0; i < 10'000; ++i) attempt.on_rx(kSent + 107ms + i * 1ms, "55 AA 55 AA"_hex);
    EXPECT_LT(attempt.ends_at(), kSent + 1s);
    EXPECT_EQ(attempt.finish().kind, Kind::damaged);
}

TEST(Attempt, CountsFurtherRepliesAndTornOnes) {
    EXPECT_EQ(hearing({kReply, kReply}).more, 1u);
    EXPECT_FALSE(hearing({kReply, kReply}).with_damage);
    EXPECT_TRUE(hearing({kReply, "07 03 02 00"_hex}).with_damage);
    EXPECT_FALSE(hearing({"00"_hex, kReply, "FF"_hex}).with_damage) << "a transceiver switches";
}

TEST(Attempt, TellsADamagedReplyFromNoise) {
    Bytes damaged = kReply;
    damaged[4] ^= 1;
    EXPECT_EQ(hearing({damaged}).kind, Kind::damaged);
    EXPECT_TRUE(hearing({damaged}).header_seen);
    EXPECT_EQ(hearing({"11 22 33 44 55"_hex}).kind, Kind::damaged);
    EXPECT_FALSE(hearing({"11 22 33 44 55"_hex}).header_seen);
    EXPECT_EQ(hearing({"00 FF"_hex}).kind, Kind::silent);
}

TEST(Attempt, TakesTheEchoOutWholeOrInPart) {
    const Bytes request = make().request().adu();
    EXPECT_EQ(hearing({request, kReply}).kind, Kind::replied);
    EXPECT_FALSE(hearing({request, kReply}).with_damage);
    EXPECT_EQ(hearing({request}).kind, Kind::silent);
    EXPECT_EQ(hearing({Bytes(request.begin(), request.begin() + 5)}).kind, Kind::silent);
    Attempt attempt = make();
    attempt.on_rx(kSent + 5ms, request);
    EXPECT_EQ(attempt.ends_at(), make().ends_at()) << "an echo is not the beginning of a reply";
}

TEST(Attempt, GivesFramesOfOthersAndOfOtherRequests) {
    const Bytes other = modbus::encode_adu(8, "03 02 00 05"_hex);
    const Bytes longer = modbus::encode_adu(7, "03 04 00 05 00 06"_hex);
    const Outcome outcome = hearing({other, longer, kReply});
    EXPECT_EQ(outcome.kind, Kind::replied);
    ASSERT_EQ(outcome.unsolicited.size(), 2u);
    EXPECT_EQ(outcome.unsolicited[0].station, 8);
    EXPECT_EQ(outcome.unsolicited[1].pdu.size(), 6u);
}

/// Answers all probes from a simulated panel and returns how many there were.
int answer_all(Recogniser& recogniser, const profile::PanelProfile& panel, std::uint8_t station) {
    sim::Station simulated(panel, station);
    int asked = 0;
    while (const auto probe = recogniser.next_probe()) {
        EXPECT_TRUE(modbus::is_pure_read(*probe));
        ++asked;
        recogniser.on_reply(*probe, simulated.handle(TimePoint(1h), 0, *probe));
    }
    return asked;
}
std::vector<Candidate> recognise(const profile::PanelProfile& panel, std::uint8_t station,
                                 const std::optional<SerialFormat>& format = k38400) {
    Recogniser recogniser(shipped(), station, format, panel.crc_order);
    answer_all(recogniser, panel, station);
    return recogniser.candidates();
}

TEST(Recogniser, KnowsEveryShippedProfileByItsAnswersInFewReads) {
    for (const auto& [name, panel] : shipped().all()) {
        for (const auto& format : {std::optional(k38400), std::optional<SerialFormat>()}) {
            Recogniser recogniser(shipped(), 9, format, panel.crc_order);
            EXPECT_LE(answer_all(recogniser, panel, 9), 20) << name;
            const auto candidates = recogniser.candidates();
            ASSERT_EQ(candidates.size(), 1u) << name;
            EXPECT_EQ(candidates[0].profile, name) << candidates[0].why;
        }
    }
}

TEST(Recogniser, TellsThreePanelsWithTheSameIdentificationApart) {
    for (const char* name : {"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005"}) {
        const auto candidates = recognise(*shipped().find(name), 31);
        ASSERT_EQ(candidates.size(), 1u);
        EXPECT_EQ(candidates[0].profile, name);
        EXPECT_THAT(candidates[0].why, HasSubstr("function 04 is refused; "));
    }
}

TEST(Recogniser, ConsidersOnlyWhatCanHaveTheAddressAndTheFormat) {
    const auto& panel = *shipped().find("autonics-gplp-s");
    EXPECT_EQ(recognise(panel, 32)[0].profile, "generic") << "1 to 31";
    EXPECT_EQ(recognise(panel, 3, SerialFormat{})[0].profile, "generic") << "38400 8N1";
}

TEST(Recogniser, NamesWhatIsNearestWhenNoneFitsAndForgivesMemorySizesToAPanelThatSaysItsName) {
    profile::PanelProfile small = *shipped().find("omron-cp2e");
    small.areas[1].readable.last = 4095;
    const auto candidates = recognise(small, 3);
    ASSERT_EQ(candidates.size(), 1u);
    EXPECT_EQ(candidates[0].profile, "generic");
    EXPECT_THAT(candidates[0].why, HasSubstr("no panel profile fits"));
    profile::PanelProfile arm = *shipped().find("autonics-arm");
    arm.areas[0].readable.last = 31;
    EXPECT_EQ(recognise(arm, 3)[0].profile, "autonics-arm");
    EXPECT_THAT(recognise(arm, 3)[0].why, HasSubstr("the model name begins with AR"));
}

TEST(Recogniser, GivesAllThatCannotBeToldApart) {
    profile::Catalogue profiles = shipped();
    profile::PanelProfile twin = *shipped().find("panasonic-gt");
    twin.name = "panasonic-twin";
    profiles.add(twin);
    Recogniser recogniser(profiles, 4, k38400);
    answer_all(recogniser, twin, 4);
    const auto candidates = recogniser.candidates();
    ASSERT_EQ(candidates.size(), 2u);
    EXPECT_EQ(candidates[0].profile, "panasonic-gt");
    EXPECT_EQ(candidates[1].profile, "panasonic-twin");
}

TEST(Recogniser, LearnsNothingFromSilenceAndFromABusyPanel) {
    for (const auto& reply : {std::optional<Bytes>(), std::optional<Bytes>("83 06"_hex)}) {
        Recogniser recogniser(shipped(), 4, k38400);
        int asked = 0;
        while (const auto probe = recogniser.next_probe()) {
            recogniser.on_reply(*probe, reply);
            ASSERT_LT(++asked, 100);
        }
        EXPECT_EQ(recogniser.candidates()[0].profile, "generic");
        EXPECT_EQ(recogniser.candidates()[0].why, "no panel profile fits");
    }
}

}  // namespace
}  // namespace panelgate::scan::replies_test
