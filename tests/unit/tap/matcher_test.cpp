#include "panelgate/tap/matcher.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::tap::test::matcher_test {
namespace {

using testing::ElementsAre;

constexpr SerialFormat kFormat{38400, 8, Parity::none, 1};

/// PDUs that scripts call by a name.
constexpr std::pair<std::string_view, std::string_view> kNames[] = {
    {"read", "0300640001"},
    {"other", "0300c80001"},
    {"value", "03020005"},
    {"write", "0600640007"},  // its reply is the same
};

std::string name_of(const Bytes& pdu) {
    std::string text = to_hex(pdu, "");
    for (const auto& [name, hex] : kNames) {
        if (text == hex) return std::string(name);
    }
    return text;
}

/// Returns what goes over the wire. "31:read" is a frame of station 31, with a PDU's name or its
/// hex digits; "31:read!" has a wrong bit; "~ff00" are these bytes; "+" joins.
Bytes bytes_of(std::string_view text) {
    if (const auto plus = text.find('+'); plus != std::string_view::npos) {
        Bytes joined = bytes_of(text.substr(0, plus));
        const Bytes more = bytes_of(text.substr(plus + 1));
        joined.insert(joined.end(), more.begin(), more.end());
        return joined;
    }
    if (text.empty()) return {};
    if (text.front() == '~') return *from_hex(text.substr(1));
    const bool damaged = text.back() == '!';
    if (damaged) text.remove_suffix(1);
    const auto colon = text.find(':');
    std::string_view pdu = text.substr(colon + 1);
    for (const auto& [name, hex] : kNames) {
        if (pdu == name) pdu = hex;
    }
    const int station = std::stoi(std::string(text.substr(0, colon)));
    Bytes adu = modbus::encode_adu(static_cast<std::uint8_t>(station), *from_hex(pdu));
    if (damaged) adu[4] ^= 0x10;
    return adu;
}

/// A line that the tap listens to: who sends what, when.
class Line {
  public:
    /// Steps apart by commas: a pause in milliseconds and what is heard after it, a frame byte by
    /// byte, and all in one chunk if a "+", "~" or "!" is in it; or "silence", or "lost".
    void play(std::string_view script) {
        std::istringstream steps{std::string(script)};
        std::string what;
        for (int pause = 0; steps >> pause >> what;) {
            if (what.back() == ',') what.pop_back();
            if (what == "silence") {
                wait(1ms * pause);
            } else if (what == "lost") {
                matcher_.on_line_down(now_);
                collect();
            } else if (what.find_first_of("+~!") == std::string::npos) {
                say(1ms * pause, what);
            } else {
                hear(1ms * pause, bytes_of(what));
            }
        }
    }
    /// A good frame begins this long after the last byte, and is heard byte by byte.
    void say(Duration pause, std::string_view frame) {
        const Bytes adu = bytes_of(frame);
        wait(pause);
        for (const std::uint8_t byte : adu) {
            now_ += character_time(kFormat);
            matcher_.on_rx(now_, ByteView(&byte, 1));
        }
        collect();
    }
    /// All of it in one chunk.
    void hear(Duration pause, const Bytes& bytes) {
        wait(pause + wire_time(kFormat, bytes.size()));
        matcher_.on_rx(now_, bytes);
        collect();
    }
    void wait(Duration pause) {
        const TimePoint until = now_ + pause;
        for (auto next = matcher_.next_deadline(); next && *next <= until;
             next = matcher_.next_deadline()) {
            now_ = std::max(now_, *next);
            matcher_.on_deadline(now_);
            collect();
        }
        now_ = until;
    }
    /// The transactions since the last call: "31: read -> value; 5: write -> silent ?".
    std::string told() { return std::exchange(told_, {}); }
    std::vector<Transaction> transactions;
    std::vector<FrameKind> frames;

  private:
    void collect() {
        while (const auto event = matcher_.poll_action()) {
            if (const auto* frame = std::get_if<Frame>(&*event)) {
                frames.push_back(frame->kind);
                continue;
            }
            const auto& one = std::get<Transaction>(*event);
            transactions.push_back(one);
            told_ += (told_.empty() ? "" : "; ") + words(one);
        }
    }
    static std::string words(const Transaction& one) {
        static constexpr const char* kEnds[] = {"", "silent", "damaged", "unasked", "wrong"};
        std::string text = std::to_string(one.station) + ": " + name_of(one.request) + " -> ";
        text += one.end == End::answered ? name_of(one.reply)
                                         : kEnds[static_cast<std::size_t>(one.end)];
        return one.doubtful ? text + " ?" : text;
    }

    Matcher matcher_{Settings{kFormat}};
    TimePoint now_{1h};
    std::string told_;
};

struct Row {
    const char* heard;
    const char* told;
};

/// The line is known to return no requests: see expect().
constexpr Row kPairs[] = {
    // A request is open until its reply comes, normal or an exception.
    {"10 31:read", ""},
    {"10 31:read, 3 31:value", "31: read -> value"},
    {"10 31:read, 3 31:8302", "31: read -> 8302"},
    // Writes of several items have short replies.
    {"10 5:100064000204000a0102, 3 5:1000640002, 3 5:0f0013000a02cd01, 3 5:0f0013000a",
     "5: 100064000204000a0102 -> 1000640002; 5: 0f0013000a02cd01 -> 0f0013000a"},
    // The reply to other writes equals the request.
    {"10 5:write, 3 5:write, 50 5:read", "5: write -> write"},
    {"10 5:0500b4ff00, 3 5:0500b4ff00, 50 5:read", "5: 0500b4ff00 -> 0500b4ff00"},
    {"10 5:16000400f20025, 3 5:16000400f20025, 50 5:read", "5: 16000400f20025 -> 16000400f20025"},
    {"10 5:0800001234, 3 5:0800001234, 50 5:read", "5: 0800001234 -> 0800001234"},
    // A broadcast has no reply, nor has 08/0004.
    {"10 0:write", "0: write -> unasked"},
    {"10 5:0800040000", "5: 0800040000 -> unasked"},
    // An adapter joins frames.
    {"10 31:read+31:value+5:write+5:write+0:write+31:read",
     "31: read -> value; 5: write -> write; 0: write -> unasked"},
    // This CRC ends with 00: without that byte the frame is a reply of one register.
    {"10 4:0302a6000f, 3 4:831e", "4: 0302a6000f -> 831e"},
    // Functions without a length end by the silence behind them.
    {"10 5:410102, 3 5:41aabbcc, 10 31:read, 3 31:value",
     "5: 410102 -> 41aabbcc; 31: read -> value"},
    {"10 5:410102+5:41aabbcc, 1000 silence", "5: 410102 -> 41aabbcc"},
};

constexpr Row kThreats[] = {
    // T1: silence is told when the next request comes, or after a while.
    {"10 31:read, 500 5:read", "31: read -> silent"},
    {"10 31:read, 500 5:read, 3 5:value", "31: read -> silent; 5: read -> value"},
    {"10 31:read, 9000 silence", ""},
    {"10 31:read, 11000 silence", "31: read -> silent"},
    // T1: a write that comes again may be asked again, if a master may have given up.
    {"10 5:write, 40 5:write, 500 5:read", "5: write -> write"},
    {"10 5:write, 150 5:write, 500 5:read", "5: write -> write ?"},
    {"10 5:write, 150 5:write, 5 5:write, 500 5:read", "5: write -> write ?; 5: write -> silent ?"},
    {"10 5:write, 1100 5:write, 5 5:write", "5: write -> silent; 5: write -> write ?"},
    // ... and so may a read that looks like the reply to a read: 24 coils, from 768.
    {"10 5:0101000018, 6 5:0103000018, 20 5:read", "5: 0101000018 -> 0103000018"},
    {"10 5:0101000018, 150 5:0103000018, 6 5:0103ffffff", "5: 0101000018 -> 0103000018 ?"},
    {"10 5:0101000018, 1100 5:0103000018, 6 5:0103ffffff",
     "5: 0101000018 -> silent; 5: 0103000018 -> 0103ffffff ?"},
    {"10 5:0103000018, 150 5:0103000018, 6 5:0103ffffff",
     "5: 0103000018 -> silent; 5: 0103000018 -> 0103ffffff"},
    // T2: a late reply.
    {"10 31:read, 200 31:other, 30 31:value", "31: read -> silent; 31: other -> value ?"},
    {"10 31:read, 200 31:other, 30 31:8302", "31: read -> silent; 31: other -> 8302 ?"},
    {"10 31:read, 5100 31:other, 30 31:value", "31: read -> silent; 31: other -> value"},
    {"10 5:write, 200 31:read, 3 5:write, 3 31:value", "5: write -> silent; 31: read -> value"},
    {"10 31:read, 200 31:other, 3 31:03020064, 3 31:030200c8, 10 31:read, 3 31:03020065",
     "31: read -> silent; 31: other -> 03020064 ?; 31: read -> 03020065"},
    // T3: a damaged reply does not come later. Bytes that belong to no frame.
    {"10 31:read, 3 31:value!, 500 31:other, 3 31:value",
     "31: read -> damaged; 31: other -> value"},
    {"10 ~ff00+31:read+~55+31:value+~00fe1f, 20 +5:read, 3 +5:value, 1000 silence",
     "31: read -> value; 5: read -> value"},
    // T3: damage that may have hidden a request.
    {"10 31:read, 20 ~450031, 6 31:value, 300 silence", "31: read -> value"},
    {"10 31:read, 20 ~45003142, 6 31:value, 300 silence", "31: read -> value ?"},
    {"10 5:write!, 3 5:write, 10 31:read", "5: write -> silent ?"},
    {"10 5:write!, 3 5:write, 10 5:write, 10 31:read", "5: write -> write ?"},
    // T6: a read that comes back at once is no request, and no reply to itself.
    {"10 31:read, 1 31:read, 3 31:value", "31: read -> value"},
    {"10 5:0103000018, 1 5:0103000018, 3 5:0103fffffe", "5: 0103000018 -> 0103fffffe"},
    // ... and writes on such a line are in doubt, answered or not.
    {"10 31:read, 1 31:read, 3 31:value, 9 5:write, 1 5:write, 3 5:write, 9 5:write, 1 5:write, "
     "200 5:read",
     "31: read -> value; 5: write -> write ?; 5: write -> silent ?"},
    {"0 lost, 10 5:write, 3 5:write", "5: write -> write ?"},
    // T10: the reply may follow these exceptions.
    {"10 31:read, 3 31:8305, 10 31:other, 3 31:value", "31: read -> 8305; 31: other -> value ?"},
    {"10 31:read, 3 31:8302, 10 31:other, 3 31:value", "31: read -> 8302; 31: other -> value"},
    {"10 31:read, 200 31:other, 3 31:8305, 10 31:other, 3 31:value",
     "31: read -> silent; 31: other -> 8305 ?; 31: other -> value ?"},
    // T11: the reply may be to a broadcast; not another place, later, or behind another reply.
    {"10 9:read, 3 9:value, 9 0:100064000102000a, 280 9:100064000102000b, 8 9:1000640001",
     "9: read -> value; 0: 100064000102000a -> unasked; 9: 100064000102000b -> 1000640001 ?"},
    {"10 9:read, 3 9:value, 9 0:100064000102000a, 280 9:100066000102000b, 8 9:1000660001",
     "9: read -> value; 0: 100064000102000a -> unasked; 9: 100066000102000b -> 1000660001"},
    {"10 9:read, 3 9:value, 9 0:0600640007, 5100 9:write, 8 9:write",
     "9: read -> value; 0: write -> unasked; 9: write -> write"},
    {"10 9:read, 3 9:value, 9 0:write, 9 9:read, 3 9:value, 9 9:write, 8 9:write",
     "9: read -> value; 0: write -> unasked; 9: read -> value; 9: write -> write"},
    // T12: the last reply once more is no reply; equal values of two places are.
    {"10 31:read, 3 31:value, 1 31:value, 9 31:other, 3 31:value",
     "31: read -> value; 31: other -> value"},
    // T13: a good frame of another function, or of another length.
    {"10 31:read, 3 31:04020005, 10 5:read, 3 5:value", "31: read -> wrong; 5: read -> value"},
    {"10 31:read, 3 31:030400050006, 10 5:read, 3 5:value", "31: read -> wrong; 5: read -> value"},
};

void expect(const std::string& heard, const std::string& told) {
    Line line;
    line.play("10 9:read, 3 9:value");  // the line returns no requests
    line.told();
    line.play(heard);
    EXPECT_EQ(line.told(), told) << heard;
}

TEST(Matcher, TellsWhatBelongsTogether) {
    for (const Row& row : kPairs) expect(row.heard, row.told);
    // T4: a hole in a reply, and a frame inside a reply.
    const std::string reply = to_hex(bytes_of("31:value"), "");
    expect("10 31:read, 3 ~" + reply.substr(0, 6) + ", 50 ~" + reply.substr(6),
           "31: read -> value");
    const std::string values = "0308" + to_hex(bytes_of("5:write"), "");
    expect("10 31:0300640004, 3 +31:" + values, "31: 0300640004 -> " + values);
}

TEST(Matcher, DoubtsWhatMayBelongToAnotherRequest) {
    for (const Row& row : kThreats) expect(row.heard, row.told);
}

TEST(Matcher, TellsWhenItWas) {
    Line line;
    line.play("10 31:read, 3 31:value");
    const Transaction& made = line.transactions.at(0);
    EXPECT_EQ(made.replied - made.sent, 3ms);
    EXPECT_EQ(made.sampled, made.asked);
    EXPECT_THAT(line.frames, ElementsAre(FrameKind::heard_request, FrameKind::reply));
    Line again;
    again.play("10 31:read, 200 31:read, 3 31:value");
    EXPECT_EQ(again.told(), "31: read -> silent; 31: read -> value");
    EXPECT_EQ(again.transactions[1].sampled, again.transactions[0].asked) << "not newer than that";
}

TEST(Matcher, ListensOnBehindAHeaderThatPromisesTooMuch) {
    Line line;
    line.play("10 31:read, 3 ~1f1000000064c8010203");  // would take 209 bytes
    for (int i = 0; i < 20; ++i) line.play("4 5:read, 3 5:value");
    line.wait(1s);
    EXPECT_EQ(line.transactions.front().end, End::damaged);
    EXPECT_EQ(line.transactions.size(), 21u);
}

/// T2: a read is not answered, and the panel goes on as ever, or is one reply behind.
constexpr const char* kOneBehind =
    "10 31:read, 3 31:03020064, 10 31:other, 3 31:030200c8, 10 31:read, 200 31:other, "
    "3 31:03020064, 10 31:read, 3 31:030200c8, 10 31:other, 3 31:03020064";

TEST(Matcher, BelievesNoReplyWhileOneFewerHasComeThanWasAskedFor) {
    const std::string doubt =
        "31: read -> 03020064; 31: other -> 030200c8; 31: read -> silent; "
        "31: other -> 03020064 ?; 31: read -> 030200c8 ?; 31: other -> 03020064 ?";
    Line line;
    line.play(kOneBehind);
    EXPECT_EQ(line.told(), doubt);
    // A reply of another length: the station serves in turn, and no reply is owed any more.
    line.play("10 31:0300640002, 3 31:030400640065, 10 31:read, 3 31:03020064");
    EXPECT_EQ(line.told(), "31: 0300640002 -> 030400640065; 31: read -> 03020064");
    // Or the window of the request without a reply is over.
    line.play(kOneBehind);
    EXPECT_EQ(line.told(), doubt);
    line.wait(5s);
    line.play("10 31:read, 3 31:03020064, 10 31:other, 3 31:030200c8");
    EXPECT_EQ(line.told(), "31: read -> 03020064; 31: other -> 030200c8");
}

TEST(Matcher, DistinguishesALateReplyAndADuplicateFromOthers) {
    Line line;
    line.play("10 31:read, 200 31:0300c80002, 3 31:value, 3 31:030400050006, 3 31:030400050006");
    line.play("3 7:03020001, 1000 silence");  // it could go on as a request
    EXPECT_EQ(line.told(), "31: read -> silent; 31: 0300c80002 -> 030400050006");
    EXPECT_THAT(line.frames,
                ElementsAre(FrameKind::heard_request, FrameKind::heard_request, FrameKind::late,
                            FrameKind::reply, FrameKind::copy, FrameKind::foreign));
}

/// T8: over two connections the order of the replies is unknown.
TEST(Matcher, DoubtsTheOpenRequestWhenTheLineIsLost) {
    Line line;
    line.play("10 31:read, 0 lost, 3 31:other, 3 31:value, 9 31:0300c80002, 3 31:030400010002");
    line.play("9 31:other, 3 31:value");
    EXPECT_EQ(line.told(),
              "31: read -> silent ?; 31: other -> value ?; 31: 0300c80002 -> 030400010002; "
              "31: other -> value");
}

TEST(Matcher, HoldsLittleOfALineThatBabbles) {
    Line line;
    line.hear(10ms, Bytes(5000, 0x11));  // station 17, function 17: a request's length is known
    line.wait(1s);
    EXPECT_GE(std::ranges::count(line.frames, FrameKind::damaged), 9);
    EXPECT_EQ(line.told(), "");
}

}  // namespace
}  // namespace panelgate::tap::test::matcher_test
