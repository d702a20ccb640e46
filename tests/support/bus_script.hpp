#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/bus_step.hpp"
#include "support/request.hpp"

namespace panelgate::test {

/// Plays one line against an arbiter in virtual time: what goes out is recorded with its instant,
/// replies are put in at chosen instants, answers are collected. Checks at each step that nothing
/// is sent inside a gap and that no job is answered twice.
class BusScript {
  public:
    explicit BusScript(arbiter::Settings settings) : settings_(settings), arbiter_(settings) {
        arbiter_.on_line_up(now_);
        drain();
        run_for(100ms);  // past the first silent interval
        steps.clear();
    }

    struct Sent {
        TimePoint at;
        Bytes adu;
        FrameKind kind = FrameKind::request;
    };
    struct Answer {
        TimePoint at;
        Result<Bytes> pdu = Fault::cancelled;
        bool transmitted = false;
        std::vector<arbiter::Transaction> transactions{};
    };

    arbiter::Ticket submit(std::uint8_t station, Bytes pdu, arbiter::Client client = 1,
                           PriorityClass priority = PriorityClass::read) {
        const Result<arbiter::Ticket> ticket =
            try_submit(station, std::move(pdu), client, priority);
        EXPECT_TRUE(ticket.has_value());
        return ticket ? *ticket : 0;
    }
    Result<arbiter::Ticket> try_submit(std::uint8_t station, Bytes pdu, arbiter::Client client = 1,
                                       PriorityClass priority = PriorityClass::read) {
        const arbiter::Job job{
            .station = station, .request = request_of(pdu), .client = client, .priority = priority};
        record({.verb = BusStep::Verb::submit,
                .station = station,
                .bytes = std::move(pdu),
                .client = client,
                .priority = priority});
        const Result<arbiter::Ticket> ticket = arbiter_.submit(now_, job);
        if (ticket) accepted.push_back(*ticket);
        drain();
        return ticket;
    }
    /// Not recorded: a job that no step describes.
    arbiter::Ticket submit_job(const arbiter::Job& job) {
        const Result<arbiter::Ticket> ticket = arbiter_.submit(now_, job);
        EXPECT_TRUE(ticket.has_value());
        drain();
        return ticket ? *ticket : 0;
    }
    void cancel(arbiter::Client client) {
        record({.verb = BusStep::Verb::cancel, .client = client});
        arbiter_.cancel(now_, client);
        drain();
    }
    void line_down() {
        record({.verb = BusStep::Verb::line_down});
        sent_until_ = std::min(sent_until_, now_);  // the rest of a frame never leaves
        arbiter_.on_line_down(now_);
        drain();
    }
    void line_up() {
        record({.verb = BusStep::Verb::line_up});
        arbiter_.on_line_up(now_);
        drain();
    }
    /// Not recorded: a reload is nobody's step.
    void apply(const arbiter::Settings& settings) {
        settings_ = settings;
        arbiter_.apply(settings);
        drain();
    }
    /// Bytes arrive now.
    void hear(ByteView bytes) {
        record({.verb = BusStep::Verb::hear, .bytes = Bytes(bytes.begin(), bytes.end())});
        arbiter_.on_rx(now_, bytes);
        heard_until_ = now_;
        drain();
    }
    /// A whole reply of a station arrives now, its CRC (or LRC) added. Where the line is no real
    /// UART, the request has left then.
    void hear_reply(std::uint8_t station, ByteView pdu) {
        if (!settings_.paced) sent_until_ = std::min(sent_until_, now_);
        if (settings_.serial.mode == SerialMode::ascii)
            return hear(modbus::encode_ascii(station, pdu));
        hear(modbus::encode_adu(station, pdu, arbiter::crc_orders(settings_).of(station)));
    }
    /// Bytes arrive one by one from now on, at the line's pace.
    void hear_paced(ByteView bytes) {
        for (const std::uint8_t& b : bytes) {
            run_for(character_time(settings_.serial));
            hear(ByteView(&b, 1));
        }
    }

    void run_for(Duration span) { run_until(now_ + span); }
    void run_until(TimePoint end) {
        record({.verb = BusStep::Verb::run_for, .span = end - now_});
        int spins = 0;
        while (true) {
            const auto next = arbiter_.next_deadline();
            if (!next || *next > end) break;
            spins = *next > now_ ? 0 : spins + 1;
            ASSERT_LT(spins, 100) << "the arbiter asks again and again for the same instant";
            now_ = std::max(now_, *next);
            if (arbiter_.wants_end(now_)) arbiter_.on_end(now_, unsent());
            arbiter_.on_deadline(now_);
            drain();
            if (deadlines_twice) arbiter_.on_deadline(now_);
            drain();
        }
        now_ = std::max(now_, end);
    }
    /// Plays what was recorded; a submit gives its ticket, when it was accepted.
    std::optional<arbiter::Ticket> play(const BusStep& step) {
        switch (step.verb) {
            case BusStep::Verb::submit: {
                const auto ticket =
                    try_submit(step.station, step.bytes, step.client, step.priority);
                if (ticket) return *ticket;
                break;
            }
            case BusStep::Verb::cancel:
                cancel(step.client);
                break;
            case BusStep::Verb::hear:
                hear(step.bytes);
                break;
            case BusStep::Verb::run_for:
                run_for(step.span);
                break;
            case BusStep::Verb::line_down:
                line_down();
                break;
            case BusStep::Verb::line_up:
                line_up();
                break;
        }
        return std::nullopt;
    }
    /// Runs until one more frame was sent (or the limit), and returns it.
    std::optional<Sent> next_sent(Duration limit = 60s) {
        const std::size_t before = sent.size();
        const TimePoint end = now_ + limit;
        while (sent.size() == before) {
            const auto next = arbiter_.next_deadline();
            if (!next || *next > end) return std::nullopt;
            run_until(*next);
        }
        return sent.back();
    }
    /// Runs to the last bit of the frame sent last.
    void run_to_end_of_request() {
        run_until(sent.back().at + wire_time(settings_.serial, sent.back().adu.size()));
    }
    bool answered(arbiter::Ticket ticket) const { return answers.count(ticket) == 1; }
    const Answer& answer(arbiter::Ticket ticket) const { return answers.at(ticket); }

    TimePoint now() const { return now_; }
    arbiter::Arbiter& arbiter() { return arbiter_; }
    const arbiter::Settings& settings() const { return settings_; }

    std::vector<BusStep> steps;  ///< all that was done, to be played again
    std::vector<arbiter::Ticket> accepted;
    bool deadlines_twice = false;  ///< a timer may fire again
    std::vector<Sent> sent;
    std::map<arbiter::Ticket, Answer> answers;
    std::vector<arbiter::Note> notes;
    std::vector<arbiter::StationEvent> events;
    std::vector<arbiter::Decision> decisions;
    std::vector<arbiter::Written> written;
    int resets = 0;  ///< that the arbiter asked for
    std::vector<arbiter::Exchange> exchanges;
    /// What a driver tells that is asked at the end of a request (Arbiter::confirm_ends).
    std::function<Duration()> unsent = [] { return Duration::zero(); };

  private:
    void record(BusStep step) { steps.push_back(std::move(step)); }
    void drain() {
        while (auto action = arbiter_.poll_action()) {
            std::visit([this](auto& a) { act(a); }, *action);
        }
    }
    void act(const arbiter::Transmit& transmit) {
        EXPECT_GE(now_ - std::max(sent_until_, heard_until_), silent_interval(settings_.serial))
            << "sent within the gap";
        sent.push_back({now_, transmit.adu, kind_});
        sent_until_ = now_ + wire_time(settings_.serial, transmit.adu.size());
    }
    void act(const arbiter::Finish& finish) {
        EXPECT_EQ(answers.count(finish.ticket), 0u) << "answered twice";
        Answer& answer = answers[finish.ticket];
        answer = {now_, finish.pdu, finish.transmitted};
        finish.transactions.for_each(
            [&](arbiter::Transaction number) { answer.transactions.push_back(number); });
    }
    void act(const arbiter::Note& note) {
        notes.push_back(note);
        if (direction_of(note.kind) == FrameDirection::sent) kind_ = note.kind;
    }
    void act(const arbiter::Decision& decision) { decisions.push_back(decision); }
    void act(const arbiter::StationEvent& event) { events.push_back(event); }
    void act(const arbiter::Reset&) { ++resets; }
    void act(const arbiter::Exchange& exchange) { exchanges.push_back(exchange); }
    void act(const arbiter::Written& one) { written.push_back(one); }

    arbiter::Settings settings_;
    arbiter::Arbiter arbiter_;
    TimePoint now_{1h};
    TimePoint sent_until_{};
    TimePoint heard_until_{};
    FrameKind kind_ = FrameKind::request;  ///< of the frame that leaves now
};

}  // namespace panelgate::test
