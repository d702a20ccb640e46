// Follows advice on many random lines by its words alone, without the planner's internals.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "panelgate/plan/advice.hpp"
#include "panelgate/plan/line_plan.hpp"
#include "plant_line.hpp"

namespace panelgate::plan::followed_test {
namespace {

constexpr int kLines = 1500;

/// A line with any rate and format, with polls, points and relays.
class AnyLine : private test::PlantLine {
  public:
    explicit AnyLine(unsigned seed) : random_(seed) {
        line.serial.baud = pick({1200, 1800, 4800, 9600, 10000, 14400, 19200, 31250, 57600});
        line.serial.parity = pick({Parity::none, Parity::even});
        line.serial.stop_bits = pick({1, 2});
        line.serial.mode = pick({SerialMode::rtu, SerialMode::rtu, SerialMode::ascii});
        const int stations = number(2, 4);
        for (int i = 0; i < stations; ++i) add_station(i);
        const int relays = number(0, 4);
        for (int i = 0; i < relays; ++i) add_relay(static_cast<std::uint32_t>(i));
    }
    const Line& made() const { return line; }

  private:
    int number(int least, int most) { return std::uniform_int_distribution(least, most)(random_); }
    template <class T>
    T pick(std::initializer_list<T> from) {
        return from.begin()[number(0, static_cast<int>(from.size()) - 1)];
    }
    Duration interval() {
        return pick<Duration>({10ms, 33ms, 50ms, 100ms, 250ms, 1s, 2s, 7s, 29999us, 20h});
    }

    void add_station(int i) {
        Station& station = add("s" + std::to_string(i), pick({"generic", "panasonic-gt"}));
        station.think_time = pick<Duration>({0ms, 1ms, 5500us, 100ms});
        if (number(0, 2) == 0) station.frame_gap = pick<Duration>({0us, 500us, 3500us, 20ms});
        if (number(0, 1) == 0) show_as_written(station);
        const int asked = number(0, 5);
        for (int n = 0; n < asked; ++n) {
            const auto first = static_cast<std::uint32_t>(number(0, 30) * 20);
            const auto count = static_cast<std::uint32_t>(pick({1, 2, 8, 20, 60, 125, 300}));
            ask(station, first, count, interval());
        }
    }

    void add_relay(std::uint32_t index) {
        Relay& relay = copy(index * 4, pick({4u, 4u, 20u}), interval());
        if (number(0, 1) == 0) relay.refresh = pick<Duration>({1s, 2s, 10s, 60s});
        if (index > 0 && number(0, 1) == 0) {  // so that they continue one another
            relay.every = line.relays[index - 1].every;
            relay.refresh = line.relays[index - 1].refresh;
        }
        if (number(0, 4) == 0) relay.from.reset();
    }

    std::mt19937 random_;
};

Duration duration_of(const std::string& text) {
    const Duration unit = text.ends_with("us")   ? Duration(1us)
                          : text.ends_with("ms") ? Duration(1ms)
                          : text.ends_with("in") ? Duration(1min)
                                                 : Duration(1s);
    return std::stoll(text) * unit;
}

void follow_read(Line& line, const std::smatch& words) {
    const auto station = std::ranges::find(line.stations, words[1].str(), &Station::name);
    const auto first = static_cast<std::uint32_t>(std::stoul(words[2]));
    const auto last = words[3].matched ? static_cast<std::uint32_t>(std::stoul(words[3])) : first;
    for (PolledItem& asked : station->asked) {
        const std::uint32_t at = asked.want.span.first;
        if (first <= at && at <= last)
            asked.want.every = std::max(asked.want.every, duration_of(words[4]));
    }
}

void follow_intervals(Line& line, const std::smatch& words) {
    const double times = std::stod(words[1]);
    const auto longer = [&](Duration every) {
        const auto made = std::chrono::duration_cast<Duration>(every * times);
        const Duration most = words[2].matched ? std::min<Duration>(made, 24h) : made;
        return Duration(std::chrono::round<std::chrono::microseconds>(most));
    };
    for (Station& station : line.stations) {
        for (PolledItem& asked : station.asked) asked.want.every = longer(asked.want.every);
    }
    for (Relay& relay : line.relays) relay.every = longer(relay.every);
}

void follow_merges(Line& line, std::string pairs) {
    static const std::regex kPair(R"((copy\d+) and (copy\d+))");
    for (std::smatch words; std::regex_search(pairs, words, kPair); pairs = words.suffix()) {
        const auto first = std::ranges::find(line.relays, words[1].str(), &Relay::name);
        const auto next = std::ranges::find(line.relays, words[2].str(), &Relay::name);
        ASSERT_TRUE(first != line.relays.end() && next != line.relays.end());
        ASSERT_EQ(first->to->span.end(), next->to->span.first);
        first->from->span.count += next->from->span.count;
        first->to->span.count += next->to->span.count;
        line.relays.erase(next);
    }
}

/// Returns the line after the change.
Line followed(const Line& before, const std::string& what) {
    static const std::regex kRate(R"(serial: \{baud: (\d+)\} \(of all panels, too\))");
    static const std::regex kRead(
        R"(read (\w+) R(\d+)(?: to R(\d+)| \(\d+\)) every (\d+\w+) instead of \d+\w+(?: to \d+\w+)?)");
    static const std::regex kAll(
        R"(all intervals ([\d.]+) times as long(?: \((24h at most)?(?:, )?(?:refresh as it is)?\))?)");
    static const std::regex kMerge(R"(one relay instead of (.*))");
    Line line = before;
    std::smatch words;
    if (std::regex_match(what, words, kRate)) {
        line.serial.baud = std::stoi(words[1]);
    } else if (std::regex_match(what, words, kRead)) {
        follow_read(line, words);
    } else if (std::regex_match(what, words, kAll)) {
        follow_intervals(line, words);
    } else if (std::regex_match(what, words, kMerge)) {
        follow_merges(line, words[1]);
    } else {
        ADD_FAILURE() << "what does this mean? " << what;
    }
    return line;
}

void expect_to_hold(const LinePlan& before, const Advice& told, const LinePlan& after) {
    EXPECT_NEAR(told.load, after.load, 1e-3 * after.load);
    EXPECT_NEAR(told.most, after.most, 1e-3 * after.most);
    const bool changing = is_high_by_changes(before);
    EXPECT_LE(changing ? after.most : after.load,
              (changing ? before.most : before.load) - kMinGain + 1e-3);
    if (told.what.starts_with("read ") || told.what.starts_with("all ")) {
        EXPECT_LE(told.load, kHigh);
        EXPECT_LE(told.most, kFull);
    }
}

TEST(FollowedTest, AdviceBringsWhatItSays) {
    int told = 0;
    for (unsigned seed = 0; seed < kLines; ++seed) {
        const AnyLine any(seed);
        const LinePlan before = make_plan(any.made());
        const std::vector<Advice> all = advise(any.made(), before);
        if (verdict(before) == Verdict::fine) EXPECT_THAT(all, testing::IsEmpty());
        for (const Advice& one : all) {
            SCOPED_TRACE("line " + std::to_string(seed) + ", " + one.what);
            expect_to_hold(before, one, make_plan(followed(any.made(), one.what)));
            ++told;
        }
    }
    EXPECT_GT(told, kLines) << "of so many lines";
}

TEST(FollowedTest, TheHighestRateIsFineAndTheNextIsNot) {
    for (unsigned seed = 0; seed < kLines / 5; ++seed) {
        const AnyLine any(seed);
        const auto highest = highest_rate(any.made(), make_plan(any.made()));
        if (!highest) continue;
        SCOPED_TRACE("line " + std::to_string(seed));
        const auto at = [&](double times) {
            return verdict(make_plan(at_intervals(any.made(), 1 / times)));
        };
        EXPECT_EQ(at(highest->times * 0.999), Verdict::fine);
        EXPECT_NE(at(highest->times * 1.001), Verdict::fine);
    }
}

}  // namespace
}  // namespace panelgate::plan::followed_test
