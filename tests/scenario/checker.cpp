// What may be answered.

#include "checker.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "support/read_span.hpp"

namespace panelgate::scenario {

Checker::Checker(const Plan& plan)
    : plan_(plan),
      settings_(plan_.settings),
      calm_(plan.is_calm()),
      echoes_(plan.line.echo || plan.line.echo_writes || plan.line.partial_echo > 0 ||
              std::ranges::any_of(plan.panels,
                                  [](const PanelPlan& p) { return p.repeats_request > 0; })),
      watch_(plan_),
      costs_(plan_, watch_) {
    for (const arbiter::StationSettings& station : settings_.stations) {
        if (station.retry_writes) repeat_writes_.insert(station.id);
    }
}

void Checker::fail(std::string what) {
    if (violation_.empty()) violation_ = std::move(what);
}

/// No client may get this: in the world of a limit it is counted.
void Checker::fail_value(std::string what) {
    if (plan_.limit == Limit::none) return fail(std::move(what));
    ++wrong_values_;
    if (wrong_value_.empty()) wrong_value_ = std::move(what);
}

Duration Checker::gap() const { return silent_interval(settings_.serial); }

void Checker::on_accepted(TimePoint now, arbiter::Ticket ticket, const arbiter::Job& job) {
    if (ticket <= last_ticket_) fail("P3: a ticket was given twice");
    last_ticket_ = ticket;
    came_ = true;
    const bool joins = joins_attempt(now, job);
    const Open open{.job = job,
                    .submitted = now,
                    .served = truth_.served(job.station),
                    .turn = turns_,
                    .write = !job.request.is_read(),
                    .sent = joins,
                    .span = test::read_span(job.station, job.request.pdu())};
    open_.insert_or_assign(ticket, open);
    displaced_ = false;
    Client& client = clients_[job.client];
    ++client.accepted;
    ++client.open;
    if (open.write) open_writes_[key_of(job.station, job.request.pdu())] = ticket;
}

void Checker::on_refused(TimePoint now, const arbiter::Job& job, Fault fault) {
    const Client& client = clients_[job.client];
    // A late reply is told from what may follow it by a silence.
    constexpr Duration kSilence = 50ms;
    const bool told = noisy_since_ > replied_[job.station] || now > heard_until_ + kSilence;
    if (fault == Fault::offline && told && watch_.is_good(job.station, now - kSilence))
        fail("P4: a good station was refused as offline: " + std::to_string(job.station));
    if (fault != Fault::busy) return;
    if (client.polite) fail("P9: a polite client was refused");
    const bool equal =
        client.open == 0 && job.request.is_read() && settings_.share_reads &&
        job.station != kBroadcast && std::ranges::any_of(open_, [&](const auto& entry) {
            const Open& o = entry.second;
            return !o.sent && !o.gone && o.job.station == job.station &&
                   o.job.request.pdu() == job.request.pdu() && o.job.priority == job.priority;
        });
    if (equal) fail("P6: a read was refused that one which waits would have answered");
}

void Checker::on_client(arbiter::Client id, const ClientPlan& plan) {
    const auto can_fail = [&](std::uint8_t station) {
        const auto panel = std::ranges::find(plan_.panels, station, &PanelPlan::id);
        return panel == plan_.panels.end() || panel->dead || panel->flapping > Duration::zero() ||
               panel->reboots > Duration::zero() || panel->never_right();
    };
    Client& client = clients_[id];
    client.healthy = !plan.scans && std::ranges::none_of(plan.stations, can_fail);
    client.polite = plan.polite;
    client.single = plan.in_flight == 1;
}

void Checker::on_client_gone(arbiter::Client client) {
    clients_.erase(client);
    for (auto& [ticket, open] : open_) {
        if (open.job.client != client) continue;
        open.gone = true;
        if (open.write) closed_writes_.insert(key_of(open.job.station, open.job.request.pdu()));
    }
}

void Checker::on_finish(TimePoint now, const arbiter::Finish& finish) {
    const auto found = open_.find(finish.ticket);
    if (found == open_.end()) return fail("P3: answered twice, or what nobody asked");
    const Open open = std::move(found->second);
    open_.erase(found);
    if (const auto client = clients_.find(open.job.client); client != clients_.end()) {
        --client->second.open;
        if (!finish.pdu && (watch_.is_silent(open.job.station) || now < rests_for(open)))
            client->second.held_until = now;
    }
    check_in_time(now, open, finish);
    // Who was sent before, in a joined read, is told so when it has to go. Not all that look as if
    // they went along with a frame were: what was split before goes alone.
    const auto is = [&](Fault fault) { return !finish.pdu && finish.pdu.error() == fault; };
    displaced_ = displaced_ || is(Fault::busy) || (open.sent && is(Fault::timeout));
    if (open.write) {
        const std::string key = key_of(open.job.station, open.job.request.pdu());
        closed_writes_.insert(key);
        open_writes_.erase(key);
        if (finish.transmitted != written_.contains(key))
            fail("P2: the answer to a write is wrong about its transmission");
    }
    if (!open.gone && open.job.station != plan_.odd) waits_.push_back(now - open.submitted);
    if (finish.pdu) {
        if (!finish.age) mark_answered(open.job.station);
        check_reply(now, open, finish);
    } else {
        check_fault(now, open, finish.pdu.error());
    }
}

/// While nobody called it, it could not answer: then a fault at once, never a value.
void Checker::check_in_time(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const TimePoint deadline = open.submitted + settings_.queue.deadline;
    if (now <= deadline) return;
    const bool slept = now == resumed_ && deadline >= paused_from_;
    if (!slept || (finish.pdu && !open.gone)) fail("P3: answered after its deadline");
}

/// A sound panel's requests do not fail, unless something hit them.
void Checker::check_fault(TimePoint now, const Open& open, Fault fault) {
    const std::uint8_t station = open.job.station;
    if (open.gone || station == kBroadcast || !watch_.is_good(station, open.submitted)) return;
    // What came back could be the echo, not the reply.
    if (open.write && echoes_) return;
    const bool at_deadline = now >= open.submitted + settings_.queue.deadline - 500ms;
    const bool polite = clients_[open.job.client].polite;
    if (calm_ && last_transmit_ < open.submitted && fault != Fault::busy)
        return fail("P5: nothing was sent while a request waited until its end");
    if (polite)
        return fail("P9: a polite client's request was answered: " + std::string(label(fault)));
    // What refuses it, or the read that it rides in, may refuse what is still owed: nobody's answer
    // (P1).
    const bool refused = (truth_.refused(station, open.job.request.pdu(), open.submitted) ||
                          truth_.refused(station, asked_[station], open.submitted)) &&
                         watch_.rests_until(station) > open.submitted;
    const bool failed =
        was_heard(fault) || fault == Fault::offline || (fault == Fault::timeout && !at_deadline);
    if (failed && !refused)
        fail("P4: a sound panel's request failed: " + std::string(label(fault)));
}

void Checker::check_reply(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const Bytes& reply = *finish.pdu;
    if (modbus::exception_of(reply)) {
        const Bytes& asked = open.job.request.pdu();
        constexpr std::uint8_t kBusy = 6;
        if (reply[1] == kBusy) announced_[{open.job.station, asked[0]}] = owed_until();
        const bool said = truth_.refused(open.job.station, asked, open.submitted);
        if (!said && !is_luck(heard_for(open, reply)))
            fail_value("P1: an exception that the station did not send to this request");
        return;
    }
    ++good_;
    ++clients_[open.job.client].good;
    if (open.write) return check_write(now, open, reply);
    check_values(now, open, finish);
}

void Checker::check_write(TimePoint now, const Open& open, const Bytes& reply) {
    if (open.job.station == kBroadcast) return;
    const auto done = truth_.executed(open.job.station, open.job.request.pdu());
    // The start of our own frame comes back, and its last byte is what somebody makes of a reply.
    if ((!done || *done > now) && is_luck(heard_for(open, reply))) return;
    const bool is_late = !done || *done > now;
    if (is_late && plan_.limit != Limit::none)
        return too_soon_.push_back(key_of(open.job.station, open.job.request.pdu()));
    if (is_late && !is_behind_first_copy(now, open.job.station))
        return fail("P8: a write was confirmed that no station executed");
    if (!done) return;
    clients_[open.job.client].own_write[open.job.station] = *done;
}

void Checker::check_values(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const Bytes& reply = *finish.pdu;
    const ByteView pdu = open.job.request.pdu();
    const std::uint16_t first = word(pdu, 1);
    const std::uint16_t count = word(pdu, 3);
    if (reply.size() != 2 + std::size_t{2} * count || reply[0] != pdu[0])
        return fail_value("P1: a reply of another length or function");
    const auto client = clients_.find(open.job.client);
    TimePoint since = finish.age ? TimePoint{} : open.submitted;
    if (client != clients_.end()) {
        const auto own = client->second.own_write.find(open.job.station);
        if (own != client->second.own_write.end()) since = std::max(since, own->second);
    }
    const Truth::Read read{open.job.station, pdu[0], now, since, open.served, finish.age};
    for (std::uint16_t i = 0; i < count; ++i) {
        const std::uint16_t value = word(reply, 2 + std::size_t{2} * i);
        const char* fault = truth_.fault_of(read, static_cast<std::uint16_t>(first + i), value);
        if (fault == nullptr) continue;
        if (is_behind_first_copy(now, open.job.station)) return;
        if (is_luck(heard_for(open, reply))) return;
        return fail_value(fault);
    }
}

/// What one copy has displaced comes one late, until the next silence.
bool Checker::is_behind_first_copy(TimePoint now, std::uint8_t station) const {
    const auto excused = excused_from_.find(station);
    return excused != excused_from_.end() && now < excused->second + 1s;
}

/// What stood on the wire for this answer: of a part of a joined read only its values are known.
Bytes Checker::heard_for(const Open& open, const Bytes& reply) const {
    const auto own = test::read_span(open.job.station, open.job.request.pdu());
    if (attempt_.span != own) return {reply.begin() + 2, reply.end()};
    Bytes heard{open.job.station};
    heard.insert(heard.end(), reply.begin(), reply.end());
    return heard;
}

/// One in 65536 of what two speakers make of each other's frames passes the CRC: no arbiter's
/// affair, as long as it is that seldom, and nobody has said the like.
bool Checker::is_luck(ByteView heard) {
    constexpr std::uint64_t kSeldom = 10000;
    const bool only_garbled = !attempt_.answered && garbled_ >= attempt_.started;
    return only_garbled && truth_.is_chance(heard) && ++lucky_ <= 1 + collisions_ / kSeldom;
}

void Checker::at_end(TimePoint now) {
    if (!open_.empty()) {
        const Open& first = open_.begin()->second;
        fail("P3: request " + std::to_string(open_.begin()->first) + " of client " +
             std::to_string(first.job.client) + " to station " + std::to_string(first.job.station) +
             " was never answered");
    }
    for (const std::string& write : too_soon_)
        if (!truth_.executed(write)) fail_value("P8: a write was confirmed that nobody executed");
    const std::string dear = costs_.at_end(now - started_);
    if (!dear.empty()) fail(dear);
    for (const auto& [id, client] : clients_) {
        if (client.healthy && client.accepted >= 200 && client.good == 0)
            fail("P9: a client starved: " + std::to_string(id));
    }
}

}  // namespace panelgate::scenario
