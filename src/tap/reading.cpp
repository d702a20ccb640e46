// Whether a frame is the answer to the open request, or a request that looks like it.
#include <algorithm>
#include <utility>

#include "frames.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/tap/matcher.hpp"

namespace panelgate::tap {

namespace {

/// Shorter than any master's timeout, as far as nothing is known of its panel.
constexpr Duration kAtOnce = 20ms;

/// No reply and the silences around it fit into this.
constexpr Duration kNoReply = 3ms;

}  // namespace

/// Decides the candidate by the next piece. True if `piece` is consumed.
bool Matcher::resolve(Piece& piece) {
    Piece candidate = *std::exchange(candidate_, std::nullopt);
    const bool echo = is_repeated(candidate) && !is_read(pdu_of(candidate));
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
    const bool goes_on = known && !copies(piece.begin) && piece.kind != Piece::Kind::damaged &&
                         behind < waited - waited / 4;
    answer(std::move(candidate), !goes_on);
    return false;
}

/// The candidate has the form of a read of the same function. It was one if the same follows, or
/// what answers it. The very same read once more is never believed to be its own answer.
bool Matcher::resolve_read(Piece& candidate, Piece& piece) {
    const Habits& habits = of(asked_->pending.station);
    const Duration waited = candidate.begin - asked_->end;
    const Duration behind = piece.begin - candidate.end;
    const bool heard = piece.kind != Piece::Kind::damaged;
    const bool is_asked = is_repeated(candidate) || habits.has_asked(pdu_of(candidate));
    const bool same = heard && piece.bytes == candidate.bytes;
    const bool answers = heard && !same && piece.bytes.front() == candidate.bytes.front() &&
                         modbus::answers(pdu_of(candidate), pdu_of(piece)) &&
                         !habits.has_asked(pdu_of(piece));
    if (!same && !answers) {
        answer(std::move(candidate), !heard || is_asked || behind >= waited - waited / 4);
        return false;
    }
    if (is_repeated(candidate)) learn_of_copies(candidate);
    give_up(candidate.begin);
    ask(candidate, false);
    if (answers) {
        answer(std::move(piece), !is_asked);
    } else {
        on_request(std::move(piece));
    }
    return true;
}

/// Classifies an answer that may also be a request: at the station's usual time it is the answer,
/// unless its master is known to ask that; after the master's timeout it is the request; in between
/// it is open.
Matcher::Reading Matcher::read(const Piece& piece) const {
    const Habits& habits = habits_.at(asked_->pending.station);
    const Duration waited = piece.begin - asked_->end;
    if (waited >= patience(habits)) return Reading::request;
    if (habits.has_asked(pdu_of(piece))) return Reading::open;
    if (is_repeated(piece) && (is_read(pdu_of(piece)) || copies(piece.begin))) return Reading::open;
    return waited <= usual(habits) ? Reading::answer : Reading::open;
}

/// True if it is the open request, byte for byte.
bool Matcher::is_repeated(const Piece& piece) const {
    return asked_ && asked_->pending.station == piece.bytes.front() &&
           std::ranges::equal(asked_->pending.pdu, pdu_of(piece));
}

/// True if requests were heard twice on this line lately.
bool Matcher::copies(TimePoint now) const {
    return copied_ && now - *copied_ < settings_.surplus_memory;
}

/// True if what confirms a write is the same bytes, and comes sooner than its station has ever
/// answered: the request may have been heard twice.
bool Matcher::comes_too_soon(const Piece& piece) {
    if (!is_repeated(piece)) return false;
    return of(piece.bytes.front()).seems_too_soon(piece.begin - asked_->end);
}

/// The open read has come again before its station can have answered: its master does not ask so
/// soon, also where the answer was not heard. The line does.
void Matcher::learn_of_copies(const Piece& copy) {
    const Duration waited = copy.begin - asked_->end;
    const bool too_soon = waited < kNoReply || of(asked_->pending.station).is_too_soon(waited);
    if (!is_read(pdu_of(copy)) || !too_soon) return;
    copied_ = copy.end;
    for (auto& [id, habits] : habits_) habits.expect_copies();
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

}  // namespace panelgate::tap
