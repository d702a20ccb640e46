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

void Station::add_outstanding(TimePoint now, const Bytes& pdu, TimePoint sent) {
    damaged_pdu_.clear();
    proved_ = false;
    reconnect_.on_outstanding();
    outstanding_.add(sent, pdu);
    rest_for_outstanding(now);
}

/// Rests until the last request can no longer be answered: its timeout plus the late window.
void Station::rest_for_outstanding(TimePoint now) {
    outstanding_until_ =
        std::max(now, outstanding_.last_sent() + settings_.response_timeout) + late_.value();
}

TimePoint Station::surely_answered(TimePoint started, ByteView reply) const {
    const OutstandingReplies::Entry* const other = outstanding_.oldest(reply);
    return other != nullptr ? std::min(other->sent, started) : started;
}

void Station::on_opened(TimePoint now) {
    connected_ = now;
    if (!has_outstanding()) return;
    reconnect_.on_opened();
    const auto replies = static_cast<int>(outstanding_.size()) + 1;
    not_before_ = std::max(not_before_, now + std::min(latest_reply(), replies * usual()));
}

void Station::on_proved(TimePoint now, TimePoint sent) {
    if (!has_outstanding() || proved_ || has_outstanding_since(sent)) return;
    proved_ = true;
    outstanding_until_ =
        std::max(outstanding_until_, now + settings_.response_timeout + late_.value());
}

void Station::on_asked(TimePoint now, const Group& group, bool in_transit) {
    if (now >= rested() && !in_transit) outstanding_.clear();
    asked_ = now;
    if (group.request.is_read()) read_turn_ = wants_check_ = woken_by_write_ = false;
    if (group.span && !group.distinct_length) last_read_ = group.request;
}

Unsolicited Station::judge(TimePoint now, ByteView pdu) const {
    const bool duplicate = duplicates_.is_duplicate(now, pdu);
    if (duplicate && duplicates_.known())
        return Unsolicited::duplicate;  // the outstanding reply still comes
    if (outstanding_.fits(pdu)) return Unsolicited::late;
    if (duplicate) return Unsolicited::duplicate;
    return duplicates_.is_second(now, pdu) ? Unsolicited::second : Unsolicited::unasked;
}

/// Remembers an unsolicited exception and when it first came.
void Station::remember_refusal(TimePoint now, ByteView pdu) {
    if (!modbus::exception_of(pdu) || is_unsolicited_refusal(now, pdu)) return;
    unsolicited_refusal_.assign(pdu.begin(), pdu.end());
    unsolicited_refusal_at_ = now;
}

/// True if it is unknown which of several requests over different connections this reply answers:
/// then none of them is closed. `asked`: one is on the wire, and the reply is an exception that
/// could be its.
bool Station::answers_either(ByteView pdu, bool asked) const {
    const bool may_be_of_open = asked && modbus::exception_of(pdu);
    return outstanding_.spans_connections(pdu, connected_) ||
           (may_be_of_open && outstanding_.oldest(pdu)->sent < connected_);
}

Station::Heard Station::on_unsolicited_frame(TimePoint now, ByteView pdu, bool asked) {
    Heard heard;
    heard.kind = judge(now, pdu);
    const bool may_repeat = now < std::exchange(again_until_, TimePoint{});
    const bool may_be_duplicate = may_repeat || duplicates_.is_duplicate(now, pdu);
    if (heard.kind != Unsolicited::late) {
        remember_refusal(now, pdu);
        duplicates_.on_unasked(now, pdu);
        not_before_ = std::max(not_before_, duplicates_.rest_until());
        if (heard.kind == Unsolicited::duplicate) trail_.on_unsolicited(now);
        return heard;
    }
    // The oldest one whose reply could still come: an older one would overstate the lateness.
    const OutstandingReplies::Entry answered = *outstanding_.oldest(pdu, now - latest_reply());
    const TimePoint sent = answered.sent;
    const TimePoint due = sent + settings_.response_timeout;
    // After a shortened wait it shows how long the panel needs; a reply delayed beyond the whole
    // timeout does not.
    if (now <= due) slowest_.add(now - sent);
    heard.lateness = std::max(now - due, Duration::zero());
    if (heard.lateness > Duration::zero()) late_.on_late(heard.lateness);
    // A repetition of the previous reply may be a duplicate, and the outstanding reply still comes.
    if (may_be_duplicate) {
        duplicates_.on_ambiguous(now, pdu);
    } else if (!answers_either(pdu, asked)) {
        outstanding_.close_before(outstanding_.oldest(pdu)->sent, connected_);
        outstanding_.take(pdu);
    }
    heard.settled = !has_outstanding();
    // Later ones are still to come.
    if (reconnect_.answered())
        outstanding_until_ = std::max(outstanding_until_, now + latest_reply());
    duplicates_.on_reply(now, answered.pdu, Bytes(pdu.begin(), pdu.end()));
    if (heard.settled) rest_is_over(now + duplicates_.settle_time());
    heard.back = health_.on_late_reply(now);
    missed_ = false;
    probes_ = 0;
    return heard;
}

void Station::on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes) {
    const Bytes* duplicate = duplicates_.duplicate_in(now, id, bytes, settings_.crc_order);
    if (duplicate == nullptr) return;
    const Bytes reply = *duplicate;
    if (has_outstanding()) return duplicates_.on_ambiguous(now, reply);
    duplicates_.on_unasked(now, reply);
}

/// Learns from this reply whether the station sends duplicates.
void Station::learn_of_duplicates(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const bool was_candidate =
        attempt.had_candidate() && duplicates_.is_duplicate(now, attempt.reply());
    if (attempt.reply() == group.doubted || (was_candidate && !group.is_values(attempt.reply()))) {
        duplicates_.on_confirmed(group.request.pdu(), attempt.reply());
    } else if (!group.doubted.empty()) {
        duplicates_.on_denied(group.doubted_at, group.doubted);
    }
    if (const auto first = attempt.first_reply_at(); first && !has_outstanding())
        duplicates_.on_repeated_reply(now, *first, attempt.reply());
    if (attempt.came_damaged_before()) duplicates_.on_doubt(DuplicateGuard::kRepeatDelay);
    duplicates_.on_reply(now, group.request.pdu(), attempt.reply());
}

/// Updates the outstanding replies after this reply.
void Station::settle_outstanding(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const TimePoint sent = attempt.timing().sent;
    if (attempt.reply() == group.doubted && outstanding_.size() <= 1) {
        outstanding_.clear();  // both have come
        rest_is_over(now + duplicates_.take_doubt());
    } else if (const OutstandingReplies::Entry* const oldest =
                   outstanding_.oldest(attempt.reply())) {
        // Each attempt may have been answered with it, this one too; those over an earlier
        // connection in any order.
        if (oldest->sent >= connected_) {
            outstanding_.close_before(oldest->sent, connected_);
            outstanding_.take(attempt.reply());
        }
        outstanding_.add(sent, group.request.pdu());
        rest_for_outstanding(now);
    } else if (now < again_until_ && late_.worst() > Duration::zero()) {
        // It may be the damaged reply resent, and the reply to this attempt is late.
        add_outstanding(now, group.request.pdu(), sent);
    } else {
        outstanding_.close_before(sent, connected_);
        not_before_ = std::max(not_before_, now + duplicates_.take_doubt());
        if (!has_outstanding()) outstanding_until_ = {};
    }
}

/// No reply is outstanding any more.
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
    proof_unanswered_ = wants_check_ = read_turn_ = false;
    if (group.request.is_read()) read_missed_ = false;
    failed_in_a_row_ = 0;
    failing_.clear();
    missed_ = false;
    lately_ = result.back ? 0 : static_cast<std::uint8_t>(lately_ << 1);
    if (group.shows_pace()) {
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
    reconnect_.on_replied(2 * waited <= settings_.response_timeout);
    learn_of_duplicates(now, attempt);
    if (trail_.settle_time() > Duration::zero() && !std::exchange(trail_reported_, true))
        result.trail = trail_.settle_time();
    const bool exception = modbus::exception_of(attempt.reply()).has_value();
    if (const auto& look = attempt.end_look()) clock_drift_.on_look(look->reply, look->whole);
    unusual_ = exception ? kUnusualReplies : std::max(unusual_ - 1, 0);
    damaged_pdu_.clear();
    settle_outstanding(now, attempt);
    if (group.span && !exception) learn_of_read(group.request, *group.span);
    return result;
}

/// Records a read that it answers.
void Station::learn_of_read(const modbus::Request& read, const modbus::Span& span) {
    std::uint32_t& longest = longest_read_[static_cast<std::size_t>(span.table)];
    longest = std::max(longest, span.count);
    if (!cheapest_read_ || span.count < cheapest_read_->span()->count) cheapest_read_ = read;
    if (!largest_read_ || span.count > largest_read_->span()->count) largest_read_ = read;
}

void Station::on_damaged_reply(TimePoint now, const modbus::Request& request, TimePoint sent) {
    damaged_pdu_ = request.pdu();
    if (is_ambiguous(request)) {  // it may have been the reply to any of them
        outstanding_.pop();
        outstanding_.add(sent, request.pdu());
        rest_for_outstanding(now);
    }
    duplicates_.on_doubt(DuplicateGuard::kRepeatDelay);
    again_until_ = now + DuplicateGuard::kRepeatDelay;
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
    if (verdict != Verdict::silent) unusual_ = kUnusualReplies;
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
    if (is_read || !answers_reads()) return health_.on_silence(now, unheard());
    wants_check_ = health_.on_silent_write();
    return false;
}

bool Station::may_retry(const Group& group) const {
    if (group.abandoned() || health_.offline() || failing() || unheard()) return false;
    if (missed_last() && !group.first_silence) return false;
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

Duration Station::patience(const Group& group, std::optional<Duration> line, bool urgent,
                           bool flaky_beside_others) const {
    const Duration whole = settings_.response_timeout;
    if (group.silent_after > Duration::zero()) {
        // A retry after a whole timeout waits as long as the panel has ever needed; one after a
        // shorter wait waits longer than that.
        if (group.silent_after >= whole) return short_wait(line);
        return settings_.adaptive_timeout ? whole : std::min(whole, 2 * group.silent_after);
    }
    if (group.distinct_length) return short_wait(line);
    // A station that stopped inside a reply is alive but may still be delayed: the two attempts
    // together wait as long as one.
    if (group.cut_after > Duration::zero() && !health_.offline())
        return std::max(short_wait(line), whole - group.cut_after);
    constexpr int kDear = 16;
    if (health_.offline() && slowest() && turnaround_.known() && probes_ % kDear != kDear - 1) {
        // A few replies delayed by a network must not make probes long: one in kDear waits as long
        // as it has ever needed, the others as long as most replies take.
        constexpr double kMost = 0.75;
        const Duration most = std::max<Duration>(20ms, 2 * turnaround_.quantile(kMost) + 8ms);
        return std::min(short_wait(line), most);
    }
    if ((health_.offline() || flaky_beside_others) && !slowest()) {
        // Its think time is unknown: one in kOneIn waits longer, and longer each time.
        constexpr int kOneIn = 4;
        constexpr int kDoublings = 6;
        const int longer = probes_ % kOneIn == kOneIn - 1 ? 1 + probes_ / kOneIn % kDoublings : 0;
        return std::min(whole, short_wait(line) * (1 << longer));
    }
    if (health_.offline() || missed_last() || unheard() || flaky_beside_others)
        return short_wait(line);
    // Not a write: it may need longer, and its outcome is worth waiting for.
    if (urgent && slowest() && group.request.is_read())
        return std::min(timeout(), short_wait(line));
    // A write that is not repeated waits for the configured time: the panel may have become slower,
    // and only the reply shows whether it was executed.
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
    if (reconnect_.only_known_reads() || !is_ambiguous(read)) return read;
    const auto is_distinct = [&](modbus::Span span, std::uint32_t count) {
        span.count = count;
        read = modbus::Request::read(span);
        return !is_ambiguous(read);
    };
    // A part of what it has answered before, if its length is distinct.
    const modbus::Span known = largest_read_ ? *largest_read_->span() : *read.span();
    for (std::uint32_t count = 1; count <= known.count; ++count)
        if (is_distinct(known, count)) return read;
    constexpr std::uint32_t kItems = 0x10000;  // of a table
    constexpr std::uint32_t kBits = 8;         // whose replies have equal length
    const std::uint32_t most = std::min<std::uint32_t>(
        known.count + kBits * (OutstandingReplies::kMost + 1), kItems - known.first);
    for (std::uint32_t count = known.count + 1; count <= most; ++count)
        if (is_distinct(known, count)) return read;
    return read;
}

}  // namespace panelgate::arbiter
