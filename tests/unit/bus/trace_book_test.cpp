// What a line's trace keeps and for how long, and how it shows instants.
#include "trace_book.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/bus/trace.hpp"
#include "panelgate/rt/clock.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::bus::trace_book_test {
namespace {

using DecisionRecorder = Recorder<TraceDecision>;

TraceDecision decision(std::uint64_t sequence) {
    TraceDecision made;
    made.sequence = sequence;
    made.text = std::to_string(sequence);
    return made;
}
DecisionRecorder with(std::size_t limit, std::size_t entries) {
    DecisionRecorder recorder(limit);
    for (std::size_t i = 1; i <= entries; ++i) recorder.add(decision(i));
    return recorder;
}
/// "3:3 4:4": sequence and text of each.
std::string summary_of(const std::vector<TraceDecision>& entries) {
    std::string text;
    for (const TraceDecision& entry : entries)
        text += (text.empty() ? "" : " ") + std::to_string(entry.sequence) + ':' + entry.text;
    return text;
}

TEST(Recorder, GivesTheLastOnesTheOldestFirstAndForgetsTheOldestWhenItIsFull) {
    const DecisionRecorder recorder = with(8, 5);
    EXPECT_EQ(summary_of(recorder.last(2)), "4:4 5:5");
    EXPECT_EQ(summary_of(recorder.last(0)), "");
    EXPECT_EQ(summary_of(recorder.last(5)), "1:1 2:2 3:3 4:4 5:5");
    EXPECT_EQ(summary_of(with(8, 0).last(3)), "");
    EXPECT_EQ(summary_of(with(3, 3).last(8)), "1:1 2:2 3:3");
    EXPECT_EQ(summary_of(with(3, 4).last(8)), "2:2 3:3 4:4");
    EXPECT_EQ(summary_of(with(3, 300).last(8)), "298:298 299:299 300:300");
    EXPECT_EQ(summary_of(with(0, 5).last(8)), "") << "one that keeps nothing";
}

TEST(Recorder, GivesTheFirstOnesBehindANumber) {
    const DecisionRecorder recorder = with(3, 6);
    EXPECT_EQ(summary_of(recorder.since(4, 8)), "5:5 6:6");
    EXPECT_EQ(summary_of(recorder.since(0, 2)), "4:4 5:5") << "what it has forgotten is not there";
    EXPECT_EQ(summary_of(recorder.since(6, 8)), "");
    EXPECT_EQ(summary_of(recorder.since(99, 8)), "");
    EXPECT_EQ(summary_of(recorder.since(4, 0)), "");
    DecisionRecorder gaps(8);
    for (const std::uint64_t sequence : {2u, 5u, 9u}) gaps.add(decision(sequence));
    EXPECT_EQ(summary_of(gaps.since(3, 8)), "5:5 9:9") << "others have numbers, too";
}

TEST(ByteRing, KeepsTheBeginningOfWhatIsLongerThanIt) {
    ByteRing ring(4);
    const auto place = ring.add("01 02 03 04 05 06"_hex);
    EXPECT_TRUE(ring.has(place));
    EXPECT_EQ(ring.at(place, 4), "01 02 03 04"_hex);
}

constexpr TraceSettings kSmall{4, 10, 4, 64, 64};
const Bytes kRequest = "11 03 00 00 00 01"_hex;
const Bytes kAnswer = "11 03 02 00 07"_hex;

/// A line's trace: each transaction has a request and perhaps more frames.
struct Line {
    explicit Line(const TraceSettings& settings = kSmall, int exchanges = 0) : store(settings) {
        for (int i = 0; i < exchanges; ++i) exchange();
    }
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
        frame.client = std::make_shared<const std::string>("http 10.0.0.9");
        store.add(frame, bytes);
    }
    void end(TransactionEnd how = TransactionEnd::ok) {
        store.newest()->end = how;
        store.newest()->sequence = ++sequence;
    }
    void exchange() {
        begin(kRequest);
        add(FrameKind::reply, kAnswer);
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

TEST(TraceSettings, OfManyLinesHaveTogetherNoMoreThan32Full) {
    EXPECT_EQ(TraceSettings::of(1).transactions, 1000U);
    EXPECT_EQ(TraceSettings::of(32).bytes, TraceSettings().bytes);
    EXPECT_EQ(TraceSettings::of(256).transactions, 125U);
    EXPECT_LE(256 * TraceSettings::of(256).bytes, 32 * TraceSettings().bytes);
}

TEST(TraceStore, TellsATransactionWithItsFrames) {
    Line line;
    line.begin(kRequest);
    line.add(FrameKind::damaged, "00 FF"_hex);
    line.add(FrameKind::reply, kAnswer);
    line.end();
    line.add(FrameKind::late, "12 03 02 00 09"_hex);
    line.begin("12 06 00 00 00 01"_hex);
    const auto all = line.store.part(9).transactions;
    ASSERT_EQ(all.size(), 1u) << "the other one is still open";
    EXPECT_EQ(all[0].request, kRequest);
    EXPECT_EQ(all[0].reply, kAnswer);
    ASSERT_EQ(all[0].discarded.size(), 2u);
    EXPECT_EQ(all[0].discarded[0].kind, FrameKind::damaged);
    EXPECT_EQ(all[0].discarded[1].kind, FrameKind::late) << "it came behind this one";
    EXPECT_EQ(all[0].first, 1u);
    EXPECT_EQ(all[0].sequence, 4u);
    EXPECT_EQ(all[0].client, "http 10.0.0.9");
    EXPECT_EQ(all[0].reason, "read");
}

TEST(TraceStore, PagesTransactionsByTheirEnds) {
    Line line(kSmall, 3);
    line.begin(kRequest);
    EXPECT_EQ(ids(line.store.part_since(0, 9).transactions), "1 2 3");
    EXPECT_EQ(ids(line.store.part_since(3, 9).transactions), "2 3");
    EXPECT_EQ(ids(line.store.part_since(3, 1).transactions), "2");
    EXPECT_EQ(ids(line.store.part_since(9, 9).transactions), "");
    EXPECT_EQ(ids(line.store.part(2).transactions), "2 3");
    line.end();
    EXPECT_EQ(ids(line.store.part_since(9, 9).transactions), "4");
}

TEST(TraceStore, ForgetsATransactionWithItsRequest) {
    const Line line({8, 100, 4, 64, 64}, 7);  // bytes for five exchanges of eleven bytes
    const auto all = line.store.part(9).transactions;
    EXPECT_EQ(ids(all), "3 4 5 6 7");
    for (const TraceTransaction& one : all) {
        EXPECT_EQ(one.request, kRequest);
        EXPECT_EQ(one.reply, kAnswer);
    }
    const Line few({8, 4, 4, 6400, 64}, 7);  // frames for two exchanges
    EXPECT_EQ(ids(few.store.part(9).transactions), "6 7");
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
    const auto decisions = store.part(9).decisions;
    ASSERT_EQ(decisions.size(), 1u);
    EXPECT_EQ(decisions[0].text, "decision 3");
    EXPECT_EQ(store.part_since(2, 9).decisions.size(), 1u);
    EXPECT_TRUE(store.part_since(3, 9).decisions.empty());
}

TEST(TraceStore, CopiesWhatFollowsANumber) {
    Line line({8, 20, 4, 6400, 64}, 4);
    line.store.add(RecordedDecision{++line.sequence, {}, {}}, "why");
    TraceStore copy({8, 20, 4, 6400, 64});
    copy.copy(line.store, line.store.first_of_last(2) - 1);
    const TracePart part = copy.part(SIZE_MAX);
    EXPECT_EQ(ids(part.transactions), "3 4");
    EXPECT_EQ(part.frames.size(), 4u);
    EXPECT_EQ(part.transactions[1].reply, kAnswer);
    ASSERT_EQ(part.decisions.size(), 1u);
    EXPECT_EQ(part.decisions[0].text, "why");
    EXPECT_EQ(line.store.first_of_last(99), 1u);
    EXPECT_EQ(TraceStore(kSmall).first_of_last(1), 0u);
}

TEST(TraceStore, TellsWhenOneMoreTransactionWouldPushSomethingOut) {
    EXPECT_TRUE(Line({4, 100, 4, 6400, 64}).store.has_room());
    EXPECT_FALSE(Line({4, 100, 4, 6400, 64}, 4).store.has_room());
    EXPECT_TRUE(Line({40, 100, 4, 530, 64}).store.has_room());
    EXPECT_FALSE(Line({40, 100, 4, 530, 64}, 2).store.has_room())
        << "two frames may have 256 bytes each";
}

TEST(TraceStore, TakesNoMoreMemoryThanIsSaid) {
    EXPECT_LE(TraceStore::memory(TraceSettings{}), 680u * 1024);
    EXPECT_LE(TraceStore::memory(IncidentSettings{}.each), 38u * 1024);
}

TEST(Wall, ShowsInstantsAsFarApartAsTheyAreAndAsksAgainNowAndThen) {
    test::ManualClock clock;
    Wall wall(clock);
    const WallTime before = rt::wall_now();
    const WallTime now = wall.at(clock.now());
    EXPECT_GE(now, before);
    EXPECT_LE(now, rt::wall_now());
    EXPECT_EQ(wall.at(clock.now() - 5ms), now - 5ms);
    EXPECT_EQ(wall.at(clock.now() + 99ms), now + 99ms);
    clock.pass(24h);
    EXPECT_LE(wall.at(clock.now()), rt::wall_now()) << "a day has passed for one of them only";
}

}  // namespace
}  // namespace panelgate::bus::trace_book_test
