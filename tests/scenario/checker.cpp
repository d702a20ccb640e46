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
      adaptive_(
          std::ranges::any_of(settings_.stations, &arbiter::StationSettings::adaptive_timeout)),
      echoes_(plan.line.echo || plan.line.echo_writes || plan.line.partial_echo > 0 ||
              std::ranges::any_of(plan.panels,
                                  [](const PanelPlan& p) { return p.repeats_request > 0; })),
      watch_(plan_),
      costs_(plan_, watch_) {
    for (const arbiter::StationSettings& station : settings_.stations) {
        if (station.retry_writes) repeat_writes_.insert(station.id);
    }
    for (const PanelPlan& panel : plan_.panels) {
        if (panel.overtakes) orders_.try_emplace(panel.id);
    }
}

void Checker::fail(std::string what) {
    if (violation_.empty()) violation_ = std::move(what);
}

Duration Checker::gap() const { return silent_interval(settings_.serial); }

void Checker::on_accepted(TimePoint now, arbiter::Ticket ticket, const arbiter::Job& job) {
    if (ticket <= last_ticket_) fail("P3: a ticket was given twice");
    last_ticket_ = ticket;
    waiting_before_ = open_.size() >= settings_.queue.limit ? waiting() : 0;
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

/// The answer to what it was asked last equals that: if nobody waits for it any more, it may be our
/// own frame, which comes back late (P8).
bool Checker::may_be_echo(std::uint8_t station) const {
    const auto asked = asked_.find(station);
    return asked != asked_.end() && !modbus::is_pure_read(asked->second) &&
           modbus::normal_write_reply(asked->second) == asked->second;
}

/// The last answer that was heard of it before `since` equalled its request.
bool Checker::was_like_echo(std::uint8_t station, TimePoint since) const {
    const auto unlike = unlike_echo_.find(station);
    return said_.contains(station) && (unlike == unlike_echo_.end() || unlike->second > since);
}

void Checker::on_refused(TimePoint now, const arbiter::Job& job, Fault fault) {
    const Client& client = clients_[job.client];
    // A late reply is told from what may follow it by a silence.
    constexpr Duration kSilence = 50ms;
    // What a probe was answered may repeat another answer, and is held for as long as its station
    // needs (P1): see check_idling().
    const TimePoint held = heard_until_ + watch_.own_slowest(job.station) + 20ms;
    const bool may_be_held = attempt_.answered && attempt_.station == job.station && now <= held;
    if (fault == Fault::offline && !may_be_held && watch_.is_good(job.station, now - kSilence) &&
        !was_like_echo(job.station, now - kSilence) &&
        !is_only_overdue(job.station, now - kSilence))
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
        if (!finish.pdu &&
            (watch_.is_silent(open.job.station) || now < rests_for(finish.ticket, open)))
            client->second.held_until = now;
    }
    check_in_time(now, open, finish);
    // Who was sent before, in a joined read, is told so when it has to go. Not all that look as if
    // they went along with a frame were: what was split before goes alone.
    const auto is = [&](Fault fault) { return !finish.pdu && finish.pdu.error() == fault; };
    if (is(Fault::timeout)) watch_.on_timeout(now);
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
        told_ = now;
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

/// It is slower than ever, and that nobody waits for, or believes: where it or another has just
/// been silent all of them may have died, whose whole timeouts together P4 forbids; and where an
/// earlier reply of its form is owed this one may be that of a panel that does not serve in order
/// (P1).
bool Checker::is_overdue(TimePoint now, std::uint8_t station) const {
    const auto replied = replied_.find(station);
    const TimePoint came = attempt_.answered && replied != replied_.end() ? replied->second : now;
    return attempt_.station == station && (!attempt_.trusted || attempt_.owed) &&
           came > attempt_.sent + attempt_.needed;
}

/// It was, each time that it did not answer, and was not heard before `since`.
bool Checker::is_only_overdue(std::uint8_t station, TimePoint since) const {
    const auto found = missed_.find(station);
    return found != missed_.end() && found->second.only_overdue && since <= found->second.heard;
}

/// A sound panel's requests do not fail, unless something hit them.
void Checker::check_fault(TimePoint now, const Open& open, Fault fault) {
    const std::uint8_t station = open.job.station;
    if (open.gone || station == kBroadcast || !watch_.is_good(station, open.submitted)) return;
    // What came back could be the echo, not the reply: also where bytes that nobody says keep
    // reads from showing whether there is one.
    if (open.write && (echoes_ || (plan_.line.floating > 0 && may_be_echo(station)))) return;
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
    // What would confirm it may be the answer to a broadcast, and its place cannot be read (P8).
    constexpr Duration kLatestAnswer = 5s;
    const auto spread = open.write
                            ? spread_.find(modbus::normal_write_reply(open.job.request.pdu()))
                            : spread_.end();
    if (fault == Fault::timeout && spread != spread_.end() &&
        open.submitted < spread->second + kLatestAnswer &&
        truth_.refused(station, asked_[station], open.submitted))
        return;
    const bool failed =
        was_heard(fault) || fault == Fault::offline || (fault == Fault::timeout && !at_deadline);
    if (failed && !refused && !is_overdue(now, station))
        fail("P4: a sound panel's request failed: " + std::string(label(fault)));
}

void Checker::check_reply(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const Bytes& reply = *finish.pdu;
    if (modbus::exception_of(reply)) {
        const Bytes& asked = open.job.request.pdu();
        constexpr std::uint8_t kBusy = 6;
        if (reply[1] == kBusy)
            announced_[{open.job.station, form_of(asked_[open.job.station])}] = owed_until();
        const bool said = truth_.refused(open.job.station, asked, open.submitted);
        if (!said && !is_luck(heard_for(open, reply)))
            fail("P1: an exception that the station did not send to this request");
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
    if ((!done || *done > now) && !is_behind_first_copy(now, open.job.station))
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
        return fail("P1: a reply of another length or function");
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
        if (attempt_.imitated && attempt_.station == open.job.station) return void(++excused_);
        if (is_luck(heard_for(open, reply)) || is_padded(open, reply)) return;
        return fail(fault);
    }
}

/// What one copy has displaced comes one late, until the next silence.
bool Checker::is_behind_first_copy(TimePoint now, std::uint8_t station) const {
    const auto excused = excused_from_.find(station);
    return excused != excused_from_.end() && now < excused->second + 1s;
}

/// The late reply to a shorter read, whose panel has put a register of zeros behind its values.
bool Checker::is_padded(const Open& open, const Bytes& reply) const {
    return looks_late(open.job.station) && word(reply, reply.size() - 2) == 0;
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
    const std::string dear = costs_.at_end(now - started_);
    if (!dear.empty()) fail(dear);
    for (const auto& [id, client] : clients_) {
        if (client.healthy && client.accepted >= 200 && client.good == 0)
            fail("P9: a client starved: " + std::to_string(id));
    }
}

}  // namespace panelgate::scenario
