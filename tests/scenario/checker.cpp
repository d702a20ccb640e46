#include "checker.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::scenario {
namespace {

constexpr std::uint8_t kBroadcast = 0;

std::string key_of(std::uint8_t station, ByteView pdu) {
    return std::string(1, static_cast<char>(station)) + std::string(pdu.begin(), pdu.end());
}

std::uint16_t word(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] * 256 + bytes[at + 1]);
}

bool is_write(ByteView pdu) { return !modbus::is_pure_read(pdu); }

}  // namespace

std::uint16_t moving_value(std::uint8_t station, std::uint8_t function, std::uint16_t address,
                           std::uint64_t served) {
    return static_cast<std::uint16_t>(station * 257u + function * 4099u + address * 31u + served);
}

Checker::Checker(const arbiter::Settings& settings)
    : settings_(settings),
      adaptive_(
          std::ranges::any_of(settings.stations, &arbiter::StationSettings::adaptive_timeout)) {}

void Checker::fail(std::string what) {
    if (violation_.empty()) violation_ = std::move(what);
}

Duration Checker::gap() const { return silent_interval(settings_.serial); }

void Checker::on_accepted(TimePoint now, arbiter::Ticket ticket, const arbiter::Job& job) {
    if (ticket <= last_ticket_) fail("P3: a ticket was given twice");
    last_ticket_ = ticket;
    open_[ticket] = {job, now, stations_[job.station].served};
    ++clients_[job.client].accepted;
    if (is_write(job.pdu)) open_writes_[key_of(job.station, job.pdu)] = ticket;
}

/// What was taken for a joined read and refused by the panel waits again, beyond the limit; but
/// nothing new comes in then.
void Checker::on_queue_depth(std::size_t before, std::size_t after) {
    if (after > before && after > settings_.queue.limit)
        fail("P9: more requests wait than the limit allows");
    if (after > 2 * settings_.queue.limit) fail("P9: the queue has no bound");
}

void Checker::on_line(TimePoint now) {
    if (started_ == TimePoint{}) started_ = now;
    answered_ = true;
    probing_ = false;
    sent_until_ = heard_until_ = now;
}

void Checker::on_heard(TimePoint now) {
    heard_until_ = now;
    heard_something_ = true;
}

void Checker::on_answered(TimePoint now) {
    answered_ = true;
    probing_ = false;
    heard_until_ = now;
}

void Checker::on_transmit(TimePoint now, const Bytes& adu, bool probe) {
    ++frames_;
    const std::uint8_t station = adu[0];
    if (now < sent_until_) fail("P5: transmitted while the last frame was still leaving");
    if (now < sent_until_ + gap() || now < heard_until_ + gap())
        fail("P5: transmitted within the silent interval");
    // Without an answer a request is over after its timeout, or when what was heard has ended. A
    // probe and an adaptive timeout may be shorter than configured, but are at least 20 ms.
    const bool may_be_short = probing_ || adaptive_;
    const Duration least = may_be_short ? 20ms : settings_.unlisted.response_timeout;
    if (!answered_ && !heard_something_ && now < sent_until_ + least)
        fail("P1: transmitted while the last request was outstanding");
    if (probing_) probes_ += std::min(now - probe_started_, settings_.unlisted.response_timeout);
    answered_ = station == kBroadcast;
    heard_something_ = false;
    probing_ = probe;
    probe_started_ = now;
    sent_until_ = now + wire_time(settings_.serial, adu.size());

    const ByteView pdu = ByteView(adu).subspan(1, adu.size() - 3);
    if (!is_write(pdu)) return;
    const std::string key = key_of(station, pdu);
    if (!written_.insert(key).second) fail("P2: a write was transmitted twice");
    if (closed_writes_.contains(key))
        fail("P2: a write was transmitted after its answer, or for nobody");
    if (!open_writes_.contains(key)) fail("P2: a write that nobody asked for");
    for (auto& [id, s] : stations_) {
        if (station != kBroadcast && id != station) continue;
        const std::uint16_t address = word(pdu, 1);
        const unsigned count = pdu[0] == 16 ? word(pdu, 3) : 1;
        for (unsigned i = 0; i < count && pdu[0] != 5; ++i)
            s.cells[static_cast<std::uint16_t>(address + i)].asked = now;
    }
}

void Checker::on_served(TimePoint now, std::uint8_t station) {
    Station& s = stations_[station];
    s.history.emplace_back(now, ++s.served);
    if (s.history.size() > 4096) s.history.pop_front();
}

void Checker::on_executed(TimePoint now, std::uint8_t station, ByteView pdu) {
    executed_[key_of(station, pdu)] = now;
    if (pdu[0] == 5) return;
    Station& s = stations_[station];
    const std::uint16_t address = word(pdu, 1);
    if (pdu[0] == 6) s.cells[address].values.emplace_back(now, word(pdu, 3));
    for (std::uint16_t i = 0; pdu[0] == 16 && i < word(pdu, 3); ++i) {
        s.cells[static_cast<std::uint16_t>(address + i)].values.emplace_back(
            now, word(pdu, std::size_t{6} + 2 * i));
    }
}

void Checker::on_exception(TimePoint now, std::uint8_t station) {
    stations_[station].last_exception = now;
}

void Checker::on_client(arbiter::Client client, bool healthy) {
    clients_[client].healthy = healthy;
}

void Checker::on_client_gone(arbiter::Client client) {
    clients_.erase(client);
    for (const auto& [ticket, open] : open_) {
        const std::string key = key_of(open.job.station, open.job.pdu);
        if (open.job.client == client && is_write(open.job.pdu) && !written_.contains(key))
            closed_writes_.insert(key);
    }
}

void Checker::on_finish(TimePoint now, const arbiter::Finish& finish) {
    const auto found = open_.find(finish.ticket);
    if (found == open_.end()) return fail("P3: answered twice, or what nobody asked");
    const Open open = std::move(found->second);
    open_.erase(found);
    if (now > open.submitted + settings_.queue.deadline) fail("P3: answered after its deadline");
    const bool write = is_write(open.job.pdu);
    const std::string key = key_of(open.job.station, open.job.pdu);
    if (write) {
        closed_writes_.insert(key);
        open_writes_.erase(key);
        if (finish.transmitted != written_.contains(key))
            fail("P2: the answer to a write is wrong about its transmission");
    }
    if (!finish.pdu) return;
    check_reply(now, open, finish);
}

void Checker::check_reply(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const Bytes& reply = *finish.pdu;
    if (modbus::exception_of(reply)) {
        const auto station = stations_.find(open.job.station);
        const bool sent =
            station != stations_.end() && station->second.last_exception >= open.submitted;
        if (!sent) fail("P1: an exception that the station did not send");
        return;
    }
    ++good_;
    ++clients_[open.job.client].good;
    if (is_write(open.job.pdu)) return check_write(now, open, finish);
    check_values(now, open, finish);
}

void Checker::check_write(TimePoint now, const Open& open, const arbiter::Finish&) {
    if (open.job.station == kBroadcast) return;
    const auto done = executed_.find(key_of(open.job.station, open.job.pdu));
    if (done == executed_.end() || done->second > now)
        return fail("P8: a write was confirmed that no station executed");
    clients_[open.job.client].own_write = done->second;
}

void Checker::check_values(TimePoint now, const Open& open, const arbiter::Finish& finish) {
    const Bytes& reply = *finish.pdu;
    const ByteView pdu = open.job.pdu;
    const std::uint16_t first = word(pdu, 1);
    const std::uint16_t count = word(pdu, 3);
    if (reply.size() != 2 + std::size_t{2} * count || reply[0] != pdu[0])
        return fail("P1: a reply of another length or function");
    const Station& station = stations_[open.job.station];
    for (std::uint16_t i = 0; i < count; ++i) {
        const auto address = static_cast<std::uint16_t>(first + i);
        const std::uint16_t value = word(reply, 2 + std::size_t{2} * i);
        if (address >= kMemory) {
            check_cell(open, station, address, value, finish.age, now);
        } else {
            check_moving(open, station, address, value, finish.age, now);
        }
    }
}

/// The value must have been taken after the request came in: each request served changes it.
void Checker::check_moving(const Open& open, const Station& station, std::uint16_t address,
                           std::uint16_t value, std::optional<Duration> age, TimePoint now) {
    std::uint64_t before = open.served;
    if (age) {
        const TimePoint oldest = now - *age;
        before = 0;
        for (const auto& [at, served] : station.history) {
            if (at < oldest) before = served;
        }
    }
    const std::uint16_t low = moving_value(open.job.station, open.job.pdu[0], address, before + 1);
    const auto ahead = static_cast<std::uint16_t>(value - low);
    if (before + 1 + ahead > station.served)
        fail("P1: a value that the station did not have between the question and the answer");
}

void Checker::check_cell(const Open& open, const Station& station, std::uint16_t address,
                         std::uint16_t value, std::optional<Duration> age, TimePoint now) {
    const auto found = station.cells.find(address);
    const Cell empty;
    const Cell& cell = found == station.cells.end() ? empty : found->second;
    const auto client = clients_.find(open.job.client);
    TimePoint since = open.submitted;
    if (age) since = std::max(now - *age, cell.asked);  // nothing from before a write
    if (client != clients_.end()) since = std::max(since, client->second.own_write);
    std::uint16_t held = 0;
    bool possible = false;
    for (const auto& [at, written] : cell.values) {
        if (at > since && held == value) possible = true;
        if (at > now) break;
        held = written;
    }
    if (!possible && held != value)
        fail("P6: a value older than a write that was known to be done");
}

void Checker::at_end(TimePoint now, bool has_dead) {
    if (!open_.empty()) {
        const Open& first = open_.begin()->second;
        fail("P3: request " + std::to_string(open_.begin()->first) + " of client " +
             std::to_string(first.job.client) + " to station " + std::to_string(first.job.station) +
             " was never answered");
    }
    const double elapsed = to_seconds(now - started_);
    if (has_dead && elapsed > 20 && to_seconds(probes_) > 0.05 * elapsed)
        fail("P4: probes of silent stations took " +
             std::to_string(100 * to_seconds(probes_) / elapsed) + " % of the time");
    for (const auto& [id, client] : clients_) {
        if (client.healthy && client.accepted >= 200 && client.good == 0)
            fail("P9: a client starved");
    }
}

}  // namespace panelgate::scenario
