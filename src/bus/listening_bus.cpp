#include "panelgate/bus/listening_bus.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>

#include "line_records.hpp"
#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/counters.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/rights.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tap/matcher.hpp"

namespace panelgate::bus {

/// Counters of the stations on a line with another master. Pure.
class HeardStations {
  public:
    using Wire = std::map<std::uint8_t, arbiter::StationCounters>;

    /// `offline_after`: timeouts in a row.
    HeardStations(const Stations& listed, int offline_after);
    /// Drops the wire counters of stations no longer listed.
    void apply(const Stations& listed, int offline_after);

    void count(const tap::Transaction& heard);
    void count(const tap::Frame& frame);

    Health health(std::uint8_t station) const;
    StationStatus status(std::uint8_t station, TimePoint now) const;
    /// Key 0: all unlisted stations.
    const Wire& wire() const { return wire_; }
    const arbiter::LineCounters& line() const { return line_; }

  private:
    struct One {
        HeardCounts counts;
        int timeouts_in_a_row = 0;  ///< until now
        bool failed = false;
        std::optional<TimePoint> last_success;
    };
    arbiter::StationCounters& wire_of(std::uint8_t station);
    void count_answer(One& one, const tap::Transaction& heard);
    void count_failure(One& one, const tap::Transaction& heard);

    int offline_after_ = 1;
    std::map<std::uint8_t, One> stations_;
    Wire wire_;
    arbiter::LineCounters line_;
};

HeardStations::HeardStations(const Stations& listed, int offline_after) {
    apply(listed, offline_after);
}

void HeardStations::apply(const Stations& listed, int offline_after) {
    offline_after_ = offline_after;
    Wire before = std::exchange(wire_, {});
    wire_[0] = std::move(before[0]);
    for (const auto& [id, station] : listed) wire_[id] = std::move(before[id]);
}

arbiter::StationCounters& HeardStations::wire_of(std::uint8_t station) {
    const auto listed = wire_.find(station);
    return listed == wire_.end() ? wire_[0] : listed->second;
}

void HeardStations::count(const tap::Transaction& heard) {
    line_.busy += heard.sent - heard.asked;
    if (heard.end == tap::End::unasked) {
        if (heard.station == 0) ++line_.broadcasts;
        return;
    }
    One& one = stations_[heard.station];
    if (heard.doubtful) ++one.counts.doubtful;
    if (heard.end == tap::End::answered) return count_answer(one, heard);
    if (!heard.doubtful) count_failure(one, heard);
}

void HeardStations::count_answer(One& one, const tap::Transaction& heard) {
    arbiter::StationCounters& wire = wire_of(heard.station);
    line_.busy += heard.ended - heard.sent;
    ++one.counts.requests;
    ++wire.symptoms.answered;
    if (const auto code = modbus::exception_of(heard.reply)) {
        ++one.counts.exceptions;
        ++wire.exceptions[*code];
    } else {
        ++one.counts.replies;
    }
    one.timeouts_in_a_row = 0;
    one.failed = false;
    wire.symptoms.mute_in_a_row = 0;
    one.last_success = heard.ended;
    if (heard.doubtful) return;
    const Duration think = std::max<Duration>(heard.replied - heard.sent, Duration::zero());
    one.counts.think = think;
    one.counts.longest_think = std::max(one.counts.longest_think, think);
    wire.turnaround.observe(think);
    wire.bus_transaction.observe(heard.ended - heard.asked);
}

namespace {

/// How a request failed whose station was heard.
std::uint64_t arbiter::Symptoms::* ending_of(const tap::Transaction& heard) {
    using arbiter::Symptoms;
    if (heard.end == tap::End::wrong) return &Symptoms::wrong;
    const auto expected = modbus::reply_length_from_request(heard.request);
    if (!expected || heard.damaged > *expected) return &Symptoms::damaged_long;
    return heard.damaged < *expected ? &Symptoms::damaged_short : &Symptoms::damaged_exact;
}

}  // namespace

void HeardStations::count_failure(One& one, const tap::Transaction& heard) {
    arbiter::StationCounters& wire = wire_of(heard.station);
    ++one.counts.requests;
    one.failed = true;
    if (heard.end == tap::End::damaged || heard.end == tap::End::wrong) {
        ++one.counts.damaged;
        ++(wire.symptoms.*ending_of(heard));
        one.timeouts_in_a_row = 0;
        wire.symptoms.mute_in_a_row = 0;
        return;
    }
    ++one.counts.timeouts;
    ++one.timeouts_in_a_row;
    ++wire.symptoms.silent;
    ++wire.symptoms.mute_in_a_row;
}

void HeardStations::count(const tap::Frame& frame) {
    arbiter::StationCounters& wire = wire_of(frame.station);
    if (frame.kind == FrameKind::damaged) {
        ++wire.damaged_frames;
    } else if (frame.kind == FrameKind::late) {
        ++wire.late_frames;
    } else if (frame.kind == FrameKind::copy || frame.kind == FrameKind::foreign) {
        ++wire.foreign_frames;
    } else {
        return;
    }
    wire.discarded_bytes += frame.bytes.size();
}

Health HeardStations::health(std::uint8_t station) const {
    const auto found = stations_.find(station);
    if (found == stations_.end() || found->second.counts.requests == 0) return Health::unknown;
    const One& one = found->second;
    if (one.timeouts_in_a_row >= offline_after_) return Health::offline;
    return one.failed ? Health::suspect : Health::heard;
}

StationStatus HeardStations::status(std::uint8_t station, TimePoint now) const {
    StationStatus status;
    status.state = health(station);
    const auto found = stations_.find(station);
    status.heard = found == stations_.end() ? HeardCounts{} : found->second.counts;
    if (found != stations_.end() && found->second.last_success)
        status.last_success = now - *found->second.last_success;
    return status;
}

namespace asio = boost::asio;

namespace {

tap::Settings tap_settings(const arbiter::Settings& line) {
    tap::Settings settings;
    settings.serial = line.serial;
    settings.hole = std::max(settings.hole, line.reply_hole);
    return settings;
}

std::string doubt_text(const tap::Transaction& made) {
    const std::string function = std::to_string(made.request.front());
    const std::string station = std::to_string(made.station);
    if (made.end == tap::End::answered)
        return "the reply to function " + function + " of station " + station +
               " may be to another request: its values are not taken";
    return "the request of function " + function + " to station " + station +
           " may be a reply whose request was not heard: it is not counted";
}

/// Outcome of a request between another master and a station.
Outcome outcome_of(const tap::Transaction& heard) {
    switch (heard.end) {
        case tap::End::answered:
            return modbus::exception_of(heard.reply) ? Outcome::exception : Outcome::ok;
        case tap::End::silent:
            return Outcome::timeout;
        case tap::End::damaged:
        case tap::End::wrong:
            return Outcome::damaged;
        case tap::End::unasked:
            return Outcome::ok;
    }
    std::abort();
}

TransactionEnd end_of(const tap::Transaction& made) {
    if (made.doubtful) return TransactionEnd::doubtful;
    switch (made.end) {
        case tap::End::answered:
            return modbus::exception_of(made.reply) ? TransactionEnd::exception
                                                    : TransactionEnd::ok;
        case tap::End::unasked:
            return TransactionEnd::ok;
        case tap::End::silent:
            return TransactionEnd::timeout;
        case tap::End::damaged:
            return TransactionEnd::damaged;
        case tap::End::wrong:
            return TransactionEnd::wrong;
    }
    std::abort();
}

/// For the request heard last.
arbiter::Exchange exchange_of(const tap::Transaction& made) {
    arbiter::Exchange exchange;
    exchange.end = end_of(made);
    exchange.station = made.station;
    exchange.granted = exchange.first_bit_out = made.asked;
    exchange.last_bit_out = made.sent;
    if (made.end == tap::End::answered) {
        exchange.first_byte_in = made.replied;
        exchange.last_byte_in = made.ended;
    }
    return exchange;
}

}  // namespace

/// Also the host of the matcher's drive.
struct ListeningBus::State final : public LineRecords, public line::Line::Events {
    State(const asio::any_io_executor& executor, rt::Clock& c, Settings s,
          std::unique_ptr<line::Line> l)
        : LineRecords(executor, c, std::move(s), std::move(l)),
          matcher(tap_settings(settings.arbiter)),
          heard(settings.stations, settings.arbiter.offline.after),
          drive(clock, *line, matcher, *this) {}

    void on_up() override;
    void on_down(const std::string& why) override;
    void on_bytes(ByteView bytes) override {
        drive.hear([this, bytes](TimePoint now) { matcher.on_rx(now, bytes); });
    }
    void on_deadline(TimePoint now) { matcher.on_deadline(now); }
    void settled(TimePoint now) {
        load.record(now, heard.line().busy);
        if (up) doctor.look(now, counts());
    }
    void act(tap::Frame& frame);
    void act(const tap::Transaction& made);
    void tell_health(std::uint8_t station) {
        if (up && settings.stations.contains(station))
            health_events.tell(station, heard.health(station));
    }
    void refuse(Request request, AnswerHandler handler);
    Refusal refusal(std::uint8_t station) const;
    LineCounts counts() const { return {heard.wire(), heard.line().broadcasts, *line}; }

    tap::Matcher matcher;  ///< assigns frames to requests
    HeardStations heard;
    line::Drive<tap::Matcher, State> drive;
};

void ListeningBus::State::on_up() {
    up = true;
    rt::log(rt::LogLevel::info, "line up",
            {{"line", settings.name}, {"device", settings.device}, {"mode", "listen"}});
    observe(settings, LineEvent{true, {}});
    drive.hear([this](TimePoint now) { doctor.begin(now, counts()); });
    for (const auto& [id, station] : settings.stations) tell_health(id);
}

void ListeningBus::State::on_down(const std::string& why) {
    take_down(why, [this] { drive.hear([this](TimePoint now) { matcher.on_line_down(now); }); });
}

void ListeningBus::State::act(tap::Frame& frame) {
    heard.count(frame);
    book.note({frame.at, frame.kind, std::move(frame.bytes)});
}

/// A doubtful request is not counted as a request.
void ListeningBus::State::act(const tap::Transaction& made) {
    heard.count(made);
    book.end(exchange_of(made));
    tell_health(made.station);
    if (made.doubtful) book.decide(made.ended, doubt_text(made));
    if (made.end == tap::End::answered || !made.doubtful) {
        const Outcome outcome = outcome_of(made);
        const Duration took = made.ended - made.asked;
        account.add(made.station, made.request[0], {}, outcome, took);
        const bool success = outcome == Outcome::ok && made.station != 0;
        if (success)
            account.counters().succeeded(made.station, wall_seconds_of(wall.at(made.ended)));
    }
    observe(settings, made);
}

Refusal ListeningBus::State::refusal(std::uint8_t station) const {
    return {settings.standby ? Rule::standby : Rule::listening,
            station == 0 ? std::string() : name_of(settings.stations, station),
            modbus::ExceptionCode::gateway_path_unavailable, settings.name};
}

void ListeningBus::State::refuse(Request request, AnswerHandler handler) {
    const std::uint8_t function = request.request.function();
    auto write = write_record_of(request);
    if (write) write->rule = label(refusal(request.station).rule);
    account.add(request.station, function, write, Outcome::refused, Duration::zero());
    Answer answer;
    answer.refusal = refusal(request.station);
    answer.pdu = answer_to(*answer.refusal, function);
    refusals.add({std::move(handler), std::move(answer)});
}

ListeningBus::ListeningBus(asio::any_io_executor executor, rt::Clock& clock, Settings settings,
                           std::unique_ptr<line::Line> line)
    : state_(std::make_unique<State>(executor, clock, std::move(settings), std::move(line))) {}

ListeningBus::~ListeningBus() { close(); }

void ListeningBus::start() { state_->line->start(*state_); }

void ListeningBus::stop() {
    state_->leave();
    close();
    state_->book.clear();
}

/// Nothing is observed any more: the observer may be gone.
void ListeningBus::close() {
    state_->up = false;
    state_->line->stop();
    state_->drive.rest();
}

/// No request waits here, so the line is replaced at once.
void ListeningBus::apply(Settings settings, std::unique_ptr<line::Line> line,
                         std::shared_ptr<void>) {
    State& state = *state_;
    state.health_events.on_change(settings.stations);
    if (line) {
        state.line->stop();
        if (state.up) state.on_down("its settings have changed, and it is being opened");
        state.drive.rest();
    }
    state.settings = std::move(settings);
    state.heard.apply(state.settings.stations, state.settings.arbiter.offline.after);
    state.account.apply();
    state.doctor.apply();
    if (!line) return;
    state.matcher = tap::Matcher(tap_settings(state.settings.arbiter));
    state.line = std::move(line);
    state.drive.use(*state.line);
    state.line->start(state);
}

void ListeningBus::transact(Request request, AnswerHandler handler) {
    state_->refuse(std::move(request), std::move(handler));
}

void ListeningBus::count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) {
    state_->account.add_refused(station, pdu, who);
}

void ListeningBus::cancel(ClientId client) { state_->names.forget(client); }

LineStatus ListeningBus::status() const {
    LineStatus status = state_->LineRecords::status(state_->counts());
    status.listens = true;
    return status;
}

StationStatus ListeningBus::station_status(std::uint8_t station) const {
    StationStatus status = state_->heard.status(station, state_->clock.now());
    if (!state_->up) status.state = Health::unknown;
    return status;
}

std::optional<Refusal> ListeningBus::write_refusal(std::uint8_t station) const {
    return state_->refusal(station);
}

LineRecords& ListeningBus::records() const { return *state_; }

LineReport ListeningBus::report() const {
    LineReport report = state_->LineRecords::report();
    report.wire = state_->heard.line();
    report.stations = state_->account.counters().report(
        state_->heard.wire(), [this](std::uint8_t station) -> RequestCounters::State {
            return {station_status(station).state};
        });
    return report;
}

}  // namespace panelgate::bus
