#include "panelgate/arbiter/requests.hpp"
#include "panelgate/arbiter/timing.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

OutstandingRequests::OutstandingRequests(const StationSettings& settings)
    : timeout_(settings.response_timeout),
      crc_order_(settings.crc_order),
      late_(settings.late_window, settings.response_timeout) {}

void OutstandingRequests::apply(const StationSettings& settings) {
    timeout_ = settings.response_timeout;
    crc_order_ = settings.crc_order;
    late_.apply(settings.late_window, settings.response_timeout);
}

modbus::Request OutstandingRequests::probe() const {
    if (cheapest_read_) return *cheapest_read_;
    return last_read_ ? *last_read_
                      : modbus::Request::read({modbus::Table::holding_registers, 0, 1});
}

modbus::Request OutstandingRequests::proof() const {
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

Claim OutstandingRequests::claim_of(TimePoint now, ByteView pdu) const {
    const bool duplicate = duplicates_.is_duplicate(now, pdu);
    if (duplicate && duplicates_.known())
        return Claim::duplicate;  // the outstanding reply still comes
    if (replies_.fits(pdu)) return Claim::late;
    if (duplicate) return Claim::duplicate;
    if (replies_.fits_closed(pdu, now - kClosedMemory * timeout_)) return Claim::late;
    return duplicates_.is_second(now, pdu) ? Claim::second : Claim::unasked;
}

bool OutstandingRequests::may_be_duplicate(TimePoint now, const Attempt& attempt, bool early,
                                           bool quicker) const {
    const Group& group = attempt.group();
    if (attempt.had_candidate() || attempt.reply() == group.doubted) return false;
    const Bytes& pdu = group.request.pdu();
    return is_duplicate(now, attempt, early) || duplicates_.repeats_itself(now, attempt.reply()) ||
           duplicates_.suspicious(now, pdu, attempt.reply()) ||
           (quicker && duplicates_.repeats_other(now, pdu, attempt.reply()));
}

TimePoint OutstandingRequests::surely_answered(TimePoint started, ByteView reply) const {
    const OutstandingReplies::Entry* const other = replies_.oldest(reply);
    return other != nullptr ? std::min(other->sent, started) : started;
}

void OutstandingRequests::on_asked(TimePoint now, const Group& group, bool in_transit) {
    if (now >= rested() && !in_transit) replies_.lapse();
    if (disordered_at_ && now > *disordered_at_ + timing::kForgetHabit) disordered_at_.reset();
    if (group.span && !group.distinct_length) last_read_ = group.request;
}

void OutstandingRequests::on_unanswered(TimePoint now, const Bytes& pdu, TimePoint sent) {
    damaged_pdu_.clear();
    proved_ = false;
    reconnect_.on_outstanding();
    replies_.add(sent, pdu);
    rest(now);
}

/// Rests until the last request can no longer be answered: its timeout plus the late window.
void OutstandingRequests::rest(TimePoint now) {
    until_ = std::max(now, replies_.last_sent() + timeout_) + late_.value();
}

/// No reply is outstanding any more.
void OutstandingRequests::rest_is_over(TimePoint not_before) {
    not_before_ = not_before;
    until_ = {};
}

void OutstandingRequests::on_damaged_reply(TimePoint now, const modbus::Request& request,
                                           TimePoint sent) {
    damaged_pdu_ = request.pdu();
    if (is_ambiguous(request)) {  // it may have been the reply to any of them
        replies_.pop();
        replies_.add(sent, request.pdu());
        rest(now);
    }
    duplicates_.on_doubt(timing::kRepeatsDamaged);
    again_until_ = now + timing::kRepeatsDamaged;
    not_before_ = std::max(not_before_, again_until_);
}

void OutstandingRequests::on_answered(TimePoint now, const Attempt& attempt, Duration waited) {
    const Group& group = attempt.group();
    proof_unanswered_ = false;
    late_.on_timely();
    reconnect_.on_replied(2 * waited <= timeout_);
    learn_of_duplicates(now, attempt);
    damaged_pdu_.clear();
    settle(now, attempt);
    if (group.span && !modbus::exception_of(attempt.reply()))
        learn_of_read(group.request, *group.span);
}

/// Learns from this reply whether the station sends duplicates.
void OutstandingRequests::learn_of_duplicates(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const bool was_candidate =
        attempt.had_candidate() && duplicates_.is_duplicate(now, attempt.reply());
    if (attempt.reply() == group.doubted || (was_candidate && !group.is_values(attempt.reply()))) {
        duplicates_.on_confirmed(group.request.pdu(), attempt.reply());
    } else if (!group.doubted.empty()) {
        duplicates_.on_denied(group.doubted_at, group.doubted);
    }
    if (const auto first = attempt.first_reply_at(); first && !any())
        duplicates_.on_repeated_reply(now, *first, attempt.reply());
    if (attempt.came_damaged_before()) duplicates_.on_doubt(timing::kRepeatsDamaged);
    duplicates_.on_reply(now, group.request.pdu(), attempt.reply());
}

/// Updates what is outstanding after this reply.
void OutstandingRequests::settle(TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const TimePoint sent = attempt.timing().sent;
    if (attempt.reply() == group.doubted && replies_.size() <= 1) {
        replies_.clear();  // both have come
        rest_is_over(now + duplicates_.take_doubt());
    } else if (replies_.fits(attempt.reply())) {
        // Each attempt may have been answered with it, this one too.
        close(attempt.reply(), true);
        replies_.add(sent, group.request.pdu());
        rest(now);
    } else if (now < again_until_ && late_.worst() > Duration::zero()) {
        // It may be the damaged reply resent, and the reply to this attempt is late.
        on_unanswered(now, group.request.pdu(), sent);
    } else {
        if (!disordered_at_) replies_.close_before(sent, connected_);
        not_before_ = std::max(not_before_, now + duplicates_.take_doubt());
        if (!any()) until_ = {};
    }
}

/// Records a read that it answers.
void OutstandingRequests::learn_of_read(const modbus::Request& read, const modbus::Span& span) {
    std::uint32_t& longest = longest_read_[static_cast<std::size_t>(span.table)];
    longest = std::max(longest, span.count);
    if (!cheapest_read_ || span.count < cheapest_read_->span()->count) cheapest_read_ = read;
    if (!largest_read_ || span.count > largest_read_->span()->count) largest_read_ = read;
}

/// Remembers an unsolicited exception and when it first came.
void OutstandingRequests::remember_refusal(TimePoint now, ByteView pdu) {
    if (!modbus::exception_of(pdu) || is_unsolicited_refusal(now, pdu)) return;
    unsolicited_refusal_.assign(pdu.begin(), pdu.end());
    unsolicited_refusal_at_ = now;
}

OutstandingRequests::Heard OutstandingRequests::on_unsolicited(TimePoint now, ByteView pdu,
                                                               bool asked) {
    Heard heard;
    heard.claim = claim_of(now, pdu);
    const bool may_repeat = now < std::exchange(again_until_, TimePoint{});
    const bool may_be_duplicate = may_repeat || duplicates_.is_duplicate(now, pdu);
    remember_refusal(now, pdu);
    if (heard.claim != Claim::late) {
        duplicates_.on_unasked(now, pdu);
        not_before_ = std::max(not_before_, duplicates_.rest_until());
        return heard;
    }
    if (!replies_.fits(pdu)) return on_disorder(now, pdu);
    // The oldest one whose reply could still come: an older one would overstate the lateness.
    const OutstandingReplies::Entry answered = *replies_.oldest(pdu, now - latest_reply());
    const TimePoint due = answered.sent + timeout_;
    // After a shortened wait it shows how long the panel needs; a reply delayed beyond the whole
    // timeout does not.
    if (now <= due) heard.needed = now - answered.sent;
    heard.lateness = std::max(now - due, Duration::zero());
    const bool may_be_meant = asked && modbus::exception_of(pdu);  // for the request on the wire
    if (heard.lateness > Duration::zero() && !may_be_meant) late_.on_late(heard.lateness);
    // A repetition of the previous reply may be a duplicate, and the outstanding reply still comes.
    if (may_be_duplicate) {
        duplicates_.on_ambiguous(now, pdu);
    } else {
        close(pdu, may_be_meant);
    }
    heard.settled = !any();
    // Later ones are still to come.
    if (reconnect_.answered()) until_ = std::max(until_, now + latest_reply());
    duplicates_.on_reply(now, answered.pdu, Bytes(pdu.begin(), pdu.end()));
    if (heard.settled) rest_is_over(now + duplicates_.settle_time());
    return heard;
}

/// An earlier request is answered after a later one.
OutstandingRequests::Heard OutstandingRequests::on_disorder(TimePoint now, ByteView pdu) {
    disordered_at_ = now;
    const auto answered = replies_.take_closed(pdu, now - kClosedMemory * timeout_);
    Heard heard;
    heard.claim = Claim::late;
    heard.lateness = std::max(now - answered.sent - timeout_, Duration::zero());
    if (heard.lateness > Duration::zero()) late_.on_late(heard.lateness);
    drained_at_ = now + latest_reply();
    duplicates_.on_reply(now, answered.pdu, Bytes(pdu.begin(), pdu.end()));
    return heard;
}

/// This reply came: closes the request that it answers, and those that left before, if it serves in
/// order.
void OutstandingRequests::close(ByteView reply, bool asked) {
    if (disordered_at_) {
        replies_.take(reply);
    } else {
        replies_.close(reply, connected_, asked);
    }
}

void OutstandingRequests::on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes) {
    const Bytes* duplicate = duplicates_.duplicate_in(now, id, bytes, crc_order_);
    if (duplicate == nullptr) return;
    const Bytes reply = *duplicate;
    if (any()) return duplicates_.on_ambiguous(now, reply);
    duplicates_.on_unasked(now, reply);
}

void OutstandingRequests::on_opened(TimePoint now, Duration usual) {
    connected_ = now;
    if (!any()) return;
    reconnect_.on_opened();
    const auto replies = static_cast<int>(replies_.size()) + 1;
    not_before_ = std::max(not_before_, now + std::min(latest_reply(), replies * usual));
}

void OutstandingRequests::on_proved(TimePoint now, TimePoint sent) {
    if (!any() || proved_ || any_since(sent)) return;
    proved_ = true;
    until_ = std::max(until_, now + latest_reply());
}

}  // namespace panelgate::arbiter
