#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "account.hpp"
#include "answers.hpp"
#include "client_accounts.hpp"
#include "departed_clients.hpp"
#include "line_doctor.hpp"
#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/load_meter.hpp"
#include "panelgate/line/drive.hpp"
#include "refusals.hpp"
#include "trace_book.hpp"
#include "wall.hpp"

namespace panelgate::bus {

/// Also the host of the arbiter's drive.
struct Bus::State final : public line::Line::Events {
    struct Pending {
        AnswerHandler handler;
        std::uint8_t station = 0;
        std::uint8_t function = 0;
        TimePoint arrived;
        std::optional<Deed> deed{};
        Bytes asked{};             ///< of a request that is translated: what its client wants
        std::uint8_t sent_as = 0;  ///< ... and its function on the wire; 0: the one asked
        ClientId client = 0;
    };

    State(boost::asio::any_io_executor e, rt::Clock& c, Settings s, std::unique_ptr<line::Line> l)
        : executor(std::move(e)),
          clock(c),
          settings(std::move(s)),
          line(std::move(l)),
          arbiter(settings.arbiter),
          rights(settings.stations),
          account(settings),
          departed(settings.clients),
          doctor(settings),
          load(c.now()),
          refusals(executor, clock),
          wall(clock),
          book(settings, wall),
          answers(executor),
          drive(clock, *line, arbiter, *this) {}

    void on_up() override;
    void on_down(const std::string& why) override;
    void on_bytes(ByteView bytes) override;

    void apply(Settings next, std::unique_ptr<line::Line> other, std::shared_ptr<void> far_end);
    void take(Settings next);
    /// What has waited since before a change and may not be written any more is refused (P2).
    void deny_what_is_forbidden(TimePoint now);
    void change_soon();
    void change_line();
    void transact(Request request, AnswerHandler handler);
    void part(ClientId client);
    void refuse(Pending pending, Result<Bytes> pdu, std::optional<Refusal> refusal = {});
    void act(arbiter::Transmit& transmit) {
        line->write(transmit.adu);
        arbiter.set_latency(line->latency());
    }
    void act(arbiter::Finish& finish);
    void act(arbiter::Note& note) { book.note(std::move(note)); }
    void act(const arbiter::Exchange& exchange) { book.end(exchange); }
    void act(arbiter::Decision& decision) { book.decide(decision.at, std::move(decision.text)); }
    void act(arbiter::StationEvent& event);
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
        if (calls == 0) answers.hand_over();
        change_soon();
    }
    /// Somebody calls: whatever it leads to, nobody is answered before it ends.
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
    rt::Clock& clock;
    Settings settings;
    std::unique_ptr<line::Line> line;
    arbiter::Arbiter arbiter;
    Rights rights;
    Account account;
    ClientAccounts clients;
    DepartedClients departed;
    LineDoctor doctor;
    LoadMeter load;
    Refusals refusals;
    Wall wall;
    TraceBook book;
    Answers answers;
    line::Drive<arbiter::Arbiter, State> drive;
    PoolMap<arbiter::Ticket, Pending> pending;
    /// Another line, to which this one changes as soon as it waits for no reply.
    struct Change {
        Settings settings;
        std::unique_ptr<line::Line> line;
        std::vector<std::shared_ptr<void>> far_ends;  ///< of the lines before
        bool due = false;                             ///< it is posted
    };
    std::optional<Change> change;
    std::shared_ptr<bool> alive = std::make_shared<bool>(true);
    int calls = 0;  ///< of those who ask, under way
    bool up = false;
    std::uint64_t ups = 0;  ///< how often the line came up
    std::string why_down = "not opened yet";
};

}  // namespace panelgate::bus
