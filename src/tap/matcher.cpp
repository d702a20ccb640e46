#include "panelgate/tap/matcher.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::tap {

namespace {

/// Shorter than nearly all masters' timeouts: an adapter's latency timer plus a panel's think time.
constexpr Duration kQuickest = 30ms;

/// The same, as far as nothing is known of its panel.
constexpr Duration kAtOnce = 20ms;

ByteView pdu_of(const Piece& piece) { return modbus::pdu_of(piece.bytes); }

Bytes copy_of(ByteView bytes) { return Bytes(bytes.begin(), bytes.end()); }

bool has_form_of_reply(ByteView frame) {
    if (frame[0] == 0) return false;  // a broadcast has no reply
    const modbus::ReplyLength length = modbus::reply_length(frame);
    return length.kind == modbus::ReplyLength::Kind::by_silence || length.length == frame.size();
}

bool is_read(ByteView pdu) { return pdu[0] <= modbus::kReadInputRegisters; }

/// True if so many damaged bytes are its reply, which is not owed any more. A few may be lost.
bool is_damaged_reply(ByteView request, std::size_t damaged) {
    constexpr std::size_t kLost = 2;
    const auto expected = modbus::reply_length_from_request(request);
    return expected && damaged + kLost >= *expected;
}

/// True if the panel says that it will do it, or is busy with it: the reply may follow.
bool announces_reply(ByteView reply) {
    const auto code = modbus::exception_of(reply);
    return code == static_cast<std::uint8_t>(modbus::ExceptionCode::acknowledge) ||
           code == static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
}

}  // namespace

Matcher::Matcher(const Settings& settings)
    : settings_(settings), cutter_(settings), book_(settings.unanswered) {}

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
    if (held_ && cutter_.empty() && now >= held_until_) tell_held();
}

void Matcher::on_line_down(TimePoint now) {
    cut(true);
    if (candidate_) answer(*std::exchange(candidate_, std::nullopt), true);
    if (asked_) {
        asked_->doubtful = true;
        give_up(now);
    }
    tell_held();
    for (auto& [id, habits] : habits_) {
        book_.settle(id);
        habits.owed = 0;
    }
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
    if (held_) return held_until_;
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

/// Decides the candidate by the next piece. True if `piece` is consumed.
bool Matcher::resolve(Piece& piece) {
    Piece candidate = *std::exchange(candidate_, std::nullopt);
    const bool echo = std::ranges::equal(asked_->pending.pdu, pdu_of(candidate));
    if (echo ? resolve_echo(candidate, piece) : resolve_read(candidate, piece)) return true;
    // It was cut as an answer to the request that is answered now.
    if (piece.kind == Piece::Kind::answer)
        piece.kind = piece.ambiguous ? Piece::Kind::request : Piece::Kind::reply;
    return false;
}

/// If the same bytes follow at once, that is the answer, and the candidate was the repeated
/// request; if the master goes on sooner than it has waited before, the candidate was the answer.
bool Matcher::resolve_echo(Piece& candidate, Piece& piece) {
    const Duration waited = candidate.begin - asked_->end;
    const Duration behind = piece.begin - candidate.end;
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
    return false;
}

/// The candidate has the form of a read of the same function. It was one if the same follows, or
/// what answers it.
bool Matcher::resolve_read(Piece& candidate, Piece& piece) {
    const Habits& habits = of(asked_->pending.station);
    const Duration waited = candidate.begin - asked_->end;
    const Duration behind = piece.begin - candidate.end;
    const bool heard = piece.kind != Piece::Kind::damaged;
    const bool is_asked = habits.has_asked(pdu_of(candidate));
    const bool same = heard && piece.bytes == candidate.bytes;
    const bool answers = heard && !same && piece.bytes.front() == candidate.bytes.front() &&
                         modbus::answers(pdu_of(candidate), pdu_of(piece)) &&
                         !habits.has_asked(pdu_of(piece));
    if (!same && !answers) {
        answer(std::move(candidate), !heard || is_asked || behind >= waited - waited / 4);
        return false;
    }
    give_up(candidate.begin);
    ask(candidate, false);
    if (answers) {
        answer(std::move(piece), !is_asked);
    } else {
        on_request(std::move(piece));
    }
    return true;
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

/// Classifies an answer that may also be a request: at the station's usual time it is the answer,
/// unless its master is known to ask that; after the master's timeout it is the request; in between
/// it is open.
Matcher::Reading Matcher::read(const Piece& piece) const {
    const Habits& habits = habits_.at(asked_->pending.station);
    const Duration waited = piece.begin - asked_->end;
    if (waited >= patience(habits)) return Reading::request;
    if (habits.has_asked(pdu_of(piece))) return Reading::open;
    return waited <= usual(habits) ? Reading::answer : Reading::open;
}

/// The station answers so soon as a rule, and no master repeats a request so soon.
Duration Matcher::usual(const Habits& habits) const {
    constexpr Duration kJitter = 2ms;
    const Duration think = habits.usual_think().value_or(Duration::zero());
    return std::min(patience(habits), std::max(think + think / 8 + kJitter, kAtOnce));
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
    const std::uint8_t station = asked.pending.station;
    const arbiter::Claims claimed = claims(piece, request);
    const bool missed_request = asked.damaged_bytes >= modbus::kMinAdu;  // a request, perhaps
    const bool overdue = piece.begin - asked.end >= patience(habits);
    // For a function without a length rule, frames may be missed where an adapter joins them.
    const bool unknown_length =
        !modbus::is_known(request[0]) && (think > kQuickest || std::ranges::equal(reply, request));
    const bool doubted = in_doubt || unknown_length || claimed.other_outstanding ||
                         is_duplicate(piece, request, claimed) || missed_request;
    if (overdue && !doubted) habits.give_up.outwaited(piece.begin - asked.end);
    Transaction made;
    made.station = station;
    made.request = request;
    made.reply = copy_of(reply);
    made.end = End::answered;
    made.doubtful = doubted || overdue;
    made.asked = asked.begin;
    made.sent = asked.end;
    made.replied = piece.begin;
    made.ended = piece.end;
    made.sampled = book_.first_asked(station, request, piece.end - settings_.late_window)
                       .value_or(asked.begin);
    if (!made.doubtful) habits.answered(think);
    remember(made, in_doubt, claimed.outstanding);
    note(FrameKind::reply, made.station, piece);
    hold(std::move(made));
    noise_ = false;
    last_end_ = piece.end;
}

/// True if it repeats the reply to another request, and its station is known to send copies.
bool Matcher::is_duplicate(const Piece& piece, const Bytes& request,
                           const arbiter::Claims& claimed) const {
    const std::uint8_t station = piece.bytes.front();
    const auto repeated = habits_.at(station).repeated;
    if (!repeated || piece.end - *repeated >= settings_.surplus_memory) return false;
    return claimed.repeats_other ||
           (repeats_last(piece) && request != book_.last_reply(station)->pdu);
}

/// Enters it in the book. A panel answers in order: after a reply that no other request can have
/// had, no earlier one is outstanding. After another, one reply fewer has come than was asked for,
/// and each of these requests may be the one without, until the window of the unanswered one is
/// over.
void Matcher::remember(const Transaction& made, bool in_doubt, bool outstanding) {
    Habits& habits = of(made.station);
    const TimePoint open = made.ended - settings_.late_window;
    if (outstanding) {
        if (!book_.first_asked(made.station, made.request, open))
            book_.on_unanswered(made.station, book_.last_sent(made.station), made.request);
    } else if (!made.doubtful) {
        book_.settle(made.station);
        habits.owed = 0;
    }
    const bool unanswered = in_doubt && is_read(made.request);
    if (unanswered || announces_reply(made.reply)) {
        book_.on_unanswered(made.station, made.asked, made.request);
        ++habits.owed;
    }
    book_.on_reply(made.station, made.ended, made.request, made.reply);
    if (!made.doubtful && is_read(made.request) &&
        has_form_of_reply(modbus::encode_adu(made.station, made.request)))
        habits.asks(made.request);
}

/// Another answer would come as late as this station has ever needed.
void Matcher::hold(Transaction made) {
    if (made.doubtful) return report(std::move(made));
    const Duration longest = of(made.station).longest_think().value_or(Duration::zero());
    const TimePoint latest = made.sent + longest + longest / 4;
    held_until_ = std::max(latest, made.ended) + kQuickest;
    held_ = std::move(made);
}

void Matcher::tell_held() {
    if (held_) report(*std::exchange(held_, std::nullopt));
}

/// True if the request that was answered last has another answer now.
bool Matcher::is_second_answer(const Piece& piece) const {
    return held_ && held_->station == piece.bytes.front() &&
           modbus::answers(held_->request, pdu_of(piece));
}

void Matcher::on_request(Piece piece) {
    // A waiting master does not ask: this is an old reply that looks like a request.
    if (asked_ && is_old_reply(piece) &&
        piece.begin - asked_->end < patience(of(asked_->pending.station))) {
        return on_reply(std::move(piece));
    }
    const bool again = asked_ && asked_->pending.station == piece.bytes.front() &&
                       std::ranges::equal(asked_->pending.pdu, pdu_of(piece));
    const bool noise = asked_ ? asked_->damaged : noise_;
    const bool doubtful =
        (noise && has_form_of_reply(piece.bytes)) || (!again && is_old_reply(piece));
    give_up_for(piece);
    ask(piece, doubtful);
}

/// What the frame may be besides the answer to the request that is open.
arbiter::Claims Matcher::claims(const Piece& piece, ByteView open) const {
    arbiter::OutstandingRequests::Windows windows;
    windows.outstanding = piece.end - settings_.late_window;
    return book_.claims(piece.end, piece.bytes.front(), pdu_of(piece), windows, open);
}

/// True if its station has said the same last.
bool Matcher::repeats_last(const Piece& piece) const {
    const arbiter::Asked* const last = book_.last_reply(piece.bytes.front());
    return last != nullptr && std::ranges::equal(last->reply, pdu_of(piece));
}

/// True if it may be a late reply or a duplicate, by earlier requests and replies.
bool Matcher::is_old_reply(const Piece& piece) const {
    const auto known = habits_.find(piece.bytes.front());
    if (known != habits_.end() && known->second.has_asked(pdu_of(piece))) return false;
    return has_form_of_reply(piece.bytes) && (repeats_last(piece) || claims(piece).outstanding);
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
    if (!is_damaged_reply(asked.pending.pdu, asked.damaged_bytes)) {
        ++of(asked.pending.station).owed;
        book_.on_unanswered(asked.pending.station, asked.begin, asked.pending.pdu);
    }
    Transaction made;
    made.station = asked.pending.station;
    made.request = asked.pending.pdu;
    made.end = asked.damaged ? End::damaged : asked.wrong ? End::wrong : End::silent;
    made.damaged = asked.damaged_bytes;
    made.doubtful = asked.doubtful;
    made.asked = asked.begin;
    made.sent = asked.end;
    made.ended = std::max(now, asked.end);
    made.sampled = asked.begin;
    report(std::move(made));
}

void Matcher::ask(const Piece& piece, bool doubtful) {
    const std::uint8_t station = piece.bytes.front();
    tell_held();
    of(station);  // known from now on
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
    const bool missed_request = asked_ ? asked_->damaged : noise_;  // a request, perhaps
    if (asked_) asked_->disturbed = true;
    if (!missed_request && repeats_last(piece)) {
        of(station).repeated = piece.end;
        return note(FrameKind::copy, station, piece);
    }
    if (is_second_answer(piece)) {
        held_->doubtful = true;
        of(station).repeated = piece.end;
        book_.on_reply(station, piece.end, held_->request, pdu_of(piece));
    }
    const bool late = claims(piece).outstanding;
    if (late) close(piece);
    if (!late && asked_ && asked_->pending.station == station) asked_->wrong = true;
    note(late ? FrameKind::late : FrameKind::foreign, station, piece);
}

/// The late reply closes its request and all earlier ones; the last that was owed closes all.
void Matcher::close(const Piece& piece) {
    const std::uint8_t station = piece.bytes.front();
    const ByteView reply = pdu_of(piece);
    const TimePoint open = piece.end - settings_.late_window;
    const Bytes request = book_.first(station, reply, open)->pdu;
    book_.lapse(station, open);
    book_.close(station, reply, false);
    book_.on_reply(station, piece.end, request, reply);
    Habits& habits = of(station);
    habits.owed = std::max(habits.owed - 1, 0);
    if (habits.owed == 0) book_.settle(station);
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

Habits& Matcher::of(std::uint8_t station) { return habits_.try_emplace(station).first->second; }

void Matcher::note(FrameKind kind, std::uint8_t station, const Piece& piece) {
    events_.emplace_back(Frame{piece.end, kind, station, piece.bytes});
}

}  // namespace panelgate::tap
