#include "panelgate/ethernet/ethernet.hpp"

#include <algorithm>
#include <iterator>
#include <variant>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::ethernet {

using arbiter::Attempt;
using arbiter::Decision;
using arbiter::Group;
using arbiter::Job;
using arbiter::kBroadcast;
using arbiter::Station;
using arbiter::StationEvent;
using arbiter::Ticket;
using arbiter::Verdict;

namespace {

constexpr std::size_t kPast = 64;  ///< requests without a reply that are remembered

/// A far gateway's own 0A and 0B (AP V1.1b3, 7): no unit has answered, as on a serial line.
bool says_nobody_answered(const Bytes& pdu) {
    using enum modbus::ExceptionCode;
    const auto code = modbus::exception_of(pdu);
    return code && (*code == static_cast<std::uint8_t>(gateway_path_unavailable) ||
                    *code == static_cast<std::uint8_t>(gateway_target_failed));
}

}  // namespace

Ethernet::Ethernet(arbiter::Settings settings) : Desk(std::move(settings)) {}

// Requests that wait

Result<Ticket> Ethernet::submit(TimePoint now, Job job) {
    const bool has_open = std::ranges::any_of(flights_, [&](const Flight& flight) {
        return flight.attempt.group().has(job.client, job.station);
    });
    if (auto answered = answer_at_once(now, job, has_open)) return *answered;
    const Result<Ticket> ticket = enqueue(now, std::move(job));
    if (ticket) step(now);
    return ticket;
}

void Ethernet::deny(TimePoint now, const arbiter::JobQueue::Test& match) {
    deny_waiting(match);
    for (Flight& flight : flights_)
        for (Job& job : flight.attempt.group().jobs) job.barred = job.barred || match(job);
    step(now);
}

void Ethernet::cancel(TimePoint now, arbiter::Client client) {
    cancel_waiting(client);
    for (Flight& flight : flights_) flight.attempt.group().on_client_gone(client);
    step(now);
}

void Ethernet::expire(TimePoint now) {
    for (Flight& flight : flights_)
        for (const Job& job : flight.attempt.group().expire(now))
            outbox_.finish(job, Fault::timeout);
    expire_waiting(now);
}

// The connection

void Ethernet::forget_line(bool keeps) {
    up_ = resetting_ = false;
    suspended_ = keeps;
    stations_.on_line_down();
    memory_.clear();
    past_.clear();
}

void Ethernet::on_line_up(TimePoint now) {
    up_ = true;
    suspended_ = resetting_ = false;
    framer_ = {};
    stations_.on_opened(now);
    quiet_.on_open(now);
    quiet_.rest_until(now + settings_.connect_pause);
    step(now);
}

/// Queued requests stay queued if this object has asked for the new connection.
void Ethernet::on_line_down(TimePoint now) {
    const bool keeps = resetting_;
    forget_line(keeps);
    while (!flights_.empty()) {
        const Attempt attempt = land(now, flights_.begin());
        outbox_.report(attempt, TransactionEnd::line_down);
        for (const Job& job : attempt.group().jobs) outbox_.finish(job, Fault::line_lost);
    }
    if (!keeps) clear_waiting();
}

// What is sent

void Ethernet::step(TimePoint now) {
    now_ = now;
    for (std::size_t i = 0; i < flights_.size();) {
        const bool over = now >= flights_[i].attempt.give_up();
        if (over)
            fail(now, flights_.begin() + static_cast<std::ptrdiff_t>(i), Verdict::silent);
        else
            ++i;
    }
    expire(now);
    while (up_ && !suspended_ && !resetting_ && flights_.size() < settings_.in_flight) {
        auto group = schedule_.next(
            now, stations_, quiet_, echo_,
            [this](std::uint8_t station, bool read) { return may_start(station, read); });
        if (!group) break;
        start(now, std::move(*group));
    }
}

/// Several reads of a station may be on their way, if its last one was answered. A write is alone,
/// and no further read passes a write that waits for reads to come back.
bool Ethernet::may_start(std::uint8_t station, bool read) const {
    if (station == kBroadcast) return flights_.empty();
    const auto is_there = [station](const Flight& flight) {
        return flight.attempt.group().station == station;
    };
    if (std::ranges::none_of(flights_, is_there)) return true;
    const bool only_reads = std::ranges::all_of(flights_, [&](const Flight& flight) {
        return !is_there(flight) || flight.attempt.group().request.is_read();
    });
    const Station* const known = stations_.find(station);
    if (!read || !only_reads || known == nullptr || !known->answers_now(true)) return false;
    return !schedule_.backlog().queue().any_first(
        [station](const Job& job) { return job.station == station && !job.request.is_read(); });
}

Attempt Ethernet::make_attempt(TimePoint now, Group group, const Bytes& adu) const {
    Attempt::Timing timing = Attempt::timing_of(settings_, now, adu.size(), {});
    if (const Station* const station = stations_.find(group.station)) {
        const bool adapts = group.request.is_read() && !group.silent && !group.probe;
        timing.patience = latency_ + (adapts ? station->response_timeout()
                                             : station->settings().response_timeout);
    }
    return {std::move(group),
            timing,
            arbiter::EchoFilter(adu, arbiter::EchoFilter::Expect::nothing),
            {}};
}

void Ethernet::start(TimePoint now, Group group) {
    const Bytes adu = modbus::encode_adu(group.station, group.request.pdu());
    const Bytes wire = modbus::encode_mbap(++last_id_, group.station, group.request.pdu());
    begin(now, group);
    const arbiter::Reason why = reason_of(now, group, schedule_.backlog().queue());
    flights_.push_back({last_id_, make_attempt(now, std::move(group), adu)});
    outbox_.transmit(now, flights_.back().attempt, adu, wire, why);
    if (!flights_.back().attempt.is_broadcast()) return;
    // Nobody answers a broadcast (serial line V1.02, 2.1).
    const Attempt attempt = land(now, std::prev(flights_.end()));
    outbox_.report(attempt, TransactionEnd::ok);
    for (const Job& job : attempt.group().jobs)
        outbox_.finish(job, modbus::normal_write_reply(job.request.pdu()));
}

// What is heard

void Ethernet::on_rx(TimePoint now, ByteView bytes) {
    if (!up_ || resetting_) return;
    framer_.feed(bytes);
    while (const auto event = framer_.next()) {
        if (const auto* adu = std::get_if<modbus::Adu>(&*event)) take(now, *adu);
        if (!std::holds_alternative<modbus::Broken>(*event)) continue;
        resetting_ = true;
        outbox_.reset("what the device sends is no Modbus/TCP");
        return;
    }
    step(now);
}

void Ethernet::take(TimePoint now, const modbus::Adu& reply) {
    const auto flight = std::ranges::find(flights_, reply.transaction, &Flight::id);
    const bool is_own = flight != flights_.end() && flight->attempt.group().station == reply.unit;
    if (!is_own) return take_other(now, reply);
    Attempt& attempt = flight->attempt;
    const modbus::Request& request = attempt.group().request;
    if (says_nobody_answered(reply.pdu)) return fail(now, flight, Verdict::silent);
    const bool answers = modbus::answers(request.pdu(), reply.pdu, request.byte_count());
    attempt.on_rx(now, modbus::encode_adu(reply.unit, reply.pdu));
    if (answers) return settle(now, flight, reply.pdu);
    attempt.on_wrong(true, modbus::exception_of(reply.pdu).has_value());
    fail(now, flight, Verdict::wrong);
}

/// A reply that came late, twice, or unasked.
void Ethernet::take_other(TimePoint now, const modbus::Adu& reply) {
    const auto past = std::ranges::find(past_, reply.transaction, &Past::id);
    const bool late = past != past_.end() && past->station == reply.unit;
    const modbus::Unused part{modbus::Unused::Kind::own, reply.unit,
                              modbus::encode_adu(reply.unit, reply.pdu)};
    const auto done = late ? arbiter::Done::late : arbiter::Done::nobodys;
    Duration lateness{};
    if (late) {
        Station& station = stations_.of(reply.unit);
        lateness = std::max(now - past->sent - station.settings().response_timeout, Duration{});
        past_.erase(past);
        if (station.on_late(now, lateness)) {
            stations_.on_recovery();
            outbox_.event(StationEvent::Kind::online, reply.unit);
        }
        outbox_.event(StationEvent::Kind::late, reply.unit, lateness);
    }
    outbox_.on_unsolicited(now, part, done, reply.unit, !flights_.empty(), lateness);
}

// Ends of attempts

void Ethernet::count(TimePoint now, const Attempt& attempt) {
    // Requests on their way at the same time keep the line busy once.
    const TimePoint started = attempt.timing().started;
    const TimePoint from = std::min(std::max(started, counted_), now);
    outbox_.on_ended(now, attempt, started - from);
    counted_ = now;
}

Attempt Ethernet::land(TimePoint now, Flights::iterator flight) {
    Attempt attempt = std::move(flight->attempt);
    flights_.erase(flight);
    count(now, attempt);
    outbox_.written(attempt.group(), true);
    return attempt;
}

void Ethernet::settle(TimePoint now, Flights::iterator flight, const Bytes& reply) {
    Attempt attempt = land(now, flight);
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    const Condition before = station.condition();
    const bool refused = modbus::exception_of(reply).has_value();
    const Duration needed = now - attempt.timing().sent;
    const Station::Replied replied = station.on_reply(now, attempt, refused, needed);
    stations_.on_reply(now, group.silent);
    if (replied.back) stations_.on_recovery();
    explain_condition(now, group.station, before);
    outbox_.on_answered(now, attempt, reply, replied);
    outbox_.report(attempt, refused ? TransactionEnd::exception : TransactionEnd::ok);
    hand_on(group, reply);
}

void Ethernet::fail(TimePoint now, Flights::iterator flight, Verdict verdict) {
    const std::uint16_t id = flight->id;
    Attempt attempt = land(now, flight);
    outbox_.on_failed(attempt, verdict);
    outbox_.report(attempt, end_of(verdict));
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    const Condition before = station.condition();
    const Duration cost = now - attempt.timing().started;
    if (verdict == Verdict::silent) past_.push_back({id, group.station, attempt.timing().sent});
    if (past_.size() > kPast) past_.pop_front();
    station.on_failed(now, attempt, verdict, cost, false);
    stations_.on_failed(now, group.station, group.request.is_read(), cost);
    group.silent = verdict == Verdict::silent;
    end(now, group, verdict, stations_.affords_retry(now, station, false));
    explain_condition(now, station.id(), before);
}

void Ethernet::end(TimePoint now, Group& group, Verdict verdict, bool affordable) {
    for (const Job& job : take_if(group.jobs, [](const Job& one) { return one.barred; }))
        outbox_.finish(job, job.gone ? Fault::cancelled : Fault::timeout);
    if (group.in_time(now) && affordable && stations_.of(group.station).may_retry(group) &&
        !schedule_.backlog().has_retry(group.station)) {
        schedule_.retry(std::move(group));
    } else if (group.joined()) {
        give_back(group);
    } else {
        give_up(now, group, fault_of(verdict));
    }
}

// For the driver

bool Ethernet::is_unheard(TimePoint now) const {
    return std::ranges::any_of(
        flights_, [now](const Flight& flight) { return now >= flight.attempt.give_up(); });
}

bool Ethernet::idle() const {
    return schedule_.backlog().empty() && std::ranges::all_of(flights_, [](const Flight& flight) {
               return flight.attempt.group().jobs.empty();
           });
}

/// While requests are on their way, their ends decide when the next one may start.
std::optional<TimePoint> Ethernet::next_deadline() const {
    std::optional<TimePoint> next = schedule_.backlog().first_expiry();
    const auto earlier = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
    for (const Flight& flight : flights_) {
        earlier(flight.attempt.give_up());
        for (const Job& job : flight.attempt.group().jobs) earlier(job.deadline);
    }
    if (!flights_.empty() || !up_ || suspended_ || resetting_) return next;
    if (const auto start = schedule_.next_start(now_, stations_, quiet_)) earlier(*start);
    return next;
}

}  // namespace panelgate::ethernet
