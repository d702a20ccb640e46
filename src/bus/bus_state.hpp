#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "line_records.hpp"
#include "machine.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/line/line.hpp"

namespace panelgate::bus {

/// Also the host of the machine's drive.
struct Bus::State final : public LineRecords, public line::Line::Events {
    struct Pending {
        AnswerHandler handler;
        std::uint8_t station = 0;
        std::uint8_t function = 0;
        TimePoint arrived;
        std::optional<WriteEnd> write{};
        Bytes original_pdu{};      ///< if translated: the client's PDU
        std::uint8_t sent_as = 0;  ///< ... and the function sent; 0: not translated
        ClientId client = 0;
        std::unique_ptr<Refusal> denial{};  ///< by settings that changed while it waited
    };

    State(const boost::asio::any_io_executor& e, rt::Clock& c, Settings s,
          std::unique_ptr<line::Line> l)
        : LineRecords(e, c, std::move(s), std::move(l)),
          executor(e),
          machine(make_machine(settings.arbiter)),
          arbiter(*machine),
          rights(settings.stations, settings.access),
          departed(settings.clients),
          answers(executor),
          drive(clock, *line, arbiter, *this) {}

    void on_up() override;
    void on_down(const std::string& why) override;
    void on_bytes(ByteView bytes) override;

    void apply(Settings next, std::unique_ptr<line::Line> other, std::shared_ptr<void> far_end);
    void adopt(Settings next);
    /// Refuses what waits and is forbidden by the changed settings (P2).
    void deny_forbidden(TimePoint now);
    /// By the doors as they are now, and by the rules.
    std::optional<Refusal> judge(const WhoRef& who,
                                 const access::LineRules::Question& question) const;
    std::optional<Refusal> judge_again(const arbiter::Job& job, const Pending& entry) const;
    void schedule_line_change();
    void change_line();
    void transact(Request request, AnswerHandler handler);
    /// `sent`: what it is translated to, if it is.
    std::optional<Refusal> refusal_of(const Request& request,
                                      const std::optional<modbus::Request>& sent) const;
    void record_departure(ClientId client);
    void refuse(Pending pending, Result<Bytes> pdu, std::optional<Refusal> refusal = {});
    void act(arbiter::Transmit& transmit) {
        if (settings.may_send && !settings.may_send()) return;
        line->write(transmit.adu);
        arbiter.set_latency(line->latency());
    }
    void act(arbiter::Finish& finish);
    void act(arbiter::Note& note) {
        look_for_new_address(note);
        if (is_foreign_request(note)) observe(settings, ForeignRequest{note.bytes[0]});
        ClientName client = names.name(note.why.client);
        book.note(std::move(note), std::move(client));
    }
    void act(const arbiter::Exchange& exchange) {
        book.end(exchange);
        tell_health(exchange.station);
    }
    void act(const arbiter::Decision& decision) {
        const ClientName client = names.name(decision.client);
        book.decide(decision.at, text_of(decision, client, settings.arbiter.queue));
    }
    void act(arbiter::StationEvent& event);
    void tell_health(std::uint8_t station);
    void look_for_new_address(const arbiter::Note& note);
    bool is_foreign_request(const arbiter::Note& note) const;
    void act(const arbiter::Written& written) {
        observe(settings,
                WriteEvent{written.station, written.items, written.ended, written.client});
    }
    void act(arbiter::Reset& reset) { line->reset(std::string(reset.why)); }
    void confirm_end(TimePoint now) {
        if (arbiter.wants_end(now)) arbiter.on_end(now, line->unsent().value_or(Duration::zero()));
    }
    void check_delivery(TimePoint now);
    void on_deadline(TimePoint now);
    void settled(TimePoint now) {
        load.record(now, arbiter.counters().busy);
        if (up) doctor.look(now, counts());
        if (calls == 0) answers.deliver();
        schedule_line_change();
    }
    /// Runs a client's call: no answer is delivered before it returns.
    template <class Verb>
    void call(Verb verb) {
        ++calls;
        verb();
        --calls;
    }
    void answer(Pending pending, Answer answer);
    LineCounts counts() const {
        return {arbiter.station_counters(), arbiter.counters().broadcasts, *line};
    }

    boost::asio::any_io_executor executor;
    std::unique_ptr<Machine> machine;
    Machine& arbiter;
    Rights rights;
    ClientAccounts clients;
    DepartedClients departed;
    Answers answers;
    line::Drive<Machine, State> drive;
    PoolMap<arbiter::Ticket, Pending> pending;
    /// A new line that replaces this one as soon as no reply is outstanding.
    struct Change {
        Settings settings;
        std::unique_ptr<line::Line> line;
        std::vector<std::shared_ptr<void>> far_ends;  ///< of the lines replaced so far
        bool posted = false;                          ///< change_line() is posted
    };
    std::optional<Change> change;
    Bytes last_write;  ///< the frame sent last, if it writes; else empty
    std::shared_ptr<bool> alive = std::make_shared<bool>(true);
    int calls = 0;               ///< clients' calls in progress
    std::uint64_t up_count = 0;  ///< how often the line came up
};

}  // namespace panelgate::bus
