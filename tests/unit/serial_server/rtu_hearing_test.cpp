#include "hearing.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::rtu_hearing_test {
namespace {

using modbus::encode_adu;
using testing::AnyOf;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

const Bytes kForeign = encode_adu(kOther, kReadOne);
const Bytes kWriteBeef = encode_adu(kOurs, Bytes{0x06, 0, 0, 0xBE, 0xEF});

/// Returns the stations of all frames, in order.
std::vector<int> heard(RtuHearing& hearing, const Bytes& bytes, bool silence = true) {
    std::vector<int> stations;
    const auto take = [&] {
        while (const auto adu = hearing.next()) stations.push_back(adu->station);
    };
    hearing.feed({}, bytes);
    take();
    if (silence) hearing.on_silence();
    take();
    return stations;
}
std::vector<int> heard(const Bytes& bytes, bool silence = true) {
    RtuHearing hearing(Talk::served());
    return heard(hearing, bytes, silence);
}
/// In pieces of this size, with a silence behind each.
std::vector<int> heard_in_pieces(Bytes bytes, std::size_t size) {
    RtuHearing hearing(Talk::served());
    std::vector<int> all;
    while (!bytes.empty()) {
        for (const int station : heard(hearing, take_first(bytes, size))) all.push_back(station);
    }
    return all;
}

Bytes reply_with(const Bytes& data) {
    return encode_adu(kOther, joined({{0x03, static_cast<std::uint8_t>(data.size())}, data}));
}

TEST(RtuHearing, FindsARequestWithoutASilenceAndInAnyPieces) {
    EXPECT_THAT(heard(kRequest, false), ElementsAre(kOurs));
    EXPECT_THAT(heard_in_pieces(kRequest, 1), ElementsAre(kOurs));
}

TEST(RtuHearing, FindsARequestBehindAGlitchOrHalfAFrame) {
    for (int glitch = 0; glitch < 256; ++glitch) {
        const Bytes noise{static_cast<std::uint8_t>(glitch)};
        EXPECT_THAT(heard(joined({noise, kRequest})), ElementsAre(kOurs)) << glitch;
    }
    for (const Bytes& glitch : {Bytes{0xFF}, Bytes{0, 0xFF}, Bytes{0xF0, 0xFF, 0xFF}})
        EXPECT_THAT(heard(joined({glitch, kWriteBeef})), ElementsAre(kOurs));
    Bytes all = kRequest;
    EXPECT_THAT(heard(joined({take_first(all, 5), kRequest})), ElementsAre(kOurs));
}

TEST(RtuHearing, NeverTakesADamagedFrame) {
    for (std::size_t at = 0; at < kRequest.size() * 8; ++at) {
        RtuHearing hearing(Talk::served());
        Bytes damaged = kRequest;
        damaged[at / 8] ^= static_cast<std::uint8_t>(1u << at % 8);
        EXPECT_THAT(heard(hearing, damaged), IsEmpty()) << at;
        hearing.drop_pending();
        EXPECT_THAT(heard(hearing, kRequest), ElementsAre(kOurs)) << at;
    }
}

TEST(RtuHearing, HearsAnotherUnitsExchangeAndTheNextRequestInOnePiece) {
    RtuHearing hearing(Talk::served());
    EXPECT_THAT(heard(hearing, joined({kForeign, reply_with({1, 2}), kRequest}), false),
                ElementsAre(kOther, kOther, kOurs));
    EXPECT_EQ(hearing.take_faults(), 0u);
    const Bytes no = encode_adu(kOther, Bytes{0x83, 0x02});  // an exception
    EXPECT_THAT(heard(joined({kForeign, no, kRequest})), ElementsAre(kOther, kOther, kOurs));
}

TEST(RtuHearing, FindsNoRequestInAnotherUnitsData) {
    EXPECT_THAT(heard(reply_with(kRequest), false), ElementsAre(kOther));
    for (std::size_t piece = 1; piece < 10; ++piece)
        EXPECT_THAT(heard_in_pieces(reply_with(kRequest), piece), ElementsAre(kOther)) << piece;
    Bytes damaged = reply_with(joined({kRequest, {1, 2}}));  // the data goes on
    damaged[2] = 2;
    EXPECT_THAT(heard(damaged), IsEmpty());
}

TEST(RtuHearing, P2TakesNoWriteOutOfADamagedOne) {
    const Bytes& write = kWriteBeef;
    for (const Bytes& data : {write, joined({{0, 7}, write}), joined({write, {0, 7}}),
                              joined({kForeign, write}), joined({write, write})}) {
        const auto size = static_cast<std::uint8_t>(data.size());
        Bytes damaged = joined({{kOurs, 0x10, 1, 0, 0, 8, size}, data});
        for (const Bytes& crc : {Bytes{}, Bytes{0x12, 0x34}}) {
            RtuHearing hearing(Talk::served());
            EXPECT_THAT(heard(hearing, joined({damaged, crc})), Not(Contains(kOurs)));
            hearing.drop_pending();
            EXPECT_THAT(heard(hearing, {}), Not(Contains(kOurs)));
            EXPECT_GE(hearing.take_faults(), 1u);
            EXPECT_THAT(heard(hearing, write), ElementsAre(kOurs)) << "it is said again";
        }
    }
}

TEST(RtuHearing, P3AWriteBehindNoiseThatASilenceHasEndedIsWhole) {
    std::mt19937 random(5);
    int taken = 0;
    for (int i = 0; i < 1000; ++i) {
        Bytes noise;
        for (unsigned n = 1 + random() % 11; n > 0; --n)
            noise.push_back(static_cast<std::uint8_t>(random()));
        RtuHearing hearing(Talk::served());
        heard(hearing, noise);
        std::vector<int> all = heard(hearing, kWriteBeef);
        hearing.drop_pending();
        if (all.empty()) all = heard(hearing, {});
        EXPECT_THAT(all, AnyOf(IsEmpty(), ElementsAre(kOurs)));
        taken += all.empty() ? 0 : 1;
    }
    EXPECT_GT(taken, 970) << "but for noise that looks like the beginning of a longer frame";
    for (const Bytes& noise : {Bytes{0xC8, 0x57, 0x11, 0x90, 0x33}, Bytes{0x40, 0x06, 1, 2, 3}}) {
        RtuHearing hearing(Talk::served());
        EXPECT_THAT(heard(hearing, joined({noise, kWriteBeef})), IsEmpty()) << "glued to it";
    }
}

TEST(RtuHearing, P2ASilenceEndsNoFrameThatIsToGoOn) {
    const Bytes head{kOurs, 0x10, 1, 0, 0, 5, 10};
    for (const Bytes& begun : {head, joined({head, {0, 7}}), Bytes{kOther, 0x03, 200, 1, 2, 3}}) {
        RtuHearing hearing(Talk::served());
        EXPECT_THAT(heard(hearing, begun), IsEmpty());
        EXPECT_THAT(heard(hearing, kWriteBeef), IsEmpty());
        EXPECT_THAT(heard(hearing, {0x12, 0x34}), IsEmpty());
        hearing.drop_pending();
        EXPECT_THAT(heard(hearing, {}), IsEmpty());
        EXPECT_THAT(heard(hearing, kWriteBeef), ElementsAre(kOurs));
    }
    RtuHearing hearing(Talk::served());  // the silence was inside: what it begins goes on
    heard(hearing, {0xC8, 0x57, 0x11, 0x90, 0x33});
    EXPECT_THAT(heard(hearing, joined({kWriteBeef, {0x12, 0x34}})), IsEmpty());
}

TEST(RtuHearing, EndsVendorsFunctionsBySilence) {
    const Bytes vendor = encode_adu(kOurs, Bytes{0x65, 1, 2, 3});
    EXPECT_THAT(heard(vendor, false), IsEmpty());
    EXPECT_THAT(heard(vendor), ElementsAre(kOurs));
}

TEST(RtuHearing, GivesUpAFrameThatDoesNotGoOnForTheOneBehindIt) {
    RtuHearing hearing(Talk::served());
    const Bytes begun{kOther, 0x03, 0x40, 1, 2, 3};
    EXPECT_THAT(heard(hearing, joined({begun, kRequest})), IsEmpty());
    hearing.drop_pending();
    EXPECT_THAT(heard(hearing, {}), ElementsAre(kOurs));
    EXPECT_EQ(hearing.pending(), 0u);
}

TEST(RtuHearing, KeepsLittleWhateverComes) {
    RtuHearing hearing(Talk::served());
    std::mt19937 random(14);
    std::size_t most = 0;
    std::size_t frames = 0;
    for (int i = 0; i < 20'000; ++i) {
        Bytes bytes;
        for (unsigned n = random() % 40; n > 0; --n)
            bytes.push_back(static_cast<std::uint8_t>(random() % (i % 2 == 0 ? 256 : 32)));
        frames += heard(hearing, bytes, random() % 4 == 0).size();
        most = std::max(most, hearing.pending());
    }
    EXPECT_LE(most, 260u);
    EXPECT_LT(frames, 40u);  // one start in 65536 fits its CRC
}

}  // namespace
}  // namespace panelgate::serial_server::test::rtu_hearing_test
