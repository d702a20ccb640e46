#include "mbap.hpp"

#include <gmock/gmock.h>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::line::mbap_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const Bytes kRead{0x03, 0x00, 0x64, 0x00, 0x01};
const Bytes kReply{0x03, 0x02, 0x00, 0xD7};

Bytes adu(std::uint16_t id, std::uint8_t unit, const Bytes& pdu) {
    Bytes made{static_cast<std::uint8_t>(id >> 8),
               static_cast<std::uint8_t>(id),
               0,
               0,
               0,
               static_cast<std::uint8_t>(pdu.size() + 1),
               unit};
    made.insert(made.end(), pdu.begin(), pdu.end());
    return made;
}

TEST(Mbap, ARequestHasANewTransactionIdAndNoCrc) {
    Mbap mbap;
    EXPECT_THAT(mbap.request(modbus::encode_adu(5, kRead)),
                ElementsAre(0, 1, 0, 0, 0, 6, 5, 3, 0, 0x64, 0, 1));
    EXPECT_EQ(mbap.request(modbus::encode_adu(5, kRead)), adu(2, 5, kRead));
}

TEST(Mbap, AReplyIsAFrameHoweverItsBytesCome) {
    Mbap mbap;
    mbap.request(modbus::encode_adu(5, kRead));
    const Bytes bytes = adu(1, 5, kReply);
    for (std::size_t i = 0; i + 1 < bytes.size(); ++i)
        EXPECT_THAT(mbap.replies(ByteView(bytes).subspan(i, 1)).value(), IsEmpty());
    EXPECT_EQ(mbap.replies(ByteView(bytes).last(1)).value(), modbus::encode_adu(5, kReply));
}

TEST(Mbap, LateForeignRepeatedAndUnaskedRepliesAreLeftOut) {
    Mbap mbap;
    EXPECT_THAT(mbap.replies(adu(0, 5, kReply)).value(), IsEmpty()) << "nothing was asked";
    mbap.request(modbus::encode_adu(5, kRead));
    mbap.request(modbus::encode_adu(6, kRead));
    Bytes all = adu(1, 5, kReply);  // of the request before
    for (const Bytes& one : {adu(99, 6, kReply), adu(2, 6, kReply), adu(2, 6, kReply)})
        all.insert(all.end(), one.begin(), one.end());
    EXPECT_EQ(mbap.replies(all).value(), modbus::encode_adu(6, kReply));
}

TEST(Mbap, AReplyOfAnotherUnitIsThatUnitsAndTheOneAskedMayStillAnswer) {
    Mbap mbap;
    mbap.request(modbus::encode_adu(5, kRead));
    EXPECT_EQ(mbap.replies(adu(1, 6, kReply)).value(), modbus::encode_adu(6, kReply));
    EXPECT_EQ(mbap.replies(adu(1, 5, kReply)).value(), modbus::encode_adu(5, kReply));
}

TEST(Mbap, AGatewaysOwnExceptionsAreSilence) {
    Mbap mbap;
    std::uint16_t id = 0;
    for (const Bytes& exception : {Bytes{0x83, 0x0A}, Bytes{0x83, 0x0B}}) {
        mbap.request(modbus::encode_adu(5, kRead));
        EXPECT_THAT(mbap.replies(adu(++id, 5, exception)).value(), IsEmpty());
    }
    mbap.request(modbus::encode_adu(5, kRead));
    EXPECT_EQ(mbap.replies(adu(3, 5, Bytes{0x83, 2})).value(),
              modbus::encode_adu(5, Bytes{0x83, 2}));
}

TEST(Mbap, ABroadcastHasNoReply) {
    Mbap mbap;
    const Bytes write{0x06, 0, 1, 0, 2};
    mbap.request(modbus::encode_adu(modbus::kBroadcast, write));
    EXPECT_THAT(mbap.replies(adu(1, 0, write)).value(), IsEmpty());
}

TEST(Mbap, WhatIsNoModbusTcpEndsTheConnection) {
    const Bytes wrong[] = {{0, 1, 0, 0, 0, 1, 5, 3, 2},    // too short
                           {0, 1, 0, 0, 0, 255, 5, 3, 2},  // too long
                           modbus::encode_adu(5, Bytes{3, 2, 0, 1, 2, 3})};
    for (const Bytes& bytes : wrong) {
        Mbap mbap;
        mbap.request(modbus::encode_adu(5, kRead));
        EXPECT_FALSE(mbap.replies(bytes));
    }
}

TEST(Mbap, ANewConnectionForgetsHalfAReplyAndTheRequest) {
    Mbap mbap;
    mbap.request(modbus::encode_adu(5, kRead));
    mbap.replies(ByteView(adu(1, 5, kReply)).first(8));
    mbap.restart();
    EXPECT_THAT(mbap.replies(adu(1, 5, kReply)).value(), IsEmpty());
}

}  // namespace
}  // namespace panelgate::line::mbap_test
