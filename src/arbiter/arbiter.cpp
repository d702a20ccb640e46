#include "panelgate/arbiter/arbiter.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {
namespace {

constexpr std::uint8_t kBroadcast = 0;
constexpr std::uint8_t kUnlisted = 0;         // in counters_
constexpr std::size_t kAduOverhead = 3;       // address and CRC
constexpr std::size_t kShortestReplyAdu = 5;  // an exception

}  // namespace

Arbiter::Arbiter(Settings settings) : settings_(std::move(settings)), queue_(settings_.queue) {
    for (const StationSettings& station : settings_.stations) {
        stations_[station.id] = station;
        counters_[station.id];
    }
    counters_[kUnlisted];
    settings_.end_of_frame = std::max(settings_.end_of_frame, silent_interval(settings_.serial));
}

Result<Ticket> Arbiter::submit(TimePoint now, Job job) {
    if (!up_) return Fault::line_down;
    if (queue_.full(job.client)) return Fault::busy;
    job.ticket = ++last_ticket_;
    job.arrived = now;
    job.deadline = now + settings_.queue.deadline;
    job.start_by = job.deadline - shortest_transaction(job);
    const Ticket ticket = job.ticket;
    queue_.push(std::move(job));
    step(now);
    return ticket;
}

void Arbiter::cancel(TimePoint now, Client client) {
    for (const Job& job : queue_.remove_if([&](const Job& j) { return j.client == client; })) {
        finish(job, Fault::cancelled);
    }
    step(now);
}

void Arbiter::on_line_up(TimePoint now) {
    up_ = true;
    // The receiver's first state: one silent interval before the first frame (MST-01).
    quiet_since_ = now;
    quiet_until_ = now;
    last_station_ = kBroadcast;
    step(now);
}

void Arbiter::on_line_down(TimePoint now) {
    up_ = false;
    if (active_) {
        const Job job = active_->job;
        note_unused(now);
        close_active(now);
        finish(job, Fault::line_lost);
    }
    for (const Job& job : queue_.remove_if([](const Job&) { return true; })) {
        finish(job, job.attempts > 0 ? Fault::line_lost : Fault::line_down);
    }
}

void Arbiter::on_rx(TimePoint now, ByteView bytes) {
    if (bytes.empty()) return;
    if (!active_ || active_->job.station == kBroadcast) {
        hear_idle(now, bytes);
    } else {
        active_->last_byte = now;
        active_->heard = true;
        quiet_since_ = std::max(active_->sent, now);
        if (auto reply = active_->framer.feed(bytes)) settle(now, std::move(*reply));
    }
    step(now);
}

/// Bytes that nobody asked for (MST-04): counted, never matched with a later request.
void Arbiter::hear_idle(TimePoint now, ByteView bytes) {
    quiet_since_ = std::max(quiet_since_, now);
    counters_of(last_station_).discarded_bytes += bytes.size();
    actions_.push_back(
        Note{now, Note::Direction::discarded, Bytes(bytes.begin(), bytes.end()), "unasked"});
}

void Arbiter::on_deadline(TimePoint now) { step(now); }

std::optional<Action> Arbiter::poll_action() {
    if (actions_.empty()) return std::nullopt;
    Action action = std::move(actions_.front());
    actions_.pop_front();
    return action;
}

std::optional<TimePoint> Arbiter::next_deadline() const {
    std::optional<TimePoint> next = queue_.first_expiry();
    const auto earlier = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
    if (active_) {
        earlier(active_deadline());
    } else if (!queue_.empty()) {
        earlier(std::max(quiet_until_, quiet_since_ + gap_of(last_station_)));
    }
    return next;
}

void Arbiter::step(TimePoint now) {
    check_active(now);
    expire(now);
    while (up_ && !active_ && start_next(now)) check_active(now);
}

/// Starts the next job in turn when the line may be used. False when nothing more can be done now.
bool Arbiter::start_next(TimePoint now) {
    if (now < quiet_until_ || now < quiet_since_ + gap_of(last_station_)) return false;
    const Job* next = queue_.peek();
    if (next == nullptr) return false;
    const TimePoint allowed = quiet_since_ + gap_of(next->station);
    if (now < allowed) {  // this station asks for a longer silence than the last one did
        quiet_until_ = allowed;
        return false;
    }
    std::optional<Job> job = queue_.pop();
    start(now, std::move(*job));
    return true;
}

void Arbiter::expire(TimePoint now) {
    const auto first = queue_.first_expiry();
    if (!first || now < *first) return;
    for (const Job& job : queue_.remove_if([&](const Job& j) { return j.start_by <= now; })) {
        finish(job, job.attempts > 0 ? job.last : Fault::expired);
    }
}

void Arbiter::start(TimePoint now, Job job) {
    Bytes adu = modbus::encode_adu(job.station, job.pdu);
    const std::size_t wait = static_cast<std::size_t>(job.priority);
    if (job.attempts == 0) {
        line_counters_.queue_wait[wait].observe(now - job.arrived);
    } else {
        ++counters_of(job.station).retries;
    }
    ++job.attempts;
    if (job.station == kBroadcast) ++line_counters_.broadcasts;
    states_[job.station].tried = true;

    const StationSettings& station = settings_of(job.station);
    const TimePoint sent = now + wire_time(settings_.serial, adu.size());
    const TimePoint give_up = std::min(sent + station.response_timeout, job.deadline);
    const TimePoint longest = std::min(sent + station.response_timeout +
                                           2 * wire_time(settings_.serial, modbus::kMaxLongRtuAdu) +
                                           settings_.end_of_frame,
                                       job.deadline);
    actions_.push_back(
        Note{now, Note::Direction::sent, adu, job.station == kBroadcast ? "broadcast" : "request"});
    actions_.push_back(Transmit{std::move(adu)});
    modbus::ReplyFramer framer(job.station, job.pdu);
    quiet_since_ = sent;
    last_station_ = job.station;
    active_.emplace(
        Active{std::move(job), std::move(framer), now, sent, give_up, sent, longest, false});
}

/// When the transaction on the wire must be looked at again.
TimePoint Arbiter::active_deadline() const {
    const Active& a = *active_;
    if (a.job.station == kBroadcast) return a.sent;
    if (!a.framer.has_pending()) return a.give_up;
    // Something is being heard: its silence decides, also after give_up, but not for ever.
    return std::min(std::max(a.sent, a.last_byte) + settings_.end_of_frame, a.longest);
}

void Arbiter::check_active(TimePoint now) {
    if (!active_ || now < active_deadline()) return;
    if (active_->job.station == kBroadcast) {
        check_broadcast(now);
        return;
    }
    if (auto reply = active_->framer.on_silence()) {
        settle(now, std::move(*reply));
        return;
    }
    if (active_->framer.was_damaged()) {
        fail_attempt(now, Fault::damaged);
    } else if (now >= active_->give_up) {
        fail_attempt(now, Fault::timeout);
    }
}

/// The last bit of a broadcast has left: nobody answers, the line rests for the turnaround.
void Arbiter::check_broadcast(TimePoint now) {
    const Job job = active_->job;
    const TimePoint sent = active_->sent;
    close_active(now);
    quiet_until_ = sent + settings_.broadcast_turnaround;
    finish(job, modbus::normal_write_reply(job.pdu));
}

void Arbiter::settle(TimePoint now, Bytes reply) {
    const Job job = active_->job;
    StationCounters& counters = counters_of(job.station);
    StationState& state = states_[job.station];
    state.last_success = now;
    state.silent_in_a_row = 0;

    const Duration reply_time = wire_time(settings_.serial, reply.size() + kAduOverhead);
    const Duration think = now - active_->sent - reply_time - silent_interval(settings_.serial);
    counters.turnaround.observe(std::max(think, Duration::zero()));
    counters.bus_transaction.observe(now - active_->started);
    if (const auto code = modbus::exception_of(reply)) ++counters.exceptions[*code];
    note_unused(now);
    actions_.push_back(
        Note{now, Note::Direction::received, modbus::encode_adu(job.station, reply), "reply"});
    close_active(now);
    finish(job, std::move(reply));
}

void Arbiter::fail_attempt(TimePoint now, Fault fault) {
    Job job = active_->job;
    job.last = fault;
    if (fault == Fault::damaged) {
        ++counters_of(job.station).damaged_frames;
    } else {
        ++states_[job.station].silent_in_a_row;
    }
    note_unused(now);
    close_active(now);
    if (may_retry(job) && now < job.start_by) {
        queue_.put_back(std::move(job));
    } else {
        finish(job, fault);
    }
}

void Arbiter::close_active(TimePoint now) {
    const TimePoint end =
        std::max({active_->sent, active_->last_byte, std::min(now, active_->longest)});
    line_counters_.busy += end - active_->started + gap_of(active_->job.station);
    active_.reset();
}

void Arbiter::finish(const Job& job, Result<Bytes> pdu) {
    actions_.push_back(Finish{job.ticket, std::move(pdu), job.attempts > 0});
}

/// Counts and traces what was heard and is nobody's answer.
void Arbiter::note_unused(TimePoint now) {
    const std::uint8_t asked = active_->job.station;
    for (modbus::Unused& part : active_->framer.take_unused()) {
        const bool own = part.kind == modbus::Unused::Kind::own;
        const bool foreign = part.kind == modbus::Unused::Kind::foreign;
        StationCounters& counters = counters_of(asked);
        counters.discarded_bytes += part.bytes.size();
        counters.late_frames += own ? 1 : 0;
        counters.foreign_frames += foreign ? 1 : 0;
        const std::string_view what = own ? "late" : foreign ? "foreign" : "damaged";
        actions_.push_back(Note{now, Note::Direction::discarded, std::move(part.bytes), what});
    }
}

bool Arbiter::may_retry(const Job& job) const {
    const StationSettings& station = settings_of(job.station);
    const bool harmless = modbus::is_pure_read(job.pdu) || station.retry_writes;
    return harmless && job.attempts <= station.retries;
}

/// Request, gap, and the shortest thing a station can say.
Duration Arbiter::shortest_transaction(const Job& job) const {
    const std::size_t request = job.pdu.size() + kAduOverhead;
    if (job.station == kBroadcast) return wire_time(settings_.serial, request);
    return wire_time(settings_.serial, request + kShortestReplyAdu) +
           silent_interval(settings_.serial);
}

const StationSettings& Arbiter::settings_of(std::uint8_t station) const {
    const auto found = stations_.find(station);
    return found == stations_.end() ? settings_.unlisted : found->second;
}

StationCounters& Arbiter::counters_of(std::uint8_t station) {
    const auto found = counters_.find(station);
    return found == counters_.end() ? counters_[kUnlisted] : found->second;
}

Duration Arbiter::gap_of(std::uint8_t station) const {
    return std::max(settings_of(station).frame_gap, silent_interval(settings_.serial));
}

}  // namespace panelgate::arbiter
