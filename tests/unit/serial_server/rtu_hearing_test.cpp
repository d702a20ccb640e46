#include "hearing.hpp"

#include <gmock/gmock.h>

#include <random>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::rtu_hearing_test {
namespace {

using modbus::encode_adu;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

const Bytes kRequest = encode_adu(kOurs, kReadOne);

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

Bytes reply_with(const Bytes& data) {
    Bytes pdu{0x03, static_cast<std::uint8_t>(data.size())};
    pdu.insert(pdu.end(), data.begin(), data.end());
    return encode_adu(kOther, pdu);
}

TEST(RtuHearing, FindsARequestWithoutASilence) {
    RtuHearing hearing(Talk::served());
    EXPECT_THAT(heard(hearing, kRequest, false), ElementsAre(kOurs));
}

TEST(RtuHearing, FindsARequestInAnyPieces) {
    RtuHearing hearing(Talk::served());
    std::vector<int> all;
    for (const std::uint8_t byte : kRequest) {
        for (const int station : heard(hearing, {byte})) all.push_back(station);
    }
    EXPECT_THAT(all, ElementsAre(kOurs));
}

TEST(RtuHearing, FindsARequestBehindAGlitch) {
    for (int glitch = 0; glitch < 256; ++glitch) {
        RtuHearing hearing(Talk::served());
        const Bytes noise{static_cast<std::uint8_t>(glitch)};
        EXPECT_THAT(heard(hearing, joined({noise, kRequest})), ElementsAre(kOurs)) << glitch;
    }
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
    const Bytes exchange = joined({encode_adu(kOther, kReadOne), reply_with({1, 2}), kRequest});
    EXPECT_THAT(heard(hearing, exchange, false), ElementsAre(kOther, kOther, kOurs));
    EXPECT_EQ(hearing.take_faults(), 0u);
}

TEST(RtuHearing, FindsNoRequestInAnotherUnitsData) {
    RtuHearing hearing(Talk::served());
    EXPECT_THAT(heard(hearing, reply_with(kRequest), false), ElementsAre(kOther));
    for (std::size_t piece = 1; piece < 10; ++piece) {
        const Bytes reply = reply_with(kRequest);
        std::vector<int> all;
        for (std::size_t at = 0; at < reply.size(); at += piece) {
            const auto end = std::min(at + piece, reply.size());
            for (const int station : heard(hearing, Bytes(reply.begin() + static_cast<long>(at),
                                                          reply.begin() + static_cast<long>(end))))
                all.push_back(station);
        }
        EXPECT_THAT(all, ElementsAre(kOther)) << piece;
    }
}

TEST(RtuHearing, FindsNoRequestInDamagedDataThatGoesOn) {
    RtuHearing hearing(Talk::served());
    Bytes reply = reply_with(joined({kRequest, {1, 2}}));
    reply[2] = 2;
    EXPECT_THAT(heard(hearing, reply), IsEmpty());
}

TEST(RtuHearing, P2TakesNoWriteOutOfADamagedOne) {
    const Bytes write = encode_adu(kOurs, Bytes{0x06, 0, 0, 0xBE, 0xEF});
    const Bytes read = encode_adu(kOther, kReadOne);
    for (const Bytes& data : {write, joined({{0, 7}, write}), joined({write, {0, 7}}),
                              joined({read, write}), joined({write, write})}) {
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

TEST(RtuHearing, TakesAWriteBehindAGlitch) {
    const Bytes write = encode_adu(kOurs, Bytes{0x06, 0, 0, 0xBE, 0xEF});
    for (const Bytes& glitch : {Bytes{0xFF}, Bytes{0, 0xFF}, Bytes{0xF0, 0xFF, 0xFF}}) {
        RtuHearing hearing(Talk::served());
        EXPECT_THAT(heard(hearing, joined({glitch, write})), ElementsAre(kOurs));
    }
}

TEST(RtuHearing, HearsExceptionsOfOtherStations) {
    RtuHearing hearing(Talk::served());
    const Bytes no = encode_adu(kOther, Bytes{0x83, 0x02});
    EXPECT_THAT(heard(hearing, joined({encode_adu(kOther, kReadOne), no, kRequest})),
                ElementsAre(kOther, kOther, kOurs));
}

TEST(RtuHearing, EndsVendorsFunctionsBySilence) {
    RtuHearing hearing(Talk::served());
    const Bytes vendor = encode_adu(kOurs, Bytes{0x65, 1, 2, 3});
    EXPECT_THAT(heard(hearing, vendor, false), IsEmpty());
    hearing.on_silence();
    const auto adu = hearing.next();
    ASSERT_TRUE(adu);
    EXPECT_EQ(adu->pdu, (Bytes{0x65, 1, 2, 3}));
}

TEST(RtuHearing, HearsARequestBehindHalfAFrame) {
    RtuHearing hearing(Talk::served());
    const Bytes half(kRequest.begin(), kRequest.begin() + 5);
    EXPECT_THAT(heard(hearing, joined({half, kRequest})), ElementsAre(kOurs));
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
    int frames = 0;
    for (int i = 0; i < 20'000; ++i) {
        Bytes bytes;
        for (unsigned n = random() % 40; n > 0; --n)
            bytes.push_back(static_cast<std::uint8_t>(random() % (i % 2 == 0 ? 256 : 32)));
        frames += static_cast<int>(heard(hearing, bytes, random() % 4 == 0).size());
        most = std::max(most, hearing.pending());
    }
    EXPECT_LE(most, 260u);
    EXPECT_LT(frames, 40);  // one start in 65536 fits its CRC
}

}  // namespace
}  // namespace panelgate::serial_server::test::rtu_hearing_test
