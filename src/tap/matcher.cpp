#include "panelgate/tap/matcher.hpp"

#include <algorithm>
#include <utility>

#include "frames.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::tap {

namespace {

Bytes copy_of(ByteView bytes) { return Bytes(bytes.begin(), bytes.end()); }

bool has_form_of_reply(ByteView frame) {
    if (frame[0] == 0) return false;  // a broadcast has no reply
    const modbus::ReplyLength length = modbus::reply_length(frame);
    return length.kind == modbus::ReplyLength::Kind::by_silence || length.length == frame.size();
}

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
        habits.broadcasts.missed();
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

void Matcher::on_answer(Piece piece) {
    if (!piece.ambiguous) return answer(std::move(piece), false);
    switch (read(piece)) {
        case Reading::answer: {
            const bool too_soon = comes_too_soon(piece);
            return answer(std::move(piece), too_soon);
        }
        case Reading::request:
            return on_request(std::move(piece));
        case Reading::open:
            candidate_ = std::move(piece);
            return;
    }
}

void Matcher::answer(Piece piece, bool in_doubt) {
    const Asked asked = *std::exchange(asked_, std::nullopt);
    Habits& habits = of(asked.pending.station);
    const Bytes& request = asked.pending.pdu;
    const ByteView reply = pdu_of(piece);
    const Duration think = std::max<Duration>(piece.begin - asked.end, Duration::zero());
    const std::uint8_t station = asked.pending.station;
    const arbiter::Claims claimed = claims(piece, request);
    const bool broadcast = may_answer_broadcast(piece, true);
    const bool overdue = piece.begin - asked.end >= patience(habits);
    const bool doubted = in_doubt || broadcast || is_doubtful(asked, piece, claimed);
    if (overdue && !doubted) habits.give_up.outwaited(piece.begin - asked.end);
    habits.replied(asked.damaged && asked.damaged_bytes < modbus::kMinAdu);
    Transaction made;
    made.station = station;
    made.request = request;
    made.reply = copy_of(reply);
    made.end = End::answered;
    made.doubtful = doubted || overdue || is_last_again(piece, request);
    made.asked = asked.begin;
    made.sent = asked.end;
    made.replied = piece.begin;
    made.ended = piece.end;
    made.sampled = book_.first_asked(station, request, piece.end - settings_.late_window)
                       .value_or(asked.begin);
    if (!made.doubtful) {
        habits.answered(think, !std::ranges::equal(reply, request));
        habits.broadcasts.answered(piece.end);
    }
    remember(made, broadcast || (in_doubt && is_read(request)), claimed.outstanding);
    note(FrameKind::reply, made.station, piece);
    hold(std::move(made));
    noise_ = false;
    last_end_ = piece.end;
}

/// True if it may belong to another request, by all that was heard before.
bool Matcher::is_doubtful(const Asked& asked, const Piece& piece,
                          const arbiter::Claims& claimed) const {
    const Bytes& request = asked.pending.pdu;
    const Duration think = piece.begin - asked.end;
    // For a function without a length rule, frames may be missed where an adapter joins them.
    const bool unknown_length = !modbus::is_known(request[0]) &&
                                (think > kQuickest || std::ranges::equal(pdu_of(piece), request));
    return unknown_length || claimed.other_outstanding || is_duplicate(piece, request, claimed) ||
           misses_request(asked, think);
}

/// True if the damaged bytes before the reply may be a request, or what was heard of its end. At
/// the station's usual time its master has not gone on yet: a few bytes are noise.
bool Matcher::misses_request(const Asked& asked, Duration think) const {
    if (asked.damaged_bytes >= modbus::kMinAdu) return true;
    const Habits& habits = habits_.at(asked.pending.station);
    return asked.damaged && think > usual(habits) && !habits.is_noisy();
}

/// True if it may answer a broadcast, and its station was not seen to answer none. `asked`: it may
/// be something else, too.
bool Matcher::may_answer_broadcast(const Piece& piece, bool asked) {
    const ByteView pdu = pdu_of(piece);
    if (modbus::exception_of(pdu) || !book_.behind_broadcast(piece.begin, pdu)) return false;
    BroadcastHabit& habit = of(piece.bytes.front()).broadcasts;
    habit.may_have_answered(asked);
    return !habit.answers_none();
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

/// True if it may be the last reply once more, in the place of the true one.
bool Matcher::is_last_again(const Piece& piece, const Bytes& request) {
    const std::uint8_t station = piece.bytes.front();
    const ByteView reply = pdu_of(piece);
    if (!modbus::is_pure_read(request) || reply[0] != request[0]) return false;
    std::optional<Places::Reply> last;
    if (const arbiter::Asked* const known = book_.last_reply(station))
        last = Places::Reply{known->pdu, known->reply};
    Places& places = places_.try_emplace(station, settings_.surplus_memory).first->second;
    return places.answered(piece.end, {request, reply}, last);
}

/// Enters it in the book. A panel answers in order: after a reply that no other request can have
/// had, no earlier one is outstanding. After another, one reply fewer has come than was asked for,
/// and each of these requests may be the one without, until the window of the unanswered one is
/// over.
void Matcher::remember(const Transaction& made, bool unanswered, bool outstanding) {
    Habits& habits = of(made.station);
    const TimePoint open = made.ended - settings_.late_window;
    if (outstanding) {
        if (!book_.first_asked(made.station, made.request, open))
            book_.on_unanswered(made.station, book_.last_sent(made.station), made.request);
    } else if (!made.doubtful) {
        book_.settle(made.station);
        habits.owed = 0;
    }
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
    const bool again = is_repeated(piece);
    if (again) learn_of_copies(piece);
    may_answer_broadcast(piece, true);
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
    if (station == 0) on_broadcast(piece);
    asked_.reset();
}

/// No station answers it, or should.
void Matcher::on_broadcast(const Piece& piece) {
    if (!modbus::is_broadcastable(pdu_of(piece).front())) return;
    book_.on_broadcast(piece.end, copy_of(pdu_of(piece)));
    for (auto& [id, habits] : habits_) {
        if (habits.longest_think()) habits.broadcasts.heard(piece.end);
    }
}

/// Not the answer to the pending request: a late reply, a duplicate, or unknown.
void Matcher::on_reply(Piece piece) {
    const std::uint8_t station = piece.bytes.front();
    const bool missed_request = asked_ ? asked_->damaged : noise_;  // a request, perhaps
    if (asked_) asked_->disturbed = true;
    if (!missed_request && repeats_last(piece)) {
        of(station).repeated = piece.end;
        may_answer_broadcast(piece, true);
        return note(FrameKind::copy, station, piece);
    }
    if (is_second_answer(piece)) {
        held_->doubtful = true;
        of(station).repeated = piece.end;
        book_.on_reply(station, piece.end, held_->request, pdu_of(piece));
    }
    const bool late = claims(piece).outstanding;
    may_answer_broadcast(piece, late);
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
    for (auto& [id, habits] : habits_) habits.broadcasts.missed();
    note(FrameKind::damaged, asked_ ? asked_->pending.station : piece.bytes.front(), piece);
}

Habits& Matcher::of(std::uint8_t station) { return habits_.try_emplace(station).first->second; }

void Matcher::note(FrameKind kind, std::uint8_t station, const Piece& piece) {
    events_.emplace_back(Frame{piece.end, kind, station, piece.bytes});
}

}  // namespace panelgate::tap
