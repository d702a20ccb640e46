#include "panelgate/arbiter/ledger.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

namespace {

FrameKind kind_of(Ledger::Part what) {
    switch (what) {
        case Ledger::Part::damaged:
            return FrameKind::damaged;
        case Ledger::Part::echo:
            return FrameKind::echo;
        case Ledger::Part::request:
            return FrameKind::foreign_request;
        case Ledger::Part::late:
            return FrameKind::late;
        case Ledger::Part::copy:
            return FrameKind::copy;
        case Ledger::Part::broadcast_reply:
        case Ledger::Part::unasked:
        case Ledger::Part::unknown:
            return FrameKind::foreign;
    }
    std::abort();
}

FrameKind kind_of(const Group& group) {
    if (group.learns_for != 0 || !group.confirms.empty()) return FrameKind::learn_echo;
    if (group.station == kBroadcast) return FrameKind::broadcast;
    if (group.probe) return FrameKind::probe;
    return group.attempts > 1 ? FrameKind::retry : FrameKind::request;
}

}  // namespace

Ledger::Ledger(const Settings& settings) { apply(settings); }

void Ledger::apply(const Settings& settings) {
    explain_ = settings.explain;
    orders_ = crc_orders(settings);
    std::map<std::uint8_t, StationCounters> before = std::exchange(stations_, {});
    stations_[kUnlisted] = std::move(before[kUnlisted]);
    for (const StationSettings& station : settings.stations)
        stations_[station.id] = std::move(before[station.id]);
}

std::optional<Action> Ledger::poll() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
}

StationCounters& Ledger::of(std::uint8_t station) {
    const auto found = stations_.find(station);
    return found == stations_.end() ? stations_[kUnlisted] : found->second;
}

void Ledger::transmit(TimePoint now, const Attempt& attempt, Bytes adu, Bytes wire, Reason why) {
    const Group& group = attempt.group();
    if (group.attempts > 1) ++of(group.station).retries;
    if (group.station == kBroadcast) ++line_.broadcasts;
    actions_.push_back(
        Note{now, kind_of(group), std::move(adu), std::move(why), group.transaction});
    actions_.push_back(Transmit{std::move(wire)});
}

void Ledger::finish(const Job& job, Result<Bytes> pdu, bool shared) {
    actions_.push_back(
        Finish{job.ticket, std::move(pdu), job.attempts > 0, shared, {}, job.transactions});
}

void Ledger::finish_from_memory(Ticket ticket, Bytes pdu, Duration age) {
    Finish answer;
    answer.ticket = ticket;
    answer.pdu = std::move(pdu);
    answer.age = age;
    actions_.push_back(std::move(answer));
}

void Ledger::tell(const Attempt& attempt, TransactionEnd end) {
    if (!explain_) return;
    const Group& group = attempt.group();
    const Attempt::Timing& timing = attempt.timing();
    Exchange told;
    told.transaction = group.transaction;
    told.end = end;
    told.station = group.station;
    if (!group.jobs.empty()) told.arrived = group.jobs.front().arrived;
    told.granted = timing.started;
    told.first_bit_out = timing.sent - timing.leaving;
    told.last_bit_out = timing.sent;
    if (attempt.heard()) {
        told.first_byte_in = attempt.first_byte();
        told.last_byte_in = attempt.last_byte();
    }
    actions_.push_back(told);
}

void Ledger::event(StationEvent::Kind kind, std::uint8_t station, Duration by) {
    actions_.push_back(StationEvent{kind, station, by});
}

void Ledger::written(const Group& group, bool ended) {
    if (group.request.is_read()) return;
    const Client client = group.jobs.empty() ? 0 : group.jobs.front().client;
    actions_.push_back(Written{group.station, group.request.access().write, ended, client});
}

void Ledger::on_started(TimePoint now, const Job& job) {
    line_.queue_wait[static_cast<std::size_t>(job.priority)].observe(now - job.arrived);
}

void Ledger::on_ended(TimePoint now, const Attempt& attempt, Duration gap) {
    const Attempt::Timing& timing = attempt.timing();
    const TimePoint longest = attempt.give_up() + timing.longest_reply;
    const TimePoint end = std::max({timing.sent, attempt.last_byte(), std::min(now, longest)});
    const Duration busy = end - timing.started + gap;
    line_.busy += busy;
    const Jobs& jobs = attempt.group().jobs;
    for (const Job& job : jobs) {
        if (!job.gone) shares_.add(job.client, busy / static_cast<int>(jobs.size()));
    }
}

void Ledger::on_echo_mismatch(TimePoint now, std::uint8_t station) {
    constexpr Duration kPause = 10s;
    ++of(station).echo_mismatches;
    if (told_collision_ && now < *told_collision_ + kPause) return;
    told_collision_ = now;
    event(StationEvent::Kind::collision, station);
}

void Ledger::on_stray(TimePoint now, const modbus::Unused& part, Part what, std::uint8_t asked,
                      Duration lateness) {
    const bool known = what == Part::late || what == Part::copy || what == Part::unasked;
    const bool nobodys = what == Part::unasked || what == Part::unknown || what == Part::request ||
                         what == Part::broadcast_reply;
    of(known ? part.station : asked).discarded_bytes += part.bytes.size();
    if (what == Part::late) ++of(part.station).late_frames;
    if (nobodys) ++of(asked).foreign_frames;
    count_stray(part, what, asked, lateness);
    actions_.push_back(Note{now, kind_of(what), part.bytes, {}});
}

}  // namespace panelgate::arbiter
