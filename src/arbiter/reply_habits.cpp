#include "panelgate/arbiter/reply_habits.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

using fact::when;

modbus::Request ReplyHabits::proof(const OutstandingRequests& book) const {
    modbus::Request read = reads_.probe();
    if (reconnect_.only_known_reads() || !book.is_ambiguous(id_, read)) return read;
    const auto is_distinct = [&](modbus::Span span, std::uint32_t count) {
        span.count = count;
        read = modbus::Request::read(span);
        return !book.is_ambiguous(id_, read);
    };
    // A part of what it has answered before, if its length is distinct.
    const modbus::Span known = reads_.largest();
    for (std::uint32_t count = 1; count <= known.count; ++count)
        if (is_distinct(known, count)) return read;
    constexpr std::uint32_t kItems = 0x10000;  // of a table
    constexpr std::uint32_t kBits = 8;         // whose replies have equal length
    const std::uint32_t most = std::min<std::uint32_t>(
        known.count + kBits * (OutstandingRequests::kMost + 1), kItems - known.first);
    for (std::uint32_t count = known.count + 1; count <= most; ++count)
        if (is_distinct(known, count)) return read;
    return read;
}

Claims ReplyHabits::claims(const OutstandingRequests& book, TimePoint now, ByteView pdu,
                           const Attempt* attempt) const {
    OutstandingRequests::Windows windows;
    windows.closed = now - kClosedMemory * late_.timeout();
    windows.passed = now - latest_reply();
    if (attempt == nullptr) return book.claims(now, id_, pdu, windows);
    windows.contested = attempt->timing().started;
    windows.foreign = attempt->timing().started - late_.timeout();
    return book.claims(now, id_, pdu, windows, attempt->group().request.pdu());
}

Facts ReplyHabits::facts(const OutstandingRequests& book, TimePoint now, ByteView pdu) const {
    const Claims claims = this->claims(book, now, pdu);
    return when(claims.other_master, fact::other_master) | when(claims.repeats, fact::repeats) |
           when(duplicates_.known(), fact::sends_twice) |
           when(claims.outstanding, fact::outstanding) | when(claims.closed, fact::closed) |
           when(claims.has_last_form, fact::last_form) |
           when(broadcast_.delay.has_value(), fact::answers_all) | fact::known;
}

bool ReplyHabits::may_be_duplicate(TimePoint now, const Attempt& attempt, const Claims& claims,
                                   bool early, bool quicker) const {
    const Group& group = attempt.group();
    if (attempt.answers().had_candidate() || attempt.reply() == group.doubted) return false;
    return (early && group.attempts <= 1 && claims.repeats) ||
           duplicates_.repeats_itself(now, claims.repeated) ||
           duplicates_.suspicious(now, group.request.pdu(), attempt.reply(), claims) ||
           (quicker && claims.repeats_other) ||
           (attempt.may_have_collided() && claims.repeats && !group.is_values(attempt.reply()));
}

const BookEntry* ReplyHabits::earlier_write(const OutstandingRequests& book, TimePoint now,
                                            ByteView write, ByteView confirmation) const {
    if (!duplicates_.suspected(now)) return nullptr;
    if (modbus::exception_of(confirmation) || modbus::returns_values(write)) return nullptr;
    const TimePoint given = book.given(id_, now, confirmation, now);
    if (given == TimePoint{}) return nullptr;
    const BookEntry* const earlier = book.last_reply(id_, given + Duration{1});
    return std::ranges::equal(earlier->pdu, write) ? nullptr : earlier;
}

void ReplyHabits::on_asked(OutstandingRequests& book, TimePoint now, const Group& group,
                           bool in_transit) {
    if (now >= rested() && !in_transit) book.lapse(id_);
    if (disordered_at_ && now > *disordered_at_ + timing::kForgetHabit) disordered_at_.reset();
    announced_.forget(now);
    if (!group.request.is_read()) book.on_written(id_, group.request.pdu());
    if (group.span && !group.distinct_length) reads_.on_wanted(group.request);
}

void ReplyHabits::on_unanswered(OutstandingRequests& book, TimePoint now, const Bytes& pdu,
                                TimePoint sent, bool announced) {
    book.forget_damaged(id_);
    proved_ = false;
    reconnect_.on_outstanding();
    if (announced) announced_.on_announced();
    book.on_unanswered(id_, sent, pdu, announced);
    rest(book, now);
}

void ReplyHabits::on_doubted(OutstandingRequests& book, TimePoint now, const Group& group,
                             TimePoint sent) {
    if (group.is_values(group.doubted))
        remember(book, group.doubted_at, group.request.pdu(), group.doubted);
    on_unanswered(book, now, group.request.pdu(), sent);
}

/// Rests until the last request can no longer be answered: its timeout plus the late window.
void ReplyHabits::rest(const OutstandingRequests& book, TimePoint now) {
    until_ = std::max(now, book.last_sent(id_) + late_.timeout()) + late_.value();
}

/// No reply is outstanding any more.
void ReplyHabits::rest_is_over(TimePoint not_before) {
    not_before_ = not_before;
    until_ = {};
}

void ReplyHabits::on_damaged_reply(OutstandingRequests& book, TimePoint now,
                                   const modbus::Request& request, TimePoint sent) {
    book.on_damaged(id_, sent, request.pdu());
    if (book.is_ambiguous(id_, request)) {  // it may have been the reply to any of them
        book.take_first(id_);
        book.on_unanswered(id_, sent, request.pdu());
        rest(book, now);
    }
    duplicates_.on_doubt(timing::kRepeatsDamaged);
    again_until_ = now + timing::kRepeatsDamaged;
    not_before_ = std::max(not_before_, again_until_);
}

void ReplyHabits::on_answered(OutstandingRequests& book, TimePoint now, const Attempt& attempt,
                              Duration waited) {
    const Group& group = attempt.group();
    if (group.request.access().write && teaches_echo_of_writes(group.request))
        remember_confirmation(attempt.reply());
    proof_unanswered_ = false;
    late_.on_timely();
    reconnect_.on_replied(2 * waited <= late_.timeout());
    learn_of_duplicates(book, now, attempt);
    book.forget_damaged(id_);
    settle(book, now, attempt);
    if (group.span && !modbus::exception_of(attempt.reply()))
        reads_.on_answered(group.request, *group.span);
}

void ReplyHabits::remember_confirmation(const Bytes& reply) {
    if (modbus::exception_of(reply)) return;
    const auto place = std::ranges::find_if(
        confirmations_, [&](const Bytes& one) { return one.empty() || one[0] == reply[0]; });
    if (place != confirmations_.end()) *place = reply;
}

/// A reply of `at` that was doubted has been checked.
void ReplyHabits::judge_doubted(const OutstandingRequests& book, ByteView request,
                                const Bytes& doubted, TimePoint at, bool was_true) {
    if (was_true) return duplicates_.on_confirmed(request, doubted);
    const TimePoint repeated = book.given(id_, at, doubted, at);
    // A value that only came too soon was no repetition.
    if (repeated != TimePoint{} || modbus::exception_of(doubted))
        duplicates_.on_denied(at, repeated);
}

/// True if this may be the reply to a request that was refused: the last one, or the one before,
/// where the last reply may have been its reply.
bool ReplyHabits::follows_refusal(const OutstandingRequests& book, TimePoint now,
                                  ByteView pdu) const {
    const auto was_refused = [&](const BookEntry* one) {
        return one != nullptr && now - one->replied <= latest_reply() &&
               AnnouncedReplies::may_be_followed(one->reply) && modbus::answers(one->pdu, pdu);
    };
    const BookEntry* const last = book.last_reply(id_);
    return !modbus::exception_of(pdu) &&
           (was_refused(last) ||
            (last != nullptr && was_refused(book.last_reply(id_, last->replied))));
}

/// Learns from this reply whether the station sends duplicates.
void ReplyHabits::learn_of_duplicates(OutstandingRequests& book, TimePoint now,
                                      const Attempt& attempt) {
    const Group& group = attempt.group();
    const Bytes& reply = attempt.reply();
    const auto given = [&](TimePoint at, const Bytes& said, TimePoint before = TimePoint::max()) {
        return book.given(id_, at, said, before);
    };
    if (!group.doubted.empty()) duplicates_.on_asked_again(attempt.answers().contradicted());
    const bool was_candidate =
        attempt.answers().had_candidate() && given(now, reply) != TimePoint{};
    if (reply == group.doubted || (was_candidate && !group.is_values(reply))) {
        duplicates_.on_confirmed(group.request.pdu(), reply);
    } else if (!group.doubted.empty()) {
        judge_doubted(book, group.request.pdu(), group.doubted, group.doubted_at, false);
    }
    if (const auto first = attempt.answers().first_came(); first && !book.any(id_))
        duplicates_.on_repeated_reply(now, *first, given(*first, reply));
    if (attempt.came_damaged_before()) duplicates_.on_doubt(timing::kRepeatsDamaged);
    remember(book, now, group.request.pdu(), reply);
}

/// Updates what is outstanding after this reply.
void ReplyHabits::settle(OutstandingRequests& book, TimePoint now, const Attempt& attempt) {
    const Group& group = attempt.group();
    const TimePoint sent = attempt.timing().sent;
    const TimePoint settled = now + duplicates_.take_doubt();
    not_before_ = std::max(not_before_, settled);
    if (attempt.reply() == group.doubted && book.count(id_) <= 1) {
        book.settle(id_);  // both have come
        rest_is_over(settled);
    } else if (announced_.announces(attempt.reply())) {
        // The reply comes later. Of another request's, too: which one it refers to is unknown.
        on_unanswered(book, now, group.request.pdu(), sent, true);
    } else if (book.first(id_, attempt.reply()) != nullptr) {
        // Each attempt may have been answered with it, this one too.
        close(book, attempt.reply(), true);
        book.on_unanswered(id_, sent, group.request.pdu());
        rest(book, now);
    } else if (now < again_until_ && late_.ever()) {
        // It may be the damaged reply resent, and the reply to this attempt is late.
        on_unanswered(book, now, group.request.pdu(), sent);
    } else {
        if (!disordered_at_) book.pass(id_, sent);
        if (!book.any(id_)) until_ = {};
    }
}

ReplyHabits::Heard ReplyHabits::on_unsolicited(OutstandingRequests& book, TimePoint now, Done done,
                                               ByteView pdu, bool asked) {
    const bool may_repeat =
        now < std::exchange(again_until_, TimePoint{}) || book.given(id_, now, pdu) != TimePoint{};
    if (modbus::exception_of(pdu)) book.on_refusal(id_, now, pdu);
    if (asked && is_last_confirmation(pdu)) repeated_at_ = now;
    const bool is_surplus =
        done == Done::unasked || done == Done::second || done == Done::duplicate;
    if (is_surplus && follows_refusal(book, now, pdu)) {
        announced_.on_followed(now);
        return {};
    }
    // Right behind the last reply and answering the same: one of the two is surplus.
    const BookEntry* const last = book.last_reply(id_);
    if ((done == Done::second || done == Done::disorder) && last != nullptr &&
        modbus::answers(last->pdu, pdu))
        duplicates_.on_surplus(now, now - last->replied);
    if (done == Done::late) return on_late(book, now, pdu, asked, may_repeat);
    if (done == Done::disorder) return on_disorder(book, now, pdu);
    on_unasked(book, now, done, pdu);
    return {};
}

/// Neither requested nor outstanding.
void ReplyHabits::on_unasked(OutstandingRequests& book, TimePoint now, Done done, ByteView pdu) {
    if (const TimePoint given = book.given(id_, now, pdu); given != TimePoint{}) {
        // BookEntry twice, answered twice: values that rarely change make no copy of the second.
        if (!book.take_first_of_two(id_, pdu, now - kClosedMemory * late_.timeout()))
            duplicates_.on_copy(now, given, book.last_reply(id_)->replied);
    } else if (done == Done::second && book.on_followed(id_)) {
        duplicates_.learn(now, now - book.last_reply(id_)->replied);
    }
    not_before_ = std::max(not_before_, duplicates_.rest_until());
}

ReplyHabits::Heard ReplyHabits::on_late(OutstandingRequests& book, TimePoint now, ByteView pdu,
                                        bool asked, bool may_repeat) {
    Heard heard;
    // The oldest one whose reply could still come: an older one would overstate the lateness.
    const BookEntry answered = *book.first(id_, pdu, now - latest_reply());
    const TimePoint due = answered.sent + late_.timeout();
    if (answered.announced) announced_.on_kept();
    const bool may_be_meant = asked && modbus::exception_of(pdu);  // for the request on the wire
    // After a shortened wait it shows how long the panel needs; a reply delayed beyond the whole
    // timeout does not, unless it was to a later request.
    heard.at_least = now > due;
    const TimePoint sent =
        heard.at_least ? book.first(id_, pdu, TimePoint::max())->sent : answered.sent;
    if (now <= sent + late_.timeout() && !may_be_meant) heard.needed = now - sent;
    heard.lateness = std::max(now - due, Duration::zero());
    if (heard.lateness > Duration::zero() && !may_be_meant) late_.on_late(heard.lateness);
    // A repetition of the previous reply may be a duplicate, and the outstanding reply still comes.
    if (may_repeat) {
        duplicates_.on_ambiguous(now, book.given(id_, now, pdu));
    } else if (announced_.announces(pdu)) {
        book.announce(id_, pdu);
    } else {
        close(book, pdu, may_be_meant);
    }
    heard.settled = !book.any(id_);
    // Later ones are still to come.
    if (reconnect_.answered()) until_ = std::max(until_, now + latest_reply());
    remember(book, now, answered.pdu, pdu);
    if (heard.settled) rest_is_over(now + duplicates_.settle_time());
    return heard;
}

/// An earlier request is answered after a later one.
ReplyHabits::Heard ReplyHabits::on_disorder(OutstandingRequests& book, TimePoint now,
                                            ByteView pdu) {
    disordered_at_ = now;
    const BookEntry answered = book.take_closed(id_, pdu, now - kClosedMemory * late_.timeout());
    Heard heard;
    heard.lateness = std::max(now - answered.sent - late_.timeout(), Duration::zero());
    if (heard.lateness > Duration::zero()) late_.on_late(heard.lateness);
    drained_at_ = now + latest_reply();
    remember(book, now, answered.pdu, pdu);
    return heard;
}

/// This reply came: closes the request that it answers, and those that left before, if it serves in
/// order.
void ReplyHabits::close(OutstandingRequests& book, ByteView reply, bool asked) {
    if (disordered_at_) {
        book.take(id_, reply);
    } else {
        book.close(id_, reply, asked);
    }
}

void ReplyHabits::on_damaged_bytes(const OutstandingRequests& book, TimePoint now, ByteView bytes,
                                   modbus::CrcOrder order) {
    const Bytes* duplicate = book.given_in(now, id_, bytes, order);
    if (duplicate == nullptr) return;
    const TimePoint given = book.given(id_, now, *duplicate);
    if (book.any(id_)) return duplicates_.on_ambiguous(now, given);
    duplicates_.on_copy(now, given, book.last_reply(id_)->replied);
}

void ReplyHabits::on_opened(const OutstandingRequests& book, TimePoint now, Duration usual) {
    if (!book.any(id_)) return;
    reconnect_.on_opened();
    const auto replies = static_cast<int>(book.count(id_)) + 1;
    not_before_ = std::max(not_before_, now + std::min(latest_reply(), replies * usual));
}

void ReplyHabits::on_proved(const OutstandingRequests& book, TimePoint now, TimePoint sent) {
    if (!book.any(id_) || proved_ || book.any_since(id_, sent)) return;
    proved_ = true;
    until_ = std::max(until_, now + latest_reply());
}

}  // namespace panelgate::arbiter
