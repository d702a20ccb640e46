// More of what mutation_test.cpp does: what only a line with the oddities of the field shows.

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "mutant.hpp"
#include "panelgate/base/serial_format.hpp"
#include "plan.hpp"

namespace panelgate::scenario {
namespace {

/// A line that comes back finds an arbiter that knows nothing of what it owes.
struct ForgetsWhatIsOwedOverALineLoss : Subject {
    explicit ForgetsWhatIsOwedOverALineLoss(const arbiter::Settings& settings)
        : Subject(settings), settings_(settings) {}

    void on_line_down(TimePoint now) override {
        Subject::on_line_down(now);
        while (auto action = Subject::poll_action(now)) said_.push_back(renamed(*action));
        arbiter_ = std::make_unique<arbiter::Arbiter>(settings_);
        before_ = last_;
    }
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        const auto ticket = Subject::submit(now, std::move(job));
        if (!ticket) return ticket;
        last_ = before_ + *ticket;
        return last_;
    }
    std::optional<Action> poll_action(TimePoint now) override {
        if (!said_.empty()) {
            Action action = std::move(said_.front());
            said_.pop_front();
            return action;
        }
        auto action = Subject::poll_action(now);
        return action ? std::optional(renamed(*action)) : std::nullopt;
    }
    /// Each arbiter counts its tickets from 1.
    Action renamed(Action action) const {
        if (auto* finish = std::get_if<Finish>(&action)) finish->ticket += before_;
        return action;
    }
    arbiter::Settings settings_;
    std::deque<Action> said_;
    arbiter::Ticket before_ = 0;
    arbiter::Ticket last_ = 0;
};

/// What comes soon after the request has left is thrown away as old.
struct DropsQuickReplies : Tampered {
    explicit DropsQuickReplies(const arbiter::Settings& settings)
        : Tampered(settings), format_(settings.serial) {}
    void tamper(TimePoint now, Transmit& transmit) override {
        deaf_until_ = now + wire_time(format_, transmit.adu.size()) + silent_interval(format_);
    }
    void on_rx(TimePoint now, ByteView bytes) override {
        if (now >= deaf_until_) Tampered::on_rx(now, bytes);
    }
    SerialFormat format_;
    TimePoint deaf_until_{};
};

struct TakesAllClientsForOneHost : Subject {
    using Subject::Subject;
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        job.host = 1;
        job.client = 1;
        return Subject::submit(now, std::move(job));
    }
};

struct CountsEqualReads : Tampered {
    explicit CountsEqualReads(const arbiter::Settings& settings)
        : Tampered(settings), limit_(settings.queue.limit) {}
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        if (open_ >= limit_) return Fault::busy;
        ++open_;
        return Tampered::submit(now, std::move(job));
    }
    bool tamper(TimePoint, Finish&) override {
        --open_;
        return true;
    }
    std::size_t limit_;
    std::size_t open_ = 0;
};

struct TakesReadersForPolls : Subject {
    using Subject::Subject;
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        if (job.priority == PriorityClass::read) job.priority = PriorityClass::poll;
        return Subject::submit(now, std::move(job));
    }
};

struct IgnoresThatClientsLeft : Subject {
    using Subject::Subject;
    void cancel(TimePoint, arbiter::Client) override {}
};

struct ComesLate : Subject {
    using Subject::Subject;
    std::optional<TimePoint> next_deadline() const override {
        const auto next = Subject::next_deadline();
        return next ? std::optional(*next + 300ms) : next;
    }
};

struct RefusesGoodStations : Subject {
    using Subject::Subject;
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        if (++count_ % 50 == 0) return Fault::offline;
        return Subject::submit(now, std::move(job));
    }
    int count_ = 0;
};

struct LosesConfirmations : Tampered {
    using Tampered::Tampered;
    bool tamper(TimePoint, Finish& finish) override {
        if (is_good(finish) && !is_read(finish) && ++count_ % 20 == 0) finish.pdu = Fault::timeout;
        return true;
    }
    int count_ = 0;
};

struct LosesTheLastByte : Subject {
    using Subject::Subject;
    void on_rx(TimePoint now, ByteView bytes) override {
        if (++count_ % 100 == 0) bytes = bytes.first(bytes.size() - 1);
        Subject::on_rx(now, bytes);
    }
    int count_ = 0;
};

void one_client_of_one_slow_panel(Plan& plan) {
    plan.line.losses = 1;
    plan.line.handover = 1;
    plan.line.pauses = 0;
    plan.panels.resize(1);
    plan.panels.front() =
        PanelPlan{.id = plan.panels.front().id, .think = 100ms, .late_limit = 1.8};
    for (ClientPlan& client : plan.clients) client.stations = {plan.panels.front().id};
}

void no_wider_than_it_reads(Plan& plan) {
    for (PanelPlan& panel : plan.panels) {
        panel.hole = 1;
        panel.hole_limit = 40ms;
        panel.max_registers = 125;
    }
}

void eager(Plan& plan) {
    for (PanelPlan& panel : plan.panels) {
        panel.eager = true;
        panel.think = 200us;
        panel.slow_think = {};
    }
}

void stalling(Plan& plan) {
    for (PanelPlan& panel : plan.panels)
        panel = PanelPlan{.id = panel.id, .think = 5ms, .late_limit = 1.8};
    for (ClientPlan& client : plan.clients) client.stations = {plan.panels.front().id};
    plan.line.stalls = 0.5;
    plan.line.losses = 0;
}

void writes_again(Plan& plan) {
    for (arbiter::StationSettings& station : plan.settings.stations) {
        station.retry_writes = true;
        station.retries = 1;
    }
    plan.settings.unlisted.retries = 1;
    for (PanelPlan& panel : plan.panels) panel.drop = 0.3;
    for (ClientPlan& client : plan.clients) {
        client.writes = 0.5;
        client.leaves = 2;
    }
}

const Mutant kFieldMutants[] = {
    {"ForgetsWhatIsOwedOverALineLoss", "P1: a value", Kind::loss,
     tampered<ForgetsWhatIsOwedOverALineLoss>(), one_client_of_one_slow_panel},
    {"BelievesThatNothingStalls", "P1: a value", Kind::stall,
     misled([](arbiter::Settings& s) { s.may_stall = false; }), stalling},
    {"EndsAReplyAtAnyPause", "P4: a sound panel's request failed", Kind::voices,
     misled([](arbiter::Settings& s) { s.reply_hole = s.end_of_frame = 1ms; }),
     no_wider_than_it_reads},
    {"GivesUpTooEarly", "P1: transmitted while the last request was outstanding", Kind::faults,
     misled([](arbiter::Settings& s) {
         each_station(s, [](auto& station) { station.response_timeout = 5ms; });
     })},
    {"DropsQuickReplies", "P4: a sound panel's request failed", Kind::voices,
     tampered<DropsQuickReplies>(), eager},
    {"RestsTheWholeLine", "P4: an attempt at a silent station cost", Kind::mass,
     misled([](arbiter::Settings& s) { s.quarantine = arbiter::Quarantine::line; })},
    {"WaitsForTheDead", "P4: an attempt at a silent station cost", Kind::mass,
     misled([](arbiter::Settings& s) {
         each_station(s, [](auto& station) { station.response_timeout *= 4; });
     })},
    {"TakesAllClientsForOneHost", "P9: a polite client", Kind::flood,
     tampered<TakesAllClientsForOneHost>()},
    {"CountsEqualReads", "P6: a read was refused", Kind::flood, tampered<CountsEqualReads>()},
    {"TakesReadersForPolls", "P9: five writes in a row", Kind::writers,
     tampered<TakesReadersForPolls>()},
    {"AnswersAfterItsDeadline", "P3: answered after its deadline", Kind::loss,
     misled([](arbiter::Settings& s) { s.queue.deadline *= 3; })},
    {"AsksAgainForThoseWhoLeft", "P4: a request went out again for nobody", Kind::loss,
     tampered<IgnoresThatClientsLeft>(), writes_again},
    {"WritesOnceTooOften", "P2: a write was transmitted twice", Kind::loss,
     misled(
         [](arbiter::Settings& s) { each_station(s, [](auto& station) { station.retries = 3; }); }),
     writes_again},
    {"ComesLate", "P5: the line was silent", Kind::writers, tampered<ComesLate>()},
    {"RefusesGoodStations", "P4: a good station was refused", Kind::writers,
     tampered<RefusesGoodStations>()},
    {"LosesConfirmations", "P4: a sound panel's request failed", Kind::writers,
     tampered<LosesConfirmations>()},
    {"LosesTheLastByte", "P4: a sound panel's request failed", Kind::writers,
     tampered<LosesTheLastByte>(),
     [](Plan& plan) {
         plan.settings.unlisted.retries = 0;
         for (arbiter::StationSettings& station : plan.settings.stations) station.retries = 0;
     }},
};

class FieldMutation : public testing::TestWithParam<Mutant> {};

TEST_P(FieldMutation, IsCaught) { EXPECT_EQ(not_caught(GetParam()), ""); }

INSTANTIATE_TEST_SUITE_P(Every, FieldMutation, testing::ValuesIn(kFieldMutants),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace panelgate::scenario
