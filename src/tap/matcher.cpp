#include "panelgate/tap/matcher.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::tap {

void GiveUp::seen(Duration interval) {
    seen_.push_back(interval);
    if (seen_.size() > kKept) seen_.pop_front();
    outwaited_.clear();
}

void GiveUp::outwaited(Duration interval) {
    outwaited_.push_back(interval);
    if (outwaited_.size() < kNeeded) return;
    const Duration waited = *std::ranges::min_element(outwaited_);
    std::erase_if(seen_, [&](Duration given_up) { return given_up <= waited; });
    outwaited_.clear();
    refuted_ = true;
}

std::optional<Duration> GiveUp::least() const {
    if (seen_.size() < kNeeded) return std::nullopt;
    return *std::ranges::min_element(seen_);
}

void Habits::answered(Duration think) {
    constexpr int kMemory = 64;  // replies, until one slow reply is nearly forgotten
    longest_ = longest_ ? std::max(think, *longest_ - (*longest_ - think) / kMemory) : think;
    unanswered_.clear();
    usual_ = 0;
}

void Habits::answered_perhaps(Duration think) {
    constexpr int kEnough = 2;
    constexpr Duration kJitter = 2ms;
    const bool usual = longest_ && think <= *longest_ + *longest_ / 4 + kJitter;
    usual_ = usual ? usual_ + 1 : 0;
    if (usual_ < kEnough) return;
    unanswered_.clear();
    usual_ = 0;
}

void Habits::on_unanswered(TimePoint asked, const Bytes& request) {
    unanswered_.push_back({asked, request});
    if (unanswered_.size() > settings_.unanswered) unanswered_.pop_front();
    usual_ = 0;
}

bool Habits::may_answer_other(TimePoint now, const Bytes& request, ByteView reply) const {
    return std::ranges::any_of(unanswered_, [&](const Unanswered& one) {
        return is_open(one, now) && one.request != request && modbus::answers(one.request, reply);
    });
}

std::optional<TimePoint> Habits::first_asked(TimePoint now, const Bytes& request) const {
    const auto same = std::ranges::find_if(unanswered_, [&](const Unanswered& one) {
        return is_open(one, now) && one.request == request;
    });
    if (same == unanswered_.end()) return std::nullopt;
    return same->asked;
}

bool Habits::may_answer_earlier(TimePoint now, ByteView reply) const {
    return std::ranges::any_of(unanswered_, [&](const Unanswered& one) {
        return is_open(one, now) && modbus::answers(one.request, reply);
    });
}

bool Habits::settle(TimePoint now, ByteView reply) {
    const auto answered = std::ranges::find_if(unanswered_, [&](const Unanswered& one) {
        return is_open(one, now) && modbus::answers(one.request, reply);
    });
    if (answered == unanswered_.end()) return false;
    unanswered_.erase(unanswered_.begin(), answered + 1);
    return true;
}

namespace {

/// Shorter than any master's timeout: an adapter's latency timer plus a panel's think time.
constexpr Duration kQuickest = 30ms;

ByteView pdu_of(const Piece& piece) { return modbus::pdu_of(piece.bytes); }

Bytes copy_of(ByteView bytes) { return Bytes(bytes.begin(), bytes.end()); }

bool has_form_of_reply(ByteView frame) {
    if (frame[0] == 0) return false;  // a broadcast has no reply
    const modbus::ReplyLength length = modbus::reply_length(frame);
    return length.kind == modbus::ReplyLength::Kind::by_silence || length.length == frame.size();
}

}  // namespace

Matcher::Matcher(const Settings& settings) : settings_(settings), cutter_(settings) {}

void Matcher::on_rx(TimePoint now, ByteView bytes) {
    cutter_.hear(now, bytes);
    cut(false);
}

void Matcher::on_deadline(TimePoint now) {
    if (!cutter_.empty() && now - cutter_.last() >= settings_.hole) cut(true);
    if (const auto at = resolved_at(); at && now >= *at) {
        answer(*std::exchange(candidate_, std::nullopt), true);
    }
    if (asked_ && !candidate_ && cutter_.empty() && now - asked_->end >= settings_.patience)
        give_up(now);
}

void Matcher::on_line_down(TimePoint now) {
    cut(true);
    if (candidate_) answer(*std::exchange(candidate_, std::nullopt), true);
    if (asked_) {
        asked_->doubtful = true;
        give_up(now);
    }
    for (auto& [id, habits] : habits_) habits.forget_unanswered();
    noise_ = false;
}

std::optional<Event> Matcher::poll_action() {
    if (events_.empty()) return std::nullopt;
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
}

std::optional<TimePoint> Matcher::next_deadline() const {
    if (!cutter_.empty()) return cutter_.last() + settings_.hole;
    if (candidate_) return resolved_at();
    if (asked_) return asked_->end + settings_.patience;
    return std::nullopt;
}

void Matcher::cut(bool silence) {
    while (auto piece = cutter_.next(pending(), silence)) take(std::move(*piece));
}

void Matcher::take(Piece piece) {
    if (candidate_ && resolve(piece)) return;
    switch (piece.kind) {
        case Piece::Kind::answer:
            return on_answer(std::move(piece));
        case Piece::Kind::request:
            return on_request(std::move(piece));
        case Piece::Kind::reply:
            return on_reply(std::move(piece));
        case Piece::Kind::damaged:
            return on_damaged(std::move(piece));
    }
}

/// Decides the candidate by the next piece: if the same bytes follow at once, that is the answer,
/// and the candidate was the repeated request; if the master goes on sooner than it has waited
/// before, the candidate was the answer. True if `piece` is consumed.
bool Matcher::resolve(Piece& piece) {
    const Duration waited = candidate_->begin - asked_->end;
    const Duration behind = piece.begin - candidate_->end;
    Piece candidate = *std::exchange(candidate_, std::nullopt);
    const bool same = piece.kind != Piece::Kind::damaged && piece.bytes == candidate.bytes;
    if (same && behind <= quick(of(asked_->pending.station))) {
        give_up(piece.begin);
        ask(candidate, false);
        answer(std::move(piece), true);
        return true;
    }
    // Frames of functions without a length rule may be missed in between, where an adapter joins
    // them.
    const bool known = modbus::is_known(asked_->pending.pdu.front());
    const bool goes_on =
        known && piece.kind != Piece::Kind::damaged && behind < waited - waited / 4;
    answer(std::move(candidate), !goes_on);
    // It was cut as an answer to the request that is answered now.
    if (piece.kind == Piece::Kind::answer)
        piece.kind = piece.ambiguous ? Piece::Kind::request : Piece::Kind::reply;
    return false;
}

void Matcher::on_answer(Piece piece) {
    if (!piece.ambiguous) return answer(std::move(piece), false);
    switch (read(piece)) {
        case Reading::answer:
            return answer(std::move(piece), false);
        case Reading::request:
            return on_request(std::move(piece));
        case Reading::open:
            candidate_ = std::move(piece);
            return;
    }
}

/// Classifies an answer that may also be the repeated request: soon after the request it is the
/// answer; after the master's timeout the request; in between it is open.
Matcher::Reading Matcher::read(const Piece& piece) const {
    const Habits& habits = habits_.at(asked_->pending.station);
    const Duration waited = piece.begin - asked_->end;
    const Duration late = patience(habits);
    if (waited >= late) return Reading::request;
    return waited <= quick(habits) ? Reading::answer : Reading::open;
}

/// A time that any master waits at least.
Duration Matcher::quick(const Habits& habits) const {
    const Duration usual = habits.longest_think().value_or(Duration::zero());
    return std::min(patience(habits), std::max<Duration>(2 * usual + 10ms, kQuickest));
}

/// A time after which a master has given up.
Duration Matcher::patience(const Habits& habits) const {
    auto least = habits.give_up.least();
    if (!least && !habits.give_up.is_different()) least = give_up_.least();
    return least ? *least - *least / 16 : settings_.usual_give_up;
}

std::optional<TimePoint> Matcher::resolved_at() const {
    if (!candidate_) return std::nullopt;
    return candidate_->end + patience(habits_.at(asked_->pending.station));
}

void Matcher::answer(Piece piece, bool in_doubt) {
    const Asked asked = *std::exchange(asked_, std::nullopt);
    Habits& habits = of(asked.pending.station);
    const Bytes& request = asked.pending.pdu;
    const ByteView reply = pdu_of(piece);
    const Duration think = std::max<Duration>(piece.begin - asked.end, Duration::zero());
    const bool late = habits.may_answer_other(piece.end, request, reply);
    const bool repeats = habits.repeated && piece.end - *habits.repeated < settings_.late_window;
    const bool duplicate =
        repeats && piece.bytes == habits.last_reply && request != habits.last_request;
    Transaction made;
    made.station = asked.pending.station;
    made.request = request;
    made.reply = copy_of(reply);
    made.end = End::answered;
    const bool missed_request = asked.damaged_bytes >= modbus::kMinAdu;  // a request, perhaps
    const bool overdue = piece.begin - asked.end >= patience(habits);
    // For a function without a length rule, frames may be missed where an adapter joins them.
    const bool unknown_length =
        !modbus::is_known(request[0]) && (think > kQuickest || std::ranges::equal(reply, request));
    const bool doubted = in_doubt || unknown_length || late || duplicate || missed_request;
    if (overdue && !doubted) habits.give_up.outwaited(piece.begin - asked.end);
    made.doubtful = doubted || overdue;
    made.asked = asked.begin;
    made.sent = asked.end;
    made.replied = piece.begin;
    made.ended = piece.end;
    made.sampled = habits.first_asked(piece.end, request).value_or(asked.begin);
    if (!made.doubtful) {
        habits.answered(think);
    } else {
        habits.answered_perhaps(think);
    }
    habits.last_request = request;
    habits.last_reply = piece.bytes;
    note(FrameKind::reply, made.station, piece);
    report(std::move(made));
    noise_ = false;
    last_end_ = piece.end;
}

void Matcher::on_request(Piece piece) {
    const Habits& habits = of(piece.bytes.front());
    // A waiting master does not ask: this is an old reply that looks like a request.
    if (asked_ && is_old_reply(habits, piece) &&
        piece.begin - asked_->end < patience(of(asked_->pending.station))) {
        return on_reply(std::move(piece));
    }
    const bool again = asked_ && asked_->pending.station == piece.bytes.front() &&
                       std::ranges::equal(asked_->pending.pdu, pdu_of(piece));
    const bool noise = asked_ ? asked_->damaged : noise_;
    const bool doubtful =
        (noise && has_form_of_reply(piece.bytes)) || (!again && is_old_reply(habits, piece));
    give_up_for(piece);
    ask(piece, doubtful);
}

/// True if it may be a late reply or a duplicate, by earlier requests and replies.
bool Matcher::is_old_reply(const Habits& habits, const Piece& piece) const {
    if (!has_form_of_reply(piece.bytes)) return false;
    return piece.bytes == habits.last_reply || habits.may_answer_earlier(piece.end, pdu_of(piece));
}

/// The master goes on with another request.
void Matcher::give_up_for(const Piece& request) {
    if (!asked_) return;
    Habits& habits = of(asked_->pending.station);
    const Duration waited = request.begin - asked_->end;
    const Duration usual = habits.longest_think().value_or(Duration::zero());
    const bool undisturbed = !asked_->damaged && !asked_->disturbed && !asked_->doubtful;
    if (undisturbed && waited >= 2 * usual + 10ms) {
        habits.give_up.seen(waited);
        give_up_.seen(waited);
    }
    give_up(request.begin);
}

void Matcher::give_up(TimePoint now) {
    const Asked asked = *std::exchange(asked_, std::nullopt);
    of(asked.pending.station).on_unanswered(asked.begin, asked.pending.pdu);
    Transaction made;
    made.station = asked.pending.station;
    made.request = asked.pending.pdu;
    made.end = asked.damaged || asked.wrong ? End::damaged : End::silent;
    made.doubtful = asked.doubtful;
    made.asked = asked.begin;
    made.sent = asked.end;
    made.ended = std::max(now, asked.end);
    made.sampled = asked.begin;
    report(std::move(made));
}

void Matcher::ask(const Piece& piece, bool doubtful) {
    const std::uint8_t station = piece.bytes.front();
    note(FrameKind::heard_request, station, piece);
    noise_ = false;
    last_end_ = piece.end;
    Asked asked;
    asked.pending = {station, copy_of(pdu_of(piece))};
    asked.begin = piece.begin;
    asked.end = piece.end;
    asked.doubtful = doubtful;
    asked_ = std::move(asked);
    if (station != 0 && !modbus::is_never_answered(pdu_of(piece))) return;
    Transaction made;
    made.station = station;
    made.request = asked_->pending.pdu;
    made.end = End::unasked;
    made.doubtful = doubtful;
    made.asked = made.sampled = piece.begin;
    made.sent = made.ended = piece.end;
    report(std::move(made));
    asked_.reset();
}

/// Not the answer to the pending request: a late reply, a duplicate, or unknown.
void Matcher::on_reply(Piece piece) {
    const std::uint8_t station = piece.bytes.front();
    Habits& habits = of(station);
    const bool missed_request = asked_ ? asked_->damaged : noise_;  // a request, perhaps
    if (asked_) asked_->disturbed = true;
    if (!missed_request && piece.bytes == habits.last_reply) {
        habits.repeated = piece.end;
        return note(FrameKind::copy, station, piece);
    }
    const bool late = habits.settle(piece.end, pdu_of(piece));
    if (late) habits.last_reply = piece.bytes;
    if (!late && asked_ && asked_->pending.station == station) asked_->wrong = true;
    note(late ? FrameKind::late : FrameKind::foreign, station, piece);
}

void Matcher::on_damaged(Piece piece) {
    if (asked_) {
        asked_->damaged = true;
        asked_->damaged_bytes += piece.bytes.size();
    } else {
        noise_ = true;
    }
    note(FrameKind::damaged, asked_ ? asked_->pending.station : piece.bytes.front(), piece);
}

Habits& Matcher::of(std::uint8_t station) {
    return habits_.try_emplace(station, settings_).first->second;
}

void Matcher::note(FrameKind kind, std::uint8_t station, const Piece& piece) {
    events_.emplace_back(Frame{piece.end, kind, station, piece.bytes});
}

}  // namespace panelgate::tap
