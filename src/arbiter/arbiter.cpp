#include "panelgate/arbiter/arbiter.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

bool is_same_wire(const Settings& one, const Settings& other) {
    const bool ascii = one.serial.mode == SerialMode::ascii;
    return one.serial == other.serial && one.ascii_digits == other.ascii_digits &&
           one.echo == other.echo && one.paced == other.paced && one.may_stall == other.may_stall &&
           crc_orders(one) == crc_orders(other) && (!ascii || one.reply_hole == other.reply_hole);
}

modbus::CrcOrders crc_orders(const Settings& settings) {
    using modbus::CrcOrder;
    modbus::CrcOrders orders;
    if (settings.serial.mode == SerialMode::ascii) return orders;
    for (const StationSettings& station : settings.stations)
        orders.set(station.id, station.crc_order);
    const bool all_old = !settings.stations.empty() &&
                         std::ranges::all_of(settings.stations, [](const StationSettings& station) {
                             return station.crc_order == CrcOrder::high_first;
                         });
    orders.set(kBroadcast, all_old ? CrcOrder::high_first : CrcOrder::low_first);
    return orders;
}

TimePoint latest_start(const SerialFormat& serial, const Job& job) {
    const std::size_t request = job.request.pdu().size() + modbus::kAduOverhead;
    const std::size_t reply =
        std::max(job.request.reply_length().value_or(0), modbus::kExceptionAdu);
    const Duration needed = job.station == kBroadcast
                                ? frame_time(serial, request)
                                : frame_time(serial, request + reply, 2) + silent_interval(serial);
    return job.deadline - needed;
}

namespace {

/// Derives the dependent settings.
Settings completed(Settings settings) {
    settings.end_of_frame = std::max(settings.end_of_frame, silent_interval(settings.serial));
    // In ASCII only every other character completes a byte.
    if (settings.serial.mode == SerialMode::ascii)
        settings.end_of_frame += byte_time(settings.serial);
    settings.reply_hole = std::max(settings.reply_hole, settings.end_of_frame);
    return settings;
}

std::optional<modbus::AsciiTranscript> transcript_of(const Settings& settings) {
    if (settings.serial.mode != SerialMode::ascii) return std::nullopt;
    return modbus::AsciiTranscript(settings.ascii_digits, settings.reply_hole);
}

Quiet quiet_of(const Settings& settings) {
    return Quiet(frame_time(settings.serial, modbus::kMaxRtuAdu), silent_interval(settings.serial));
}

}  // namespace

Arbiter::Arbiter(Settings settings)
    : Desk(completed(std::move(settings))),
      orders_(crc_orders(settings_)),
      ascii_(transcript_of(settings_)),
      quiet_(quiet_of(settings_)),
      echo_memory_(settings_.echo) {}

void Arbiter::apply(Settings settings) {
    settings = completed(std::move(settings));
    const bool same_wire = is_same_wire(settings_, settings);
    adopt(std::move(settings));
    if (same_wire) return;
    orders_ = crc_orders(settings_);
    quiet_ = quiet_of(settings_);
    echo_memory_ = EchoMemory(settings_.echo);
    ascii_ = transcript_of(settings_);
}

Result<Ticket> Arbiter::submit(TimePoint now, Job job) {
    const bool has_open = active_ && active_->group().has(job.client, job.station);
    if (auto answered = answer_at_once(now, job, has_open)) return *answered;
    if (active_ && active_->can_join(now, job) &&
        !schedule_.backlog().has(job.client, job.station)) {
        const Ticket ticket = job.ticket;
        job.attempts = 1;
        job.transactions.add(active_->group().transaction);
        outbox_.on_started(now, job);
        active_->group().jobs.push_back(std::move(job));
        return ticket;
    }
    const Result<Ticket> ticket = enqueue(now, std::move(job));
    if (ticket) step(now);
    return ticket;
}

void Arbiter::deny(TimePoint now, const JobQueue::Test& match) {
    deny_waiting(match);
    if (active_)
        for (Job& job : active_->group().jobs) job.barred = job.barred || match(job);
    step(now);
}

void Arbiter::cancel(TimePoint now, Client client) {
    cancel_waiting(client);
    if (active_) active_->group().on_client_gone(client);
    step(now);
}

TimePoint Arbiter::clear_at(TimePoint now) const {
    Duration window = stations_.latest_reply(kBroadcast);
    for (const StationSettings& station : settings_.stations)
        window = std::max(window, stations_.latest_reply(station.id));
    TimePoint clear = std::max(now, stations_.outstanding().all_clear_at(now, window));
    clear = std::max({clear, rest_, quiet_.free_at(Duration::zero())});
    if (!active_) return clear;
    const TimePoint sent = active_->timing().sent;
    if (active_->is_broadcast()) return std::max(clear, sent + settings_.broadcast_turnaround);
    return std::max(clear, sent + stations_.latest_reply(active_->group().station));
}

void Arbiter::rest_until(TimePoint until) {
    rest_ = std::max(rest_, until);
    quiet_.rest_until(rest_);
}

void Arbiter::on_line_left() {
    rest_ = std::max(rest_, quiet_.free_at(Duration::zero()));
    forget_line();
    suspended_ = true;
}

/// What was heard and read over the line is of no use any more.
void Arbiter::forget_line() {
    up_ = suspended_ = resetting_ = false;
    stations_.on_line_down();
    idle_.clear();
    replied_ = 0;
    memory_.clear();
}

void Arbiter::on_line_up(TimePoint now) {
    up_ = true;
    suspended_ = false;
    resetting_ = false;
    mute_.attempts = 0;
    mute_.ever_heard = false;
    stations_.on_opened(now);
    if (ascii_) ascii_->cut();
    quiet_.on_open(now);
    quiet_.rest_until(std::max(rest_, now + settings_.connect_pause));
    echo_memory_.forget();
    step(now);
}

/// A sent request stays outstanding: a device server may hand its reply to the next connection
/// (T8). Requests that wait stay where the arbiter itself asked for a new connection.
void Arbiter::on_line_down(TimePoint now) {
    const bool keeps = resetting_;
    forget_line();
    suspended_ = keeps;
    if (active_) {
        for (const Attempt::Heard& heard : active_->take_heard())
            judge_part(now, heard.part, false);
        const Attempt attempt = take_active(now);
        const Group& group = attempt.group();
        Asked asked = asked_of(attempt, settings_.may_stall);
        // The computed end may be later than the next connection: it has left over this one.
        asked.sent = std::min(asked.sent, now);
        if (attempt.is_broadcast()) {
            stations_.on_broadcast(asked);
            rest_ = std::max(rest_, attempt.timing().sent + settings_.broadcast_turnaround);
        } else {
            stations_.outstanding().add(group.station, std::move(asked));
        }
        outbox_.report(attempt, TransactionEnd::line_down);
        for (const Job& job : group.jobs) outbox_.finish(job, Fault::line_lost);
    }
    if (!keeps) clear_waiting();
}

void Arbiter::on_rx(TimePoint now, ByteView bytes) {
    if (bytes.empty() || !up_) return;
    expire_active(now);
    if (ascii_) {
        ascii_->feed(now, bytes);
        while (const auto piece = ascii_->next()) hear_piece(now, *piece);
        if (active_ && ascii_->inside()) active_->on_character(now);
        quiet_.on_begun(ascii_->inside() ? now + settings_.end_of_frame : TimePoint{});
    } else {
        hear(now, bytes);
    }
    step(now);
}

void Arbiter::hear(TimePoint now, ByteView bytes) {
    if (!active_ || active_->is_broadcast()) return hear_idle(now, bytes);
    const bool was_wrong = active_->echo().mismatch();
    active_->on_rx(now, bytes);
    quiet_.on_heard(std::max(active_->timing().sent, now));
    if (active_->echo().mismatch() && !was_wrong) {
        outbox_.on_echo_mismatch(now, active_->group().station);
        echo_memory_.on_mismatch();
    }
    conclude(now);
}

/// The piece that has ended may belong to the attempt, to no request, or partly to both.
void Arbiter::hear_piece(TimePoint now, const modbus::AsciiTranscript::Piece& piece) {
    using End = modbus::AsciiTranscript::Piece::End;
    if (!piece.bytes.empty()) hear(now, piece.bytes);
    if (piece.end == End::none) return;
    const bool good = piece.end == End::frame;
    if (active_ && !active_->is_broadcast()) {
        piece.end == End::cut ? active_->on_frame_cut() : active_->on_frame_end(good);
        conclude(now);
    }
    if (idle_.empty()) return;
    const Bytes bytes = std::exchange(idle_, {});
    judge_part(
        now,
        modbus::classify_frame(bytes, quiet_.station(), good && modbus::crc_ok(bytes, orders_)),
        false);
}

void Arbiter::on_end(TimePoint now, Duration left) {
    if (!wants_end(now)) return;
    active_->on_end(now, left);
    quiet_.on_heard(active_->timing().sent);
}

void Arbiter::step(TimePoint now) {
    now_ = now;
    check_active(now);
    expire(now);
    if (!active_ && !idle_.empty() && now >= idle_ends()) judge_idle(now);
    while (up_ && !suspended_ && !resetting_ && !active_ && start_next(now)) check_active(now);
}

void Arbiter::check_active(TimePoint now) {
    if (!active_ || now < active_->deadline()) return;
    if (active_->is_broadcast()) return end_broadcast(now);
    expire_active(now);  // the answer may be too late for some
    active_->on_silence(now);
    conclude(now);
    if (ascii_ && ascii_->has_given()) ascii_->cut();
}

void Arbiter::expire(TimePoint now) {
    expire_active(now);
    expire_waiting(now);
}

/// Fails the jobs of the transaction whose own deadline has passed; the others keep waiting for its
/// reply. A broadcast that is leaving is answered when it has left.
void Arbiter::expire_active(TimePoint now) {
    if (!active_ || active_->is_broadcast()) return;
    for (const Job& job : active_->group().expire(now)) outbox_.finish(job, Fault::timeout);
}

void Arbiter::hear_idle(TimePoint now, ByteView bytes) {
    quiet_.on_noise(now);
    mute_.ever_heard = true;
    idle_.insert(idle_.end(), bytes.begin(), bytes.end());
    if (idle_.size() > modbus::ReplyFramer::kMaxHeard) judge_idle(now);
}

void Arbiter::judge_idle(TimePoint now) {
    const Bytes bytes = std::exchange(idle_, {});
    if (ascii_) {
        ascii_->cut();
        return judge_part(now, modbus::classify_frame(bytes, quiet_.station(), false), false);
    }
    for (const modbus::Unused& part : modbus::classify_heard(bytes, quiet_.station(), orders_))
        judge_part(std::min(now, quiet_.since()), part, false);
}

bool Arbiter::start_next(TimePoint now) {
    if (now < quiet_.free_at(stations_.gap(quiet_.station()))) return false;
    if (!idle_.empty()) judge_idle(now);  // it may show that the line is not free
    auto group = schedule_.next(now, stations_, quiet_, echo_memory_);
    if (!group) return false;
    start(now, std::move(*group));
    return true;
}

Attempt::Timing Arbiter::timing_of(TimePoint now, const Group& group, std::size_t size) const {
    Attempt::Timing timing = Attempt::timing_of(settings_, now, size, lead_);
    timing.pause = now - quiet_.since();
    timing.confirm_end = confirm_ends_;
    const Station* const station = stations_.find(group.station);
    if (station == nullptr) return timing;
    // What is not repeated waits for the whole timeout.
    const bool adapts = group.request.is_read() && !group.silent && !group.probe;
    timing.patience = timing::kListensAgain + latency_ +
                      (adapts ? station->response_timeout() : station->settings().response_timeout);
    const Duration hole = std::max(station->reply_hole(), timing.hole);
    timing.longest_reply += hole - timing.hole;
    timing.hole = hole;
    return timing;
}

void Arbiter::start(TimePoint now, Group group) {
    Bytes adu = modbus::encode_adu(group.station, group.request.pdu(), orders_.of(group.station));
    outbox_.on_rested(quiet_.take_rested(now));
    begin(now, group);
    Bytes wire = ascii_ ? modbus::to_ascii(adu) : adu;
    if (ascii_) ascii_->cut();
    const Attempt::Timing timing = timing_of(now, group, adu.size());
    const Reason why = reason_of(now, group, schedule_.backlog().queue());
    quiet_.on_sent(timing.sent, group.station);
    last_frame_ = adu;
    replied_before_ = std::exchange(replied_, std::uint8_t{0});
    EchoFilter echo(adu, echo_memory_.expect());
    active_.emplace(std::move(group), timing, std::move(echo), orders_);
    outbox_.transmit(now, *active_, std::move(adu), std::move(wire), why);
}

std::optional<TimePoint> Arbiter::next_deadline() const {
    std::optional<TimePoint> next = schedule_.backlog().first_expiry();
    const auto earlier = [&next](TimePoint t) { next = next ? std::min(*next, t) : t; };
    if (active_) {
        earlier(std::min(active_->deadline(), active_->end_wanted_at()));
        for (const Job& job : active_->group().jobs) {
            if (!active_->is_broadcast()) earlier(job.deadline);
        }
        return next;
    }
    if (!idle_.empty()) earlier(idle_ends());
    if (!up_ || suspended_ || resetting_) return next;
    if (const auto start = schedule_.next_start(now_, stations_, quiet_)) earlier(*start);
    return next;
}

// Invariants. Tests check them after every call.

void Arbiter::check_invariants() const {
    const auto must = [](bool holds, const char* what) {
        if (holds) return;
        std::fprintf(stderr, "invariant broken: %s\n", what);
        std::abort();
    };
    const Backlog& backlog = schedule_.backlog();
    must(up_ || (!active_ && !resetting_), "a line that is down carries nothing");
    must(up_ || suspended_ || backlog.empty(), "a line that is down has nothing waiting");
    for (const Group& group : backlog.retries())
        must(!group.abandoned() && group.attempts > 0, "somebody waits for each retry");
    if (!active_) return;
    const Group& group = active_->group();
    must(active_->deadline() >= active_->timing().started, "an attempt ends after its start");
    must(!group.probe || group.jobs.empty(), "no request waits for a probe");
    for (const Job& job : group.jobs)
        must(job.attempts > 0 && job.station == group.station, "its jobs are on the wire");
    must(!next_deadline() || *next_deadline() <= active_->deadline(), "the attempt's end is due");
}

}  // namespace panelgate::arbiter
