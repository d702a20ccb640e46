#include "trace_book.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "support/hex.hpp"

namespace panelgate::bus::trace_store_test {
namespace {

constexpr TraceSettings kSmall{4, 10, 4, 64, 64};

/// A line's trace: each transaction has a request and perhaps more frames.
struct Line {
    explicit Line(const TraceSettings& settings = kSmall) : store(settings) {}

    void begin(const Bytes& request) {
        RecordedTransaction begun;
        begun.id = ++id;
        begun.first = sequence + 1;
        begun.station = request.front();
        store.add(begun);
        add(FrameKind::request, request);
    }
    void add(FrameKind kind, const Bytes& bytes) {
        RecordedFrame frame;
        frame.sequence = ++sequence;
        frame.transaction = id;
        frame.kind = kind;
        frame.why.client = std::make_shared<const std::string>("http 10.0.0.9");
        store.add(frame, bytes);
    }
    void end(TransactionEnd how = TransactionEnd::ok) {
        store.newest()->end = how;
        store.newest()->sequence = ++sequence;
    }
    void exchange() {
        begin("11 03 00 00 00 01"_hex);
        add(FrameKind::reply, "11 03 02 00 07"_hex);
        end();
    }

    TraceStore store;
    std::uint64_t id = 0;
    std::uint64_t sequence = 0;
};

std::string ids(const std::vector<TraceTransaction>& transactions) {
    std::string text;
    for (const TraceTransaction& one : transactions)
        text += (text.empty() ? "" : " ") + std::to_string(one.id);
    return text;
}

TEST(TraceStore, TellsATransactionWithItsFrames) {
    Line line;
    line.begin("11 03 00 00 00 01"_hex);
    line.add(FrameKind::damaged, "00 FF"_hex);
    line.add(FrameKind::reply, "11 03 02 00 07"_hex);
    line.end();
    line.add(FrameKind::late, "12 03 02 00 09"_hex);
    line.begin("12 06 00 00 00 01"_hex);
    const auto all = line.store.transactions(9);
    ASSERT_EQ(all.size(), 1u) << "the other one is still open";
    EXPECT_EQ(all[0].request, "11 03 00 00 00 01"_hex);
    EXPECT_EQ(all[0].reply, "11 03 02 00 07"_hex);
    ASSERT_EQ(all[0].discarded.size(), 2u);
    EXPECT_EQ(all[0].discarded[0].kind, FrameKind::damaged);
    EXPECT_EQ(all[0].discarded[1].kind, FrameKind::late) << "it came behind this one";
    EXPECT_EQ(all[0].first, 1u);
    EXPECT_EQ(all[0].sequence, 4u);
    EXPECT_EQ(all[0].client, "http 10.0.0.9");
    EXPECT_EQ(all[0].reason, "read");
}

TEST(TraceStore, PagesTransactionsByTheirEnds) {
    Line line;
    for (int i = 0; i < 3; ++i) line.exchange();
    line.begin("11 03 00 00 00 01"_hex);
    EXPECT_EQ(ids(line.store.transactions_since(0, 9)), "1 2 3");
    EXPECT_EQ(ids(line.store.transactions_since(3, 9)), "2 3");
    EXPECT_EQ(ids(line.store.transactions_since(3, 1)), "2");
    EXPECT_EQ(ids(line.store.transactions_since(9, 9)), "");
    EXPECT_EQ(ids(line.store.transactions(2)), "2 3");
    line.end();
    EXPECT_EQ(ids(line.store.transactions_since(9, 9)), "4");
}

TEST(TraceStore, ForgetsATransactionWithItsRequest) {
    Line line({8, 100, 4, 64, 64});  // bytes for five exchanges of eleven bytes
    for (int i = 0; i < 7; ++i) line.exchange();
    const auto all = line.store.transactions(9);
    EXPECT_EQ(ids(all), "3 4 5 6 7");
    for (const TraceTransaction& one : all) {
        EXPECT_EQ(one.request, "11 03 00 00 00 01"_hex);
        EXPECT_EQ(one.reply, "11 03 02 00 07"_hex);
    }
    Line few({8, 4, 4, 6400, 64});  // frames for two exchanges
    for (int i = 0; i < 7; ++i) few.exchange();
    EXPECT_EQ(ids(few.store.transactions(9)), "6 7");
}

TEST(TraceStore, FindsATransactionByItsNumber) {
    Line line;
    EXPECT_EQ(line.store.find(1), nullptr);
    for (int i = 0; i < 6; ++i) line.exchange();
    EXPECT_EQ(line.store.find(0), nullptr);
    EXPECT_EQ(line.store.find(2), nullptr) << "it is forgotten";
    ASSERT_NE(line.store.find(3), nullptr);
    EXPECT_EQ(line.store.find(3)->id, 3u);
    EXPECT_EQ(line.store.find(6)->id, 6u);
    EXPECT_EQ(line.store.find(7), nullptr);
}

TEST(TraceStore, KeepsDecisionsAsLongAsTheirTextsFit) {
    TraceStore store({4, 10, 4, 64, 16});
    for (std::uint64_t i = 1; i <= 3; ++i)
        store.add(RecordedDecision{i, {}, {}}, "decision " + std::to_string(i));
    const auto decisions = store.decisions(9);
    ASSERT_EQ(decisions.size(), 1u);
    EXPECT_EQ(decisions[0].text, "decision 3");
    EXPECT_EQ(store.decisions_since(2, 9).size(), 1u);
    EXPECT_TRUE(store.decisions_since(3, 9).empty());
}

TEST(TraceStore, CopiesWhatFollowsANumber) {
    Line line({8, 20, 4, 6400, 64});
    for (int i = 0; i < 4; ++i) line.exchange();
    line.store.add(RecordedDecision{++line.sequence, {}, {}}, "why");
    TraceStore copy({8, 20, 4, 6400, 64});
    copy.copy(line.store, line.store.first_of_last(2) - 1);
    const TracePart part = copy.part(SIZE_MAX);
    EXPECT_EQ(ids(part.transactions), "3 4");
    EXPECT_EQ(part.frames.size(), 4u);
    EXPECT_EQ(part.transactions[1].reply, "11 03 02 00 07"_hex);
    ASSERT_EQ(part.decisions.size(), 1u);
    EXPECT_EQ(part.decisions[0].text, "why");
    EXPECT_EQ(line.store.first_of_last(99), 1u);
    EXPECT_EQ(TraceStore(kSmall).first_of_last(1), 0u);
}

TEST(TraceStore, TellsWhenOneMoreTransactionWouldPushSomethingOut) {
    Line line({4, 100, 4, 6400, 64});
    EXPECT_TRUE(line.store.has_room());
    for (int i = 0; i < 4; ++i) line.exchange();
    EXPECT_FALSE(line.store.has_room());
    Line short_of_bytes({40, 100, 4, 530, 64});
    EXPECT_TRUE(short_of_bytes.store.has_room());
    short_of_bytes.exchange();
    short_of_bytes.exchange();
    EXPECT_FALSE(short_of_bytes.store.has_room()) << "two frames may have 256 bytes each";
}

TEST(TraceStore, TakesNoMoreMemoryThanIsSaid) {
    EXPECT_LE(TraceStore::memory(TraceSettings{}), 680u * 1024);
    EXPECT_LE(TraceStore::memory(IncidentSettings{}.each), 38u * 1024);
}

}  // namespace
}  // namespace panelgate::bus::trace_store_test
