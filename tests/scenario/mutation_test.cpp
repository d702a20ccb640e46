// The checker bites: an arbiter that is broken on purpose, in each of the ways it looks for, is
// found out.

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>

#include "checker.hpp"
#include "field.hpp"
#include "mutant.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "plan.hpp"

namespace panelgate::scenario {
namespace {

struct AnswersTwice : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        extra_.emplace_back(finish);
        return true;
    }
};

struct LosesAnAnswer : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish&) override { return ++count_ % 50 != 0; }
    int count_ = 0;
};

struct AnswersTooLate : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (finish.pdu || held_) return true;
        held_ = finish;
        return false;
    }
    std::optional<Action> poll_action(TimePoint now) override {
        if (held_ && now > jobs_.at(held_->ticket).arrived + 10s) {
            return Action(*std::exchange(held_, std::nullopt));
        }
        return Tampered::poll_action(now);
    }
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        job.arrived = now;
        return Tampered::submit(now, std::move(job));
    }
    std::optional<Finish> held_;
};

/// Gives what the station answered the last time.
struct GivesAnOldValue : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (!is_good(finish) || !is_read(finish)) return true;
        const Job& job = job_of(finish);
        const bool of_memory = job.request.pdu()[1] * 256 + job.request.pdu()[2] >= kMemory;
        if (of_memory != wants_memory_) return true;
        Bytes& known = known_[{job.station, job.request.pdu()}];
        if (known.empty()) known = *finish.pdu;
        finish.pdu = std::exchange(known, *finish.pdu);
        return true;
    }
    bool wants_memory_ = false;
    std::map<std::pair<std::uint8_t, Bytes>, Bytes> known_;
};

struct GivesAnOldMemory : GivesAnOldValue {
    explicit GivesAnOldMemory(const arbiter::Settings& settings) : GivesAnOldValue(settings) {
        wants_memory_ = true;
    }
};

struct GivesALongerReply : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (is_good(finish) && is_read(finish)) finish.pdu->insert(finish.pdu->end(), {0, 0});
        return true;
    }
};

struct InventsAnException : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (is_good(finish)) finish.pdu = Bytes{0x83, 2};
        return true;
    }
};

struct ConfirmsWhatTimedOut : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        const Bytes& pdu = job_of(finish).request.pdu();
        if (!finish.pdu && finish.pdu.error() == Fault::timeout && !is_read(finish))
            finish.pdu = Bytes(pdu.begin(), pdu.begin() + 5);
        return true;
    }
};

struct LiesAboutTransmission : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (!is_read(finish)) finish.transmitted = !finish.transmitted;
        return true;
    }
};

struct StarvesPolls : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (job_of(finish).priority == PriorityClass::poll) finish.pdu = Fault::expired;
        return true;
    }
};

struct IgnoresThatClientsLeave : Tampered {
    using Tampered::Tampered;
    void cancel(TimePoint, arbiter::Client) override {}
};

struct AsksTwiceAtOnce : Tampered {
    using Tampered::Tampered;
    void tamper(TimePoint now, Transmit& transmit) override {
        last_ = transmit.adu;
        at_ = now + 40ms;  // long after the frame, long before the timeout
    }
    std::optional<Action> poll_action(TimePoint now) override {
        auto action = Tampered::poll_action(now);
        if (action || last_.empty() || now < at_ || last_[1] > 4 || last_[0] == 0) return action;
        return Action(Transmit{std::exchange(last_, {})});
    }
    Bytes last_;
    TimePoint at_{};
};

struct WaitsForNothing : Tampered {
    using Tampered::Tampered;
    std::optional<TimePoint> next_deadline() const override {
        return jobs_.empty() ? Subject::next_deadline() : TimePoint{};
    }
};

void only_writes(Plan& plan) {
    plan.line.echo = true;
    plan.line.damaged_echo = 0;
    for (ClientPlan& client : plan.clients) client.writes = 1;
    for (PanelPlan& panel : plan.panels) panel.drop = 0.3;
}

void late_panels(Plan& plan) {
    for (PanelPlan& panel : plan.panels) {
        panel.late = 0.2;
        panel.late_limit = 3;
    }
    for (ClientPlan& client : plan.clients) client.stations = {plan.panels.front().id};
}

const Mutant kMutants[] = {
    {"AnswersTwice", "P3: answered twice", Kind::faults, tampered<AnswersTwice>()},
    {"LosesAnAnswer", "P3: request", Kind::faults, tampered<LosesAnAnswer>()},
    {"AnswersTooLate", "P3: answered after its deadline", Kind::faults, tampered<AnswersTooLate>()},
    {"GivesAnOldValue", "P1: a value", Kind::faults, tampered<GivesAnOldValue>()},
    {"GivesAnOldMemory", "P6: a value older", Kind::crowd, tampered<GivesAnOldMemory>()},
    {"GivesALongerReply", "P1: a reply of another length", Kind::faults,
     tampered<GivesALongerReply>()},
    {"InventsAnException", "P1: an exception", Kind::faults, tampered<InventsAnException>()},
    {"ConfirmsWhatTimedOut", "P8: a write was confirmed", Kind::faults,
     tampered<ConfirmsWhatTimedOut>()},
    {"LiesAboutTransmission", "P2: the answer to a write is wrong", Kind::faults,
     tampered<LiesAboutTransmission>()},
    {"StarvesPolls", "P9: a client starved", Kind::crowd, tampered<StarvesPolls>()},
    {"IgnoresThatClientsLeave", "P2: a write was transmitted after", Kind::crowd,
     tampered<IgnoresThatClientsLeave>()},
    {"AsksTwiceAtOnce", "P1: transmitted while the last request was outstanding", Kind::faults,
     tampered<AsksTwiceAtOnce>(),
     [](Plan& plan) {
         for (PanelPlan& panel : plan.panels) panel.drop = 0.2;
     }},
    {"Spins", "it spins", Kind::faults, tampered<WaitsForNothing>()},
    {"KeepsTheGapOfAFasterLine", "P5: transmitted", Kind::faults, misled([](arbiter::Settings& s) {
         s.serial.baud *= 4;
         each_station(s, [](auto& station) { station.frame_gap = 0us; });
     })},
    {"RepeatsWrites", "P2: a write was transmitted twice", Kind::faults,
     misled([](arbiter::Settings& s) {
         each_station(s, [](auto& station) {
             station.retry_writes = true;
             station.retries = 2;
         });
     })},
    {"HasNoQuarantine", "P1: a value", Kind::faults, misled([](arbiter::Settings& s) {
         each_station(s, [](auto& station) { station.late_window = 0ms; });
     }),
     late_panels},
    {"BelievesAnEcho", "P8: a write was confirmed", Kind::echo, misled([](arbiter::Settings& s) {
         s.echo = EchoMode::off;
         s.paced = false;
     }),
     only_writes},
    {"MixesUpTheCrcOrderOfOneStation", "P4: a frame that its panel takes for damage", Kind::faults,
     misled([](arbiter::Settings& s) {
         modbus::CrcOrder& order = s.stations.back().crc_order;
         const bool low = order == modbus::CrcOrder::low_first;
         order = low ? modbus::CrcOrder::high_first : modbus::CrcOrder::low_first;
     })},
    {"TakesMoreThanItsQueueHolds", "P9: more requests wait", Kind::crowd,
     misled([](arbiter::Settings& s) {
         s.queue.limit *= 4;
         s.queue.per_client *= 4;
     })},
};

/// Makes the LRC of each line that is heard right.
struct BelievesAnyLrc : Subject {
    using Subject::Subject;
    void on_rx(TimePoint now, ByteView bytes) override {
        constexpr std::size_t kEnd = 4;  // LRC, CR LF
        for (const std::uint8_t byte : bytes) {
            if (byte == ':') line_.clear();
            line_.push_back(byte);
            if (byte != '\n' || line_.size() <= kEnd || line_.front() != ':') continue;
            const std::string text(line_.begin() + 1, line_.end() - kEnd);
            const auto said = from_hex(text);
            if (said && said->size() > 1)
                line_ = modbus::encode_ascii(said->front(), ByteView(*said).subspan(1));
            Subject::on_rx(now, std::exchange(line_, {}));
        }
    }
    Bytes line_;
};

const Mutant kAsciiMutants[] = {
    {"BelievesAnyLrc", "P1: a value", Kind::faults,
     [](const arbiter::Settings& s) { return std::make_unique<BelievesAnyLrc>(s); }},
    {"HasNoQuarantine", "P1: a value", Kind::faults, misled([](arbiter::Settings& s) {
         each_station(s, [](auto& station) { station.late_window = 0ms; });
     }),
     late_panels},
    {"BelievesAnEcho", "P8: a write was confirmed", Kind::echo, misled([](arbiter::Settings& s) {
         s.echo = EchoMode::off;
         s.paced = false;
     }),
     only_writes},
    {"KeepsTheGapOfAFasterLine", "P5: transmitted", Kind::faults, misled([](arbiter::Settings& s) {
         s.serial.baud *= 4;
         each_station(s, [](auto& station) { station.frame_gap = 0us; });
     })},
};

class AsciiMutation : public testing::TestWithParam<Mutant> {};

TEST_P(AsciiMutation, IsCaught) {
    Mutant mutant = GetParam();
    mutant.mode = SerialMode::ascii;
    EXPECT_EQ(not_caught(mutant), "");
}

INSTANTIATE_TEST_SUITE_P(Every, AsciiMutation, testing::ValuesIn(kAsciiMutants),
                         [](const auto& info) { return std::string(info.param.name); });

class Mutation : public testing::TestWithParam<Mutant> {};

TEST_P(Mutation, IsCaught) { EXPECT_EQ(not_caught(GetParam()), ""); }

INSTANTIATE_TEST_SUITE_P(Every, Mutation, testing::ValuesIn(kMutants),
                         [](const auto& info) { return std::string(info.param.name); });

/// No setting of the arbiter exceeds the share of the dead: the checker is told so directly.
TEST(Checker, CatchesDeadStationsThatTakeTooMuch) {
    Plan plan = quiet_line(19200, 2);
    plan.panels[1].dead = true;
    Checker checker(plan);
    TimePoint now{1h};
    checker.on_line_up(now);
    for (int second = 0; second < 600; ++second) {
        now += 400ms;
        checker.on_transmit(now, {2, 3, 0, 0, 0, 1, 0x84, 0x39}, FrameKind::probe, true);
        now += 600ms;
        checker.on_transmit(now, {1, 3, 0, 0, 0, 1, 0x84, 0x0A}, FrameKind::request, false);
        checker.on_answered(now + 50ms, 1);
    }
    EXPECT_FALSE(checker.failed()) << checker.violation();
    checker.at_end(now);
    EXPECT_TRUE(checker.violation().starts_with("P4: dead stations took")) << checker.violation();
}

}  // namespace
}  // namespace panelgate::scenario
