#include "panelgate/arbiter/station.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

Station::Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
                 Duration frame)
    : settings_(settings),
      listed_(listed),
      health_(offline),
      late_(settings.late_window, settings.response_timeout),
      adaptive_(settings.timeout_floor, settings.response_timeout),
      trail_(frame) {}

void Station::apply(const StationSettings& settings, const OfflineSettings& offline, bool listed) {
    settings_ = settings;
    listed_ = listed;
    health_.apply(offline);
    late_.apply(settings.late_window, settings.response_timeout);
    adaptive_.apply(settings.timeout_floor, settings.response_timeout);
}

void Station::owe(TimePoint now, const Bytes& pdu, TimePoint sent) {
    damaged_pdu_.clear();
    proved_ = false;
    return_.on_owed();
    debt_.add(sent, pdu);
    rest_for_owed(now);
}

/// Until what left last can no longer be answered: within its timeout, and so much later as its
/// replies may be late.
void Station::rest_for_owed(TimePoint now) {
    outstanding_until_ =
        std::max(now, debt_.last_sent() + settings_.response_timeout) + late_.value();
}

TimePoint Station::surely_answered(TimePoint started, ByteView reply) const {
    const Debt::Owed* const other = debt_.oldest(reply);
    return other != nullptr ? std::min(other->sent, started) : started;
}

void Station::on_opened(TimePoint now) {
    connected_ = now;
    if (!owes()) return;
    return_.on_opened();
    const auto replies = static_cast<int>(debt_.size()) + 1;
    not_before_ = std::max(not_before_, now + std::min(latest_reply(), replies * usual()));
}

void Station::on_proved(TimePoint now, TimePoint sent) {
    if (!owes() || proved_ || owes_since(sent)) return;
    proved_ = true;
    outstanding_until_ =
        std::max(outstanding_until_, now + settings_.response_timeout + late_.value());
}

void Station::on_asked(TimePoint now, const Group& group, bool held_back) {
    if (now >= rested() && !held_back) debt_.clear();
    asked_ = now;
    if (group.request.is_read()) read_turn_ = wants_check_ = woken_by_write_ = false;
    if (group.span && !group.told_apart) last_read_ = group.request;
}

Stray Station::judge(TimePoint now, ByteView pdu) const {
    const bool copy = copies_.is_copy(now, pdu);
    if (copy && copies_.known()) return Stray::copy;  // what is owed comes all the same
    if (debt_.fits(pdu)) return Stray::late;
    if (copy) return Stray::copy;
    return copies_.is_second(now, pdu) ? Stray::second : Stray::unasked;
}

/// What nothing asked for, with the time at which it came first.
void Station::remember_refusal(TimePoint now, ByteView pdu) {
    if (!modbus::exception_of(pdu) || is_stray_refusal(now, pdu)) return;
    stray_refusal_.assign(pdu.begin(), pdu.end());
    stray_refusal_at_ = now;
}

Station::Heard Station::on_stray_frame(TimePoint now, ByteView pdu) {
    Heard heard;
    heard.stray = judge(now, pdu);
    const bool said_again = now < std::exchange(again_until_, TimePoint{});
    const bool may_be_copy = said_again || copies_.is_copy(now, pdu);
    if (heard.stray != Stray::late) {
        remember_refusal(now, pdu);
        copies_.on_unasked(now, pdu);
        not_before_ = std::max(not_before_, copies_.rest_until());
        if (heard.stray == Stray::copy) trail_.on_stray(now);
        return heard;
    }
    // The oldest one whose reply could still come: an older one would make it look later than it
    // is.
    const Debt::Owed answered = *debt_.oldest(pdu, now - latest_reply());
    const TimePoint asked = answered.sent;
    const TimePoint due = asked + settings_.response_timeout;
    // Behind a wait that was cut short it tells how long the panel needs; what was held up for
    // longer than the whole timeout does not.
    if (now <= due) slowest_.add(now - asked);
    heard.lateness = std::max(now - due, Duration::zero());
    if (heard.lateness > Duration::zero()) late_.on_late(heard.lateness);
    // What repeats the reply before it may be that once more, and what is owed still comes.
    if (may_be_copy) {
        copies_.on_either(now, pdu);
    } else {
        debt_.close_before(debt_.oldest(pdu)->sent, connected_);
        debt_.take(pdu);
    }
    heard.settled = !owes();
    // Those behind it are still to come.
    if (return_.answered()) outstanding_until_ = std::max(outstanding_until_, now + latest_reply());
    copies_.on_reply(now, answered.pdu, Bytes(pdu.begin(), pdu.end()));
    if (heard.settled) rest_is_over(now + copies_.hold());
    heard.back = health_.on_late_reply(now);
    missed_ = false;
    probes_ = 0;
    return heard;
}

void Station::on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes) {
    const Bytes* copy = copies_.copy_in(now, id, bytes, settings_.crc_order);
    if (copy == nullptr) return;
    const Bytes reply = *copy;
    if (owes()) return copies_.on_either(now, reply);
    copies_.on_unasked(now, reply);
}

/// What this reply tells of whether the station says others twice.
void Station::learn_of_copies(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const bool held = attempt.was_held() && copies_.is_copy(now, attempt.reply());
    if (attempt.reply() == group.doubted || (held && !group.is_values(attempt.reply()))) {
        copies_.on_confirmed(group.request.pdu(), attempt.reply());
    } else if (!group.doubted.empty()) {
        copies_.on_denied(group.doubted_at, group.doubted);
    }
    if (const auto first = attempt.said_twice(); first && !owes())
        copies_.on_said_twice(now, *first, attempt.reply());
    if (attempt.said_damaged_before()) copies_.on_doubt(CopyGuard::kSaidAgain);
    copies_.on_reply(now, group.request.pdu(), attempt.reply());
}

/// What it owes behind this reply.
void Station::settle_debt(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const TimePoint sent = attempt.timing().sent;
    if (attempt.reply() == group.doubted && debt_.size() <= 1) {
        debt_.clear();  // both have come
        rest_is_over(now + copies_.take_doubt());
    } else if (const Debt::Owed* const oldest = debt_.oldest(attempt.reply())) {
        // Each of the attempts may have been answered with it, this one too.
        debt_.close_before(oldest->sent, connected_);
        debt_.take(attempt.reply());
        debt_.add(sent, group.request.pdu());
        rest_for_owed(now);
    } else if (now < again_until_ && late_.worst() > Duration::zero()) {
        // It may be what came damaged, once more, and the reply to this attempt is late.
        owe(now, group.request.pdu(), sent);
    } else {
        debt_.close_before(sent, connected_);
        not_before_ = std::max(not_before_, now + copies_.take_doubt());
        if (!owes()) outstanding_until_ = {};
    }
}

/// Nothing is outstanding any more.
void Station::rest_is_over(TimePoint not_before) {
    not_before_ = not_before;
    outstanding_until_ = {};
}

Station::Replied Station::on_reply(TimePoint now, const Attempt& attempt, Duration waited,
                                   Duration think) {
    const Group& group = attempt.group();
    Replied result;
    result.back = health_.on_reply(now);
    probes_ = 0;
    proof_in_vain_ = wants_check_ = read_turn_ = false;
    if (group.request.is_read()) read_missed_ = false;
    failed_in_a_row_ = 0;
    failing_.clear();
    missed_ = false;
    lately_ = result.back ? 0 : static_cast<std::uint8_t>(lately_ << 1);
    if (group.tells_pace()) {
        slowest_.add(waited);
        quickest_.add(waited);
    }
    turnaround_.add(think);
    adaptive_.on_reply();
    late_.on_timely();
    if (drift_.check(turnaround_, settings_.response_timeout))
        result.drift = turnaround_.quantile(0.95);
    result.trailed = trail_.seen();
    trail_.on_reply(now);
    return_.on_replied();
    learn_of_copies(now, attempt);
    if (trail_.hold() > Duration::zero() && !std::exchange(trail_told_, true))
        result.trail = trail_.hold();
    const bool exception = modbus::exception_of(attempt.reply()).has_value();
    if (const auto& look = attempt.end_look()) clock_drift_.on_look(look->reply, look->whole);
    odd_ = exception ? kOdd : std::max(odd_ - 1, 0);
    damaged_pdu_.clear();
    settle_debt(now, attempt);
    if (group.span && !exception) learn_of_read(group.request, *group.span);
    return result;
}

/// It answers this.
void Station::learn_of_read(const modbus::Request& read, const modbus::Span& span) {
    std::uint32_t& longest = longest_read_[static_cast<std::size_t>(span.table)];
    longest = std::max(longest, span.count);
    if (!cheapest_read_ || span.count < cheapest_read_->span()->count) cheapest_read_ = read;
    if (!largest_read_ || span.count > largest_read_->span()->count) largest_read_ = read;
}

void Station::on_damaged_reply(TimePoint now, const modbus::Request& request, TimePoint sent) {
    damaged_pdu_ = request.pdu();
    if (is_ambiguous(request)) {  // it may have been the reply to any of them
        debt_.pop();
        debt_.add(sent, request.pdu());
        rest_for_owed(now);
    }
    copies_.on_doubt(CopyGuard::kSaidAgain);
    again_until_ = now + CopyGuard::kSaidAgain;
    not_before_ = std::max(not_before_, again_until_);
}

void Station::on_failed(TimePoint now, Verdict verdict, Duration cost,
                        const modbus::Request* write) {
    const bool is_read = write == nullptr;
    if (!is_read) ignored_ = write->pdu();
    read_missed_ = read_missed_ || is_read;
    read_turn_ = !is_read;
    if (verdict == Verdict::silent) adaptive_.on_timeout();
    failed_ = now;
    if (verdict != Verdict::silent) odd_ = kOdd;
    if (health_.offline() || flaky()) ++probes_;
    const int silent = verdict == Verdict::silent ? 1 : 0;
    lately_ = static_cast<std::uint8_t>(lately_ << 1 | silent);
    if (failing()) failing_.spend(now, cost);
    if (!health_.offline()) spend(now, cost, is_read);
}

bool Station::take_half_open(TimePoint now, bool is_read) {
    if (!is_read && woken_by_write_) return false;
    if (!health_.take_half_open(now)) return false;
    woken_by_write_ = !is_read && cheapest_read_;
    return true;
}

bool Station::on_given_up(TimePoint now, Fault fault, bool is_read) {
    ++failed_in_a_row_;
    missed_ = false;
    if (fault == Fault::damaged && !health_.offline()) {
        health_.on_damaged();
        return false;
    }
    if (is_read || !answers_reads()) return health_.on_silence(now, stranger());
    wants_check_ = health_.on_silent_write();
    return false;
}

bool Station::may_retry(const Group& group) const {
    if (group.abandoned() || health_.offline() || failing() || stranger()) return false;
    if (suspect() && !group.first_silence) return false;
    const bool harmless = group.request.is_read() || (settings_.retry_writes && group.repeatable);
    const int failed = group.attempts - (group.doubted.empty() ? 0 : 1);
    return harmless && failed <= settings_.retries;
}

Duration Station::short_wait(std::optional<Duration> line) const {
    const std::optional<Duration> own = slowest();
    const Duration whole = settings_.response_timeout;
    if (!own && !line) return whole;
    return std::min(whole, std::max<Duration>(20ms, (own ? *own : *line) * 3 / 2 + 8ms));
}

Duration Station::patience(const Group& group, std::optional<Duration> line, bool hurry,
                           bool spent) const {
    const Duration whole = settings_.response_timeout;
    if (group.silent_after > Duration::zero()) {
        // A retry behind a whole timeout waits as long as the panel has ever needed; one behind a
        // shorter wait longer than that was.
        if (group.silent_after >= whole) return short_wait(line);
        return settings_.adaptive_timeout ? whole : std::min(whole, 2 * group.silent_after);
    }
    if (group.told_apart) return short_wait(line);
    // Who stopped inside a reply is alive, and may still be held up: the two attempts together wait
    // as long as one.
    if (group.cut_after > Duration::zero() && !health_.offline())
        return std::max(short_wait(line), whole - group.cut_after);
    constexpr int kDear = 16;
    if (health_.offline() && slowest() && turnaround_.known() && probes_ % kDear != kDear - 1) {
        // What a network did to a few replies must not make probes dear: now and then one waits as
        // long as it has ever needed, the others as long as most replies take.
        constexpr double kMost = 0.75;
        const Duration most = std::max<Duration>(20ms, 2 * turnaround_.quantile(kMost) + 8ms);
        return std::min(short_wait(line), most);
    }
    if ((health_.offline() || spent) && !slowest()) {
        // Nobody knows how long it needs: now and then one waits longer, and longer each time.
        constexpr int kOneIn = 4;
        constexpr int kDoublings = 6;
        const int longer = probes_ % kOneIn == kOneIn - 1 ? 1 + probes_ / kOneIn % kDoublings : 0;
        return std::min(whole, short_wait(line) * (1 << longer));
    }
    if (health_.offline() || suspect() || stranger() || spent) return short_wait(line);
    // Not a write: what it needs may be longer, and its outcome is worth waiting for.
    if (hurry && slowest() && group.request.is_read()) return std::min(timeout(), short_wait(line));
    // A write that is not repeated is waited for as long as the configuration says: the panel may
    // just have become slower than it has taught, and nothing else tells whether it was executed.
    const bool repeatable = group.request.is_read() || settings_.retry_writes;
    return repeatable ? timeout() : whole;
}

modbus::Request Station::probe() const {
    if (cheapest_read_) return *cheapest_read_;
    return last_read_ ? *last_read_
                      : modbus::Request::read({modbus::Table::holding_registers, 0, 1});
}

modbus::Request Station::proof() const {
    modbus::Request read = probe();
    if (return_.plainly() || !is_ambiguous(read)) return read;
    const auto told_apart = [&](modbus::Span span, std::uint32_t count) {
        span.count = count;
        read = modbus::Request::read(span);
        return !is_ambiguous(read);
    };
    // A part of what it has answered before, if there is one of a length of its own.
    const modbus::Span known = largest_read_ ? *largest_read_->span() : *read.span();
    for (std::uint32_t count = 1; count <= known.count; ++count)
        if (told_apart(known, count)) return read;
    constexpr std::uint32_t kItems = 0x10000;  // of a table
    constexpr std::uint32_t kBits = 8;         // whose replies have one length
    const std::uint32_t most =
        std::min<std::uint32_t>(known.count + kBits * (Debt::kMost + 1), kItems - known.first);
    for (std::uint32_t count = known.count + 1; count <= most; ++count)
        if (told_apart(known, count)) return read;
    return read;
}

}  // namespace panelgate::arbiter
