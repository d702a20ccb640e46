#include "panelgate/bus/bus.hpp"

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus_state.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

namespace asio = boost::asio;

namespace {

Settings with_explanations(Settings settings) {
    settings.arbiter.explain = true;
    return settings;
}

access::LineRules::Question question_of(const Request& request,
                                        const std::optional<modbus::Request>& sent) {
    return {.station = request.station,
            .asked = &request.request,
            .sent = sent ? &*sent : nullptr,
            .raw = request.raw};
}

PriorityClass priority_of(const Request& request) {
    if (request.poll) return PriorityClass::poll;
    return request.request.is_read() ? PriorityClass::read : PriorityClass::write;
}

}  // namespace

void Bus::State::on_up() {
    up = true;
    ++up_count;
    rt::log(rt::LogLevel::info, "line up", {{"line", settings.name}, {"device", settings.device}});
    observe(settings, LineEvent{true, {}});
    arbiter.set_lead(line->lead());
    arbiter.confirm_ends(line->unsent().has_value());
    drive.hear([this](TimePoint now) {
        arbiter.on_line_up(now);
        doctor.begin(now, counts());
    });
}

void Bus::State::on_down(const std::string& why) {
    take_down(why, [this] { drive.hear([this](TimePoint now) { arbiter.on_line_down(now); }); });
}

void Bus::State::on_bytes(ByteView bytes) {
    drive.hear([this, bytes](TimePoint now) {
        confirm_end(now);
        arbiter.on_rx(now, bytes);
    });
}

void Bus::State::transact(Request request, AnswerHandler handler) {
    const modbus::Request& what = request.request;
    Pending entry{std::move(handler), request.station, what.function(), clock.now()};
    entry.write = write_record_of(request);
    entry.client = request.client;
    clients.count_request(request.client);
    if (request.station == 0 ? !what.is_broadcastable() : what.is_never_answered())
        return refuse(std::move(entry), Fault::denied);
    auto other = translated(settings.stations, request.station, what);
    if (auto refusal = refusal_of(request, other)) {
        Result<Bytes> reply = answer_to(*refusal, what.function());
        return refuse(std::move(entry), std::move(reply), std::move(refusal));
    }
    const PriorityClass priority = priority_of(request);
    if (other) {
        entry.original_pdu = what.pdu();
        entry.sent_as = other->function();
        request.request = std::move(*other);
    }
    if (request.verbatim && has_any_length(settings.stations, request.station))
        request.request = request.request.with_any_length();
    arbiter::Job job{.station = request.station,
                     .request = std::move(request.request),
                     .client = request.client,
                     .host = request.who ? request.who->host : 0,
                     .priority = priority,
                     .asked_function = entry.sent_as == 0 ? std::uint8_t{0} : entry.function,
                     .within = request.within,
                     .search = request.search,
                     .who = std::move(request.who),
                     .raw = request.raw};
    drive.queue([&](TimePoint now) {
        const Result<arbiter::Ticket> ticket = arbiter.submit(now, std::move(job));
        if (!ticket) return refuse(std::move(entry), ticket.error());
        pending.emplace(*ticket, std::move(entry));
    });
}

/// Rules before the station's own rights, everywhere.
std::optional<Refusal> Bus::State::refusal_of(const Request& request,
                                              const std::optional<modbus::Request>& sent) const {
    if (auto refusal = judge(request.who, question_of(request, sent))) return refusal;
    if (auto refusal = rights.judge(request.station, request.request)) return refusal;
    if (request.request.is_read()) return std::nullopt;
    return unrecordable(settings, request.station);
}

std::optional<Refusal> Bus::State::judge(const WhoRef& who,
                                         const access::LineRules::Question& question) const {
    std::optional<Admission> now;
    const std::uint8_t id = question.station;
    if (settings.admit) now = settings.admit(who, id);
    if (!now) return rights.judge(who, question);
    std::string name = id == 0 ? std::string() : name_of(settings.stations, id);
    if (auto refusal = refusal_at_door(*now, question.acts(), std::move(name))) return refusal;
    return rights.judge(now->who, question);
}

void Bus::State::refuse(Pending entry, Result<Bytes> pdu, std::optional<Refusal> refusal) {
    Answer refused;
    refused.pdu = std::move(pdu);
    refused.refusal = std::move(refusal);
    answer(std::move(entry), std::move(refused));
}

void Bus::State::act(arbiter::Finish& finish) {
    const auto found = pending.find(finish.ticket);
    if (found == pending.end()) return;
    Pending entry = std::move(found->second);
    pending.erase(found);
    Answer result;
    result.pdu = std::move(finish.pdu);
    if (!result.pdu) tell_health(entry.station);  // a retry that expires has no Exchange
    if (entry.denial) result.refusal = std::move(*entry.denial);
    if (entry.sent_as != 0) {
        if (finish.transmitted)
            account.counters().translated(entry.station, entry.function, entry.sent_as);
        if (result.pdu) result.pdu = modbus::translated_back(entry.original_pdu, *result.pdu);
    }
    result.transmitted = finish.transmitted;
    result.shared = finish.shared;
    if (finish.transmitted) book.answered(finish.transactions.last(), clock.now());
    result.transactions = std::move(finish.transactions);
    if (finish.age) {
        result.source = Source::cache;
        result.age = *finish.age;
    }
    answer(std::move(entry), std::move(result));
}

void Bus::State::act(arbiter::StationEvent& event) {
    using Kind = arbiter::StationEvent::Kind;
    log_event(settings, event);
    if (event.kind != Kind::offline && event.kind != Kind::online) observe(settings, event);
    tell_health(event.station);
}

/// A write that gives a panel another address may be confirmed from there, which answers nothing
/// here (minimalmodbus#101): the value written is the address that answers.
void Bus::State::look_for_new_address(const arbiter::Note& note) {
    if (direction_of(note.kind) == FrameDirection::sent) {
        const bool writes = !modbus::is_pure_read(modbus::pdu_of(note.bytes));
        return last_write.assign(note.bytes.begin(),
                                 writes ? note.bytes.end() : note.bytes.begin());
    }
    if (note.kind != FrameKind::foreign || last_write.empty()) return;
    const ByteView asked = modbus::pdu_of(last_write);
    const std::uint8_t station = note.bytes[0];
    if (station == last_write[0] || asked.back() != station ||
        !modbus::answers(asked, modbus::pdu_of(note.bytes)))
        return;
    rt::log(rt::LogLevel::warn, "write answered by another address",
            {{"line", settings.name},
             {"station", name_of(settings.stations, last_write[0])},
             {"hint", "station " + std::to_string(station) +
                          " has answered with this very write: is that its new address?"}});
}

/// While the line is down take_down() has told all. Addresses of a search have no health.
void Bus::State::tell_health(std::uint8_t station) {
    const arbiter::StationHealth health = arbiter.health(station);
    const Stations& listed = change ? change->settings.stations : settings.stations;
    const bool is_known = listed.contains(station) || health.last_heard();
    if (up && is_known) health_events.tell(station, health.state());
}

/// A read that is our own last one was sent by another master where the line has no echo: two boxes
/// with the same configuration send the same reads.
bool Bus::State::is_foreign_request(const arbiter::Note& note) const {
    if (note.kind == FrameKind::foreign_request) return !note.bytes.empty();
    return note.kind == FrameKind::echo && arbiter.echo() != EchoState::unknown &&
           note.bytes.size() > 1 && modbus::reads_table(note.bytes[1]);
}

void Bus::State::on_deadline(TimePoint now) {
    confirm_end(now);
    check_delivery(now);
    arbiter.on_deadline(now);
}

/// A request that the far end has not accepted when its time is over must not be executed when the
/// transport recovers (P2), and its late reply must not answer another request (P1).
void Bus::State::check_delivery(TimePoint now) {
    if (up && arbiter.is_unheard(now) && line->undelivered())
        line->reset("what was sent is not taken: the way to the wire is blocked");
}

/// Counts every answer, then delivers it from the loop, never from inside a client's call.
void Bus::State::answer(Pending entry, Answer result) {
    const TimePoint now = clock.now();
    const Duration took = now - entry.arrived;
    const Outcome outcome = outcome_of(result);
    if (result.refusal && result.refusal->rule == Rule::denied) ++denials[result.refusal->why];
    if (entry.write) complete(*entry.write, result);
    account.add(entry.station, entry.function, std::move(entry.write), outcome, took);
    clients.count_outcome(entry.client, outcome, now);
    const bool success = result.pdu.has_value() && !modbus::exception_of(*result.pdu);
    if (success) account.counters().succeeded(entry.station, wall_seconds_of(wall.at(now)));
    if (!result.pdu && result.pdu.error() == Fault::line_down)
        result.why = up ? "its device is being closed" : why_down;
    const bool refused = !result.transmitted && result.source == Source::bus;
    Delivery delivery{std::move(entry.handler), std::move(result)};
    if (refused) {
        refusals.add(std::move(delivery));
    } else {
        answers.add(std::move(delivery), calls == 0);
    }
}

Bus::Bus(asio::any_io_executor executor, rt::Clock& clock, Settings settings,
         std::unique_ptr<line::Line> line)
    : state_(std::make_unique<State>(executor, clock, with_explanations(std::move(settings)),
                                     std::move(line))) {}

Bus::~Bus() { close(); }

void Bus::start() {
    state_->call([this] { state_->line->start(*state_); });
}

void Bus::stop() {
    state_->leave();
    close();
    state_->book.clear();
}

/// Nothing is observed any more: the observer may be gone.
void Bus::close() {
    state_->change.reset();
    state_->up = false;
    state_->call([this] {
        state_->line->stop();
        state_->drive.hear([this](TimePoint now) { state_->arbiter.on_line_down(now); });
        state_->drive.rest();
    });
}

void Bus::apply(Settings settings, std::unique_ptr<line::Line> line,
                std::shared_ptr<void> far_end) {
    state_->call([&] {
        state_->apply(with_explanations(std::move(settings)), std::move(line), std::move(far_end));
    });
}

void Bus::judge_waiting() {
    state_->call([&] { state_->drive.tell([&](TimePoint now) { state_->deny_forbidden(now); }); });
}

void Bus::transact(Request request, AnswerHandler handler) {
    state_->call([&] { state_->transact(std::move(request), std::move(handler)); });
}

void Bus::count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) {
    // A broadcast over several lines is judged before it is submitted to any of them. A request
    // that could have been submitted was refused by the access of the listener or the station.
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    std::string rule;
    if (station == 0 && request) {
        const auto denial = state_->rights.judge(who, {.station = station, .asked = &*request});
        if (denial) rule = denial->why;
        if (denial) ++state_->denials[rule];
    }
    if (rule.empty() && station == 0 && unrecordable(state_->settings, station))
        rule = label(Rule::unrecorded);
    if (rule.empty() && request) rule = label(Rule::read_only);
    state_->account.add_refused(station, pdu, who, std::move(rule));
}

/// Keeps a disconnecting client's use of the line in the list of clients.
void Bus::State::record_departure(ClientId client) {
    const auto used = arbiter.shares().of(client);
    const auto totals = clients.of(client);
    if (used.transactions == 0 && totals.requests == 0) return;
    departed.leave(clock.now(), names.of(client), used, totals);
}

void Bus::cancel(ClientId client) {
    state_->record_departure(client);
    state_->call(
        [&] { state_->drive.tell([&](TimePoint now) { state_->arbiter.cancel(now, client); }); });
    state_->clients.forget(client);
    state_->names.forget(client);
}

LineStatus Bus::status() const {
    LineStatus status = state_->LineRecords::status(state_->counts());
    status.queue_depth = state_->arbiter.queue_depth();
    status.echo = state_->arbiter.echo();
    return status;
}

std::vector<ClientShare> Bus::clients() const {
    const Machine& arbiter = state_->arbiter;
    return client_shares({arbiter.shares(), state_->names, state_->clients, state_->departed,
                          arbiter.counters().busy},
                         state_->clock.now());
}

StationStatus Bus::station_status(std::uint8_t station) const {
    const arbiter::StationHealth health = state_->arbiter.health(station);
    StationStatus status;
    status.state = health.state();
    status.condition = state_->arbiter.condition(station);
    status.returns = health.returns() + state_->up_count;
    const TimePoint now = state_->clock.now();
    if (const auto last = health.last_success()) status.last_success = now - *last;
    if (const auto last = health.last_heard()) status.last_reply = now - *last;
    return status;
}

OutcomeCounts Bus::outcomes(std::uint8_t station) const {
    return state_->account.counters().outcomes(station);
}

std::optional<Refusal> Bus::refusal_of(const Request& request) const {
    const auto sent = translated(state_->settings.stations, request.station, request.request);
    return state_->refusal_of(request, sent);
}

std::optional<Refusal> Bus::write_refusal(std::uint8_t station) const {
    auto refusal = state_->rights.judge_write(station);
    return refusal ? refusal : unrecordable(state_->settings, station);
}

LineRecords& Bus::records() const { return *state_; }

TimePoint Bus::clear_at() const { return state_->arbiter.clear_at(state_->clock.now()); }

void Bus::rest_until(TimePoint until) { state_->arbiter.rest_until(until); }

bool Bus::idle() const { return state_->arbiter.idle(); }

LineReport Bus::report() const {
    LineReport report = state_->LineRecords::report();
    report.queue_depth = state_->arbiter.queue_depth();
    report.wire = state_->arbiter.counters();
    report.stations = state_->account.counters().report(state_->arbiter);
    return report;
}

}  // namespace panelgate::bus
