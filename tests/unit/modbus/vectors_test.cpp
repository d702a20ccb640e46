#include "support/vectors.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::modbus::vectors_test {
namespace {

std::vector<Vector> vectors_where(bool (*wanted)(const Vector&)) {
    std::vector<Vector> chosen;
    for (Vector& vector : load_vectors(TEST_DATA "/vectors.yaml")) {
        if (wanted(vector)) chosen.push_back(std::move(vector));
    }
    return chosen;
}
bool is_exchange(const Vector& v) { return v.is_rtu() && v.kind() != "negative"; }
bool is_negative(const Vector& v) { return v.kind() == "negative"; }
bool is_tcp(const Vector& v) { return !v.is_rtu(); }

std::string name_of(const ::testing::TestParamInfo<Vector>& info) { return info.param.name(); }

/// Strips address and CRC, whatever the CRC.
Bytes pdu_of(const Bytes& adu) { return Bytes(adu.begin() + 1, adu.end() - 2); }

/// The frame with the right CRC: as printed, or as corrected where the print is wrong.
Bytes good_frame(const Vector& v, const std::string& key) {
    return v.crc_ok(key + "_crc_ok") ? *v.bytes(key) : *v.bytes(key + "_corrected");
}

std::vector<MbapEvent> events_of(ByteView bytes) {
    MbapFramer framer;
    framer.feed(bytes);
    std::vector<MbapEvent> events;
    while (std::optional<MbapEvent> event = framer.next()) events.push_back(std::move(*event));
    return events;
}

class ExchangeVector : public ::testing::TestWithParam<Vector> {};

/// CRC, PDU and, over TCP, the ADU.
TEST_P(ExchangeVector, IsEncodedAsTheManualPrintsByteForByte) {
    const Vector& v = GetParam();
    for (const std::string key : {"request", "response"}) {
        const std::optional<Bytes> printed = v.bytes(key);
        if (!printed) continue;
        EXPECT_EQ(crc_ok(*printed), v.crc_ok(key + "_crc_ok")) << key;
        const Bytes good = good_frame(v, key);
        EXPECT_TRUE(crc_ok(good)) << key;
        EXPECT_EQ(pdu_of(good), pdu_of(*printed)) << key;
        EXPECT_EQ(encode_adu(good[0], pdu_of(good)), good) << key;
        const std::optional<Bytes> tcp = v.bytes("tcp_" + key);
        if (!tcp) continue;
        const std::vector<MbapEvent> events = events_of(*tcp);
        ASSERT_EQ(events.size(), 1u) << key;
        const Adu& adu = std::get<Adu>(events[0]);
        EXPECT_EQ(adu, (Adu{adu.transaction, printed->front(), pdu_of(*printed)})) << key;
        EXPECT_EQ(encode_mbap(adu.transaction, adu.unit, adu.pdu), *tcp) << key;
    }
}

TEST_P(ExchangeVector, HasTheLengthsOfTheTable) {
    const Vector& v = GetParam();
    if (const auto length = v.number("request_len")) {
        EXPECT_EQ(v.bytes("request")->size(), *length);
    }
    if (const auto length = v.number("response_len")) {
        EXPECT_EQ(v.bytes("response").value_or(Bytes()).size(), *length);
    }
    if (!v.number("request_len") || v.kind() == "broadcast") return;  // part 7 gives no prediction
    EXPECT_EQ(reply_length_from_request(pdu_of(*v.bytes("request"))),
              v.number("expected_len_from_request"));
}

TEST_P(ExchangeVector, HasARequestThatMayBeTransmittedAndAReplyThatAnswers) {
    const Vector& v = GetParam();
    const Bytes request = pdu_of(*v.bytes("request"));
    const bool beyond_all = v.name() == "cp2e_fc01_w0_00_to_w127_14";  // 256 data bytes
    const bool beyond_tcp = beyond_all || v.name() == "exc_03_read_126_registers" ||
                            v.name() == "gt_fc01_gr20_2040bits" ||
                            v.name() == "gt_fc03_gdt108_127words";
    EXPECT_EQ(check_request(request, QuantityCheck::fit).has_value(), !beyond_tcp);
    EXPECT_EQ(check_request(request, QuantityCheck::wide).has_value(), !beyond_all);
    if (!v.bytes("response")) return;
    const Bytes reply = pdu_of(*v.bytes("response"));
    EXPECT_TRUE(answers(request, reply));
    EXPECT_EQ(exception_of(reply).has_value(), (reply[0] & kExceptionBit) != 0);
}

/// Finds the reply to this request on an ASCII line.
std::optional<Bytes> found_in_ascii(const Bytes& request, const Bytes& wire) {
    ReplyFramer framer(request[0], pdu_of(request), {}, ReplyFramer::Ends::told);
    AsciiTranscript transcript(HexDigits::upper_only);
    transcript.feed({}, wire);
    std::optional<Bytes> reply;
    while (const auto piece = transcript.next()) {
        EXPECT_EQ(framer.feed(piece->bytes), std::nullopt);
        if (piece->end == AsciiTranscript::Piece::End::none) continue;
        const auto found = framer.on_end(piece->end == AsciiTranscript::Piece::End::frame);
        if (found) reply = found;
    }
    return reply;
}

TEST_P(ExchangeVector, IsEquivalentInAscii) {
    const Vector& v = GetParam();
    const Bytes request = good_frame(v, "request");
    AsciiTranscript transcript(HexDigits::upper_only);
    transcript.feed({}, to_ascii(encode_adu(request[0], pdu_of(request))));
    const auto piece = transcript.next();
    ASSERT_TRUE(piece);
    EXPECT_EQ(piece->bytes, encode_adu(request[0], pdu_of(request)));
    EXPECT_EQ(piece->end, AsciiTranscript::Piece::End::frame);
    if (!v.bytes("response")) return;
    const Bytes reply = good_frame(v, "response");
    const Bytes wire = encode_ascii(reply[0], pdu_of(reply));
    EXPECT_EQ(found_in_ascii(request, wire), pdu_of(reply));
    for (std::size_t i = 0; i < wire.size(); ++i) {
        Bytes damaged = wire;
        damaged[i] ^= 1;
        EXPECT_EQ(found_in_ascii(request, damaged), std::nullopt) << i;
        Bytes shorter = wire;
        shorter.erase(shorter.begin() + static_cast<std::ptrdiff_t>(i));
        EXPECT_EQ(found_in_ascii(request, shorter), std::nullopt) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Vectors, ExchangeVector, ::testing::ValuesIn(vectors_where(is_exchange)),
                         name_of);

class NegativeVector : public ::testing::TestWithParam<Vector> {};

TEST_P(NegativeVector, IsNotAGoodReply) {
    const Vector& v = GetParam();
    const Bytes request = *v.bytes("request");
    const Bytes heard = *v.bytes("response");
    ASSERT_TRUE(crc_ok(request));
    if (v.name() == "neg_noise_prefix") {
        EXPECT_FALSE(crc_ok(heard)) << "noise is part of the frame by the silence rule";
        EXPECT_TRUE(crc_ok(ByteView(heard).subspan(2)));
        return;
    }
    EXPECT_EQ(crc_ok(heard), v.crc_ok("response_crc_ok"));
    const bool same_station = heard[0] == request[0];
    EXPECT_FALSE(crc_ok(heard) && same_station && answers(pdu_of(request), pdu_of(heard)));
    if (!crc_ok(heard)) return;
    EXPECT_EQ(found_in_ascii(request, encode_ascii(heard[0], pdu_of(heard))), std::nullopt);
}

INSTANTIATE_TEST_SUITE_P(Vectors, NegativeVector, ::testing::ValuesIn(vectors_where(is_negative)),
                         name_of);

class TcpVector : public ::testing::TestWithParam<Vector> {};

/// Reply of framing and check_request alone: none, or exceptions 01 and 03. Everything else in the
/// vector is the work of routing, of the queue or of the panel.
TEST_P(TcpVector, IsFramedAndJudgedAsTheTableSays) {
    const Vector& v = GetParam();
    const std::vector<MbapEvent> events = events_of(*v.bytes("request"));
    const bool broken = v.name().starts_with("tcp_length_");
    if (broken || v.name() == "tcp_protocol_id_nonzero") {
        ASSERT_EQ(events.size(), 1u);
        EXPECT_EQ(std::holds_alternative<Broken>(events[0]), broken);
        EXPECT_EQ(std::holds_alternative<SkippedProtocol>(events[0]), !broken);
        return;
    }
    ASSERT_EQ(events.size(), v.name() == "tcp_two_adus_one_segment" ? 2u : 1u);
    const Adu& adu = std::get<Adu>(events[0]);
    const std::optional<Bytes> answer = v.bytes("response");
    const bool malformed = v.name() == "tcp_short_pdu" || v.name() == "tcp_long_pdu" ||
                           v.name() == "tcp_byte_count_mismatch";
    const bool denied = v.name() == "tcp_function_zero" || v.name() == "tcp_function_high_bit";
    const Result<void> verdict = check_request(adu.pdu);
    ASSERT_EQ(verdict.has_value(), !malformed && !denied);
    if (verdict) return;
    EXPECT_EQ(verdict.error(), denied ? Fault::denied : Fault::malformed);
    const Bytes exception = encode_exception(adu.pdu[0], to_exception(verdict.error()));
    EXPECT_EQ(encode_mbap(adu.transaction, adu.unit, exception), answer);
}

TEST_P(TcpVector, HasRepliesThatAnswerTheirRequestsEvenIfTheyAreForged) {
    const Vector& v = GetParam();
    if (!v.bytes("response")) return;
    const std::vector<MbapEvent> requests = events_of(*v.bytes("request"));
    const std::vector<MbapEvent> replies = events_of(*v.bytes("response"));
    ASSERT_EQ(requests.size(), replies.size());
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const Adu& request = std::get<Adu>(requests[i]);
        const Adu& reply = std::get<Adu>(replies[i]);
        EXPECT_EQ(reply.transaction, request.transaction);
        EXPECT_EQ(reply.unit, request.unit);
        EXPECT_TRUE(answers(request.pdu, reply.pdu));
        if (!v.name().ends_with("_synthetic_reply")) continue;
        ASSERT_TRUE(is_broadcastable(request.pdu[0]));
        EXPECT_EQ(reply.pdu, normal_write_reply(request.pdu));
    }
}

INSTANTIATE_TEST_SUITE_P(Vectors, TcpVector, ::testing::ValuesIn(vectors_where(is_tcp)), name_of);

TEST(Vectors, AreAllThere) {
    EXPECT_EQ(vectors_where(is_exchange).size() + vectors_where(is_negative).size(), 79u);
    EXPECT_EQ(vectors_where(is_negative).size(), 7u);
    EXPECT_EQ(vectors_where(is_tcp).size(), 20u);
}

}  // namespace
}  // namespace panelgate::modbus::vectors_test
