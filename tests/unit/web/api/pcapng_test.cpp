// The files are compared with the format byte by byte: draft-ietf-opsawg-pcapng.
#include "pcapng.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/trace.hpp"
#include "support/hex.hpp"

namespace panelgate::web::pcapng_test {
namespace {

std::uint32_t number(std::string_view text, std::size_t at, std::size_t bytes = 4) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i)
        value |= std::uint32_t{static_cast<std::uint8_t>(text.at(at + i))} << (8 * i);
    return value;
}

struct Block {
    std::uint32_t type = 0;
    std::string body;
};
/// Fails if a block has a wrong length.
std::vector<Block> blocks_of(std::string_view file) {
    std::vector<Block> blocks;
    while (!file.empty()) {
        const std::uint32_t size = file.size() < 12 ? 0 : number(file, 4);
        EXPECT_EQ(size % 4, 0u);
        if (size < 12 || size > file.size()) {
            ADD_FAILURE() << "a block of " << size << " bytes, " << file.size() << " are left";
            break;
        }
        EXPECT_EQ(number(file, size - 4), size) << "both lengths";
        blocks.push_back({number(file, 0), std::string(file.substr(8, size - 12))});
        file.remove_prefix(size);
    }
    return blocks;
}

using Options = std::vector<std::pair<std::uint32_t, std::string>>;
/// The options after the fixed part; each is padded with zeros, and the last one ends them.
Options options_of(std::string_view body, std::size_t from) {
    Options options;
    for (std::size_t at = from; at + 4 <= body.size();) {
        const std::uint32_t code = number(body, at, 2);
        const std::uint32_t size = number(body, at + 2, 2);
        at += 4;
        if (code == 0) {
            EXPECT_EQ(size, 0u);
            EXPECT_EQ(at, body.size()) << "nothing follows";
            return options;
        }
        options.emplace_back(code, body.substr(at, size));
        for (at += size; at % 4 != 0; ++at) EXPECT_EQ(body.at(at), '\0');
    }
    ADD_FAILURE() << "the options do not end";
    return options;
}

TEST(Pcapng, BeginsWithItsSectionAndOneInterfaceOfMicroseconds) {
    TracePcapng file("1.2", "floor1");
    const auto blocks = blocks_of(file.take());
    ASSERT_EQ(blocks.size(), 2u);
    EXPECT_EQ(blocks[0].type, 0x0A0D0D0Au);
    EXPECT_EQ(blocks[0].body.substr(0, 16),
              std::string("\x4D\x3C\x2B\x1A\x01\0\0\0", 8) + std::string(8, '\xFF'))
        << "little endian, version 1.0, of unknown length";
    EXPECT_EQ(options_of(blocks[0].body, 16), (Options{{4, "panelgate 1.2"}}));
    EXPECT_EQ(blocks[1].type, 1u);
    EXPECT_EQ(number(blocks[1].body, 0, 2), 252u);
    EXPECT_EQ(number(blocks[1].body, 4), 0u) << "no packet is cut";
    EXPECT_EQ(options_of(blocks[1].body, 8), (Options{{2, "floor1"}, {9, "\x06"}}));
}

bus::TraceFrame frame(std::uint64_t sequence, FrameKind kind, const Bytes& bytes) {
    bus::TraceFrame made;
    made.sequence = sequence;
    made.kind = kind;
    made.bytes = bytes;
    made.transaction = 7;
    made.time = WallTime(std::chrono::seconds(1000 + static_cast<int>(sequence)));
    return made;
}

struct Shown {
    std::string way;
    std::string wrapping;  ///< hex, tags up to the end
    Bytes bytes;
    std::vector<std::string> comments;
};
std::vector<Shown> shown(const bus::TracePart& part) {
    TracePcapng file("1.2", "floor1");
    file.add(part);
    std::string text = file.take();
    text += file.finish();
    const auto blocks = blocks_of(text);
    std::vector<Shown> all;
    for (std::size_t i = 2; i < blocks.size(); ++i) {
        const std::string& body = blocks[i].body;
        const std::uint32_t size = number(body, 12);
        const Bytes bytes(body.begin() + 20, body.begin() + 20 + size);
        std::size_t at = 0;  // tags are big endian
        while (bytes.at(at) != 0 || bytes.at(at + 1) != 0)
            at += 4u + bytes.at(at + 2) * 256u + bytes.at(at + 3);
        at += 4;
        Shown one;
        one.wrapping = to_hex(ByteView(bytes).first(at), "");
        one.bytes = Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
        for (const auto& [code, value] : options_of(body, 20 + (size + 3) / 4 * 4)) {
            if (code == 2) one.way = value.front() == 2 ? "out" : "in";
            if (code == 1) one.comments.push_back(value);
        }
        all.push_back(std::move(one));
    }
    return all;
}

TEST(TracePcapng, WrapsAFrameForTheDissectorOfModbusRtu) {
    const Bytes request = "1F 03 00 64 00 01 C6 6B"_hex;
    const Bytes reply = "1F 03 02 00 07 00 00"_hex;
    const auto all =
        shown({{frame(1, FrameKind::request, request), frame(2, FrameKind::reply, reply)}, {}, {}});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].bytes, request);
    EXPECT_EQ(all[0].way, "out");
    EXPECT_EQ(all[0].wrapping,
              "000c0008"
              "6d62727475000000"  // "mbrtu"
              "001400047f000001"  // from 127.0.0.1
              "001500047f00011f"  // to 127.0.1.31
              "0018000400000002"  // TCP
              "0019000400000001"  // from port 1
              "001a0004000001f6"  // to port 502
              "00000000");
    EXPECT_EQ(all[1].bytes, reply);
    EXPECT_EQ(all[1].way, "in");
    EXPECT_EQ(all[1].wrapping,
              "000c00086d62727475000000001400047f00011f001500047f0000010018000400000002"
              "00190004000001f6001a00040000000100000000");
    EXPECT_EQ(all[0].comments, std::vector<std::string>{"request, transaction 7"});
}

TEST(TracePcapng, SaysAsModbusTcpWhatTheDissectorOfRtuWouldNotTell) {
    const Bytes request = "1F 06 00 64 00 07 8A 69"_hex;
    const auto all = shown(
        {{frame(1, FrameKind::request, request), frame(2, FrameKind::reply, request)}, {}, {}});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].wrapping.substr(0, 24), "000c00086d62746370000000") << "mbtcp";
    EXPECT_EQ(all[0].bytes, "00 00 00 00 00 06 1F 06 00 64 00 07"_hex);
    EXPECT_EQ(all[0].comments.back(), "on the wire, as RTU: 1F 06 00 64 00 07 8A 69");
    EXPECT_EQ(all[1].bytes, all[0].bytes);
    EXPECT_NE(all[1].wrapping, all[0].wrapping) << "the other way";
}

TEST(TracePcapng, AReplyHasTheFormOfItsRequest) {
    const Bytes odd = "1F 01 03 20 00 08 00 00"_hex;  // 800 looks like a reply of three bytes
    const Bytes plain = "1F 01 00 20 00 08 00 00"_hex;
    const Bytes reply = "1F 01 01 55 00 00"_hex;
    const auto all =
        shown({{frame(1, FrameKind::request, odd), frame(2, FrameKind::reply, reply),
                frame(3, FrameKind::request, plain), frame(4, FrameKind::reply, reply)},
               {},
               {}});
    std::string forms;
    for (const Shown& one : all) forms += one.wrapping.substr(12, 4) == "7274" ? 'r' : 't';
    EXPECT_EQ(forms, "ttrr");
}

TEST(TracePcapng, CutsAnEndlessCommentAndHasTheTimeOfAFrame) {
    bus::TracePart part;
    part.frames = {frame(1, FrameKind::request, "1F 03 00 64 00 01 C6 6B"_hex)};
    part.frames[0].why = std::string(100'000, 'a');
    part.frames[0].time = WallTime(std::chrono::microseconds(0x0005'1234'9ABC'DEF0));
    EXPECT_EQ(shown(part)[0].comments.back().size(), 1000u);
    TracePcapng file("1.2", "floor1");
    file.take();
    file.add(part);
    const std::string body = blocks_of(file.finish()).at(0).body;
    EXPECT_EQ(number(body, 4), 0x00051234u);
    EXPECT_EQ(number(body, 8), 0x9ABCDEF0u);
}

TEST(TracePcapng, SaysInCommentsWhatWasThrownAwayAndDecided) {
    bus::TracePart part;
    part.frames = {frame(2, FrameKind::request, "1F 03"_hex),
                   frame(5, FrameKind::damaged, "FF 00 FF"_hex),
                   frame(6, FrameKind::late, "1F 03 02 00 07 00 00"_hex)};
    part.frames[0].why = "next in turn";
    part.decisions = {
        {1, {}, "one", {}}, {3, {}, "two", {}}, {4, {}, "three", {}}, {9, {}, "four", {}}};
    const auto all = shown(part);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[0].comments,
              (std::vector<std::string>{"request, transaction 7", "next in turn", "decided: one"}));
    EXPECT_EQ(all[1].comments, (std::vector<std::string>{"discarded: damaged, transaction 7",
                                                         "decided: two", "decided: three"}));
    EXPECT_EQ(all[1].wrapping.substr(0, 16), "000c000464617461") << "data";
    EXPECT_EQ(all[2].comments,
              (std::vector<std::string>{"discarded: late, transaction 7", "decided: four"}));
}

TEST(TracePcapng, OneWithoutFramesIsAFileAllTheSame) { EXPECT_TRUE(shown({}).empty()); }

}  // namespace
}  // namespace panelgate::web::pcapng_test
