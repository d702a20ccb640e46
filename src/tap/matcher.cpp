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

using By = arbiter::Asked::By;

/// The echo of a request comes sooner, and no master repeats a request so soon (T6).
constexpr Duration kEcho = 20ms;

ByteView pdu_of(const Piece& piece) { return modbus::pdu_of(piece.bytes); }

Bytes copy_of(ByteView bytes) { return Bytes(bytes.begin(), bytes.end()); }

bool has_form_of_reply(ByteView frame) {
    if (frame[0] == modbus::kBroadcast) return false;  // a broadcast has no reply
    const modbus::ReplyLength length = modbus::reply_length(frame);
    return length.kind == modbus::ReplyLength::Kind::by_silence || length.length == frame.size();
}

/// True if the damaged bytes are the whole reply, perhaps without its last bytes (T3): a reply that
/// came does not come later.
bool is_damaged_reply(const PendingRequest& request, ByteView damaged) {
    constexpr std::size_t kLost = 2;
    const auto expected = modbus::reply_length_from_request(request.pdu);
    return expected && damaged.size() + kLost >= *expected && damaged[0] == request.station &&
           damaged[1] == request.pdu[0];
}

/// True if this exception says that the panel will carry out the request, or is busy with the
/// request: the reply may follow (T10).
bool announces_reply(ByteView reply) {
    const auto code = modbus::exception_of(reply);
    return code == static_cast<std::uint8_t>(modbus::ExceptionCode::acknowledge) ||
           code == static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
}

}  // namespace

Matcher::Matcher(const Settings& settings) : settings_(settings), cutter_(settings) {}

void Matcher::on_rx(TimePoint now, ByteView bytes) {
    cutter_.hear(now, bytes);
    cut(false);
}

void Matcher::on_deadline(TimePoint now) {
    if (!cutter_.empty() && now - cutter_.last() >= settings_.hole) cut(true);
    if (open_ && cutter_.empty() && now - open_->end >= settings_.patience) give_up(now);
}

void Matcher::on_line_down(TimePoint now) {
    cut(true);
    if (open_) {
        open_->doubtful = true;
        give_up(now);
    }
    ++epoch_;
    may_echo_until_ = TimePoint::max();
    damage_ = false;
}

std::optional<Event> Matcher::poll_action() {
    if (events_.empty()) return std::nullopt;
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
}

std::optional<TimePoint> Matcher::next_deadline() const {
    if (!cutter_.empty()) return cutter_.last() + settings_.hole;
    if (open_) return open_->end + settings_.patience;
    return std::nullopt;
}

void Matcher::cut(bool silence) {
    while (auto piece = cutter_.next(pending(), silence)) take(std::move(*piece));
}

void Matcher::take(Piece piece) {
    if (is_echo(piece)) return on_echo(piece);
    switch (piece.kind) {
        case Piece::Kind::answer:
            return on_answer(std::move(piece));
        case Piece::Kind::request:
            return on_request(std::move(piece));
        case Piece::Kind::reply:
            return on_reply(piece);
        case Piece::Kind::damaged:
            return on_damaged(piece);
    }
}

/// A frame that answers the open request is the answer. Only a frame that may also be a request is
/// the next request when the master has given up; and a read is never the reply to itself.
void Matcher::on_answer(Piece piece) {
    const bool given_up = piece.begin - open_->end >= settings_.usual_give_up;
    const bool read_again = equals_open(piece) && modbus::is_pure_read(pdu_of(piece));
    if (piece.ambiguous && (given_up || read_again)) return on_request(std::move(piece));
    answer(piece);
}

/// A master that waits does not ask: what may be a late reply, and comes soon, is a late reply.
void Matcher::on_request(Piece piece) {
    const bool late = may_be_late(piece) && !equals_open(piece);
    if (open_ && late && piece.begin - open_->end < settings_.usual_give_up) return on_reply(piece);
    const bool damage = open_ ? open_->damaged > 0 : damage_;
    const bool unsure = damage && has_form_of_reply(piece.bytes);
    if (open_) give_up(piece.begin);
    ask(piece, late || unsure);
    if (open_) open_->unsure = unsure;
}

/// The frame does not answer the open request: a duplicate, a late reply, or a frame of unknown
/// origin.
void Matcher::on_reply(const Piece& piece) {
    const std::uint8_t station = piece.bytes.front();
    // T12. Looked at first: a duplicate does not close a request that is still to be answered.
    if (outstanding_.is_last_reply(piece.end, station, pdu_of(piece), settings_.usual_give_up))
        return note(FrameKind::copy, station, piece);
    auto late = outstanding_.on_late(piece.end, station, pdu_of(piece), false);
    if (!late && open_ && open_->request.station == station) open_->wrong = true;
    note(late ? FrameKind::late : FrameKind::foreign, station, piece);
    if (late && announces_reply(pdu_of(piece))) expect_announced(station, *late, piece.end);
}

/// The open request goes on. That a write was heard twice says nothing of its reply.
void Matcher::on_echo(const Piece& piece) {
    const bool read = modbus::is_pure_read(pdu_of(piece));
    if (read) may_echo_until_ = piece.end + settings_.echo_memory;
    open_->echoed = true;
    open_->doubtful = open_->doubtful || !read;
    note(FrameKind::echo, piece.bytes.front(), piece);
}

void Matcher::on_damaged(const Piece& piece) {
    if (open_) {
        open_->damaged += piece.bytes.size();
        // On a line that returns requests (T6) the bytes may be the request.
        open_->came_damaged =
            piece.begin >= may_echo_until_ && is_damaged_reply(open_->request, piece.bytes);
    } else {
        damage_ = true;
    }
    note(FrameKind::damaged, open_ ? open_->request.station : piece.bytes.front(), piece);
}

void Matcher::ask(const Piece& piece, bool doubtful) {
    const std::uint8_t station = piece.bytes.front();
    const ByteView pdu = pdu_of(piece);
    note(FrameKind::heard_request, station, piece);
    damage_ = false;
    Open open;
    open.request = {station, copy_of(pdu)};
    open.begin = piece.begin;
    open.end = piece.end;
    open.doubtful = doubtful;
    if (station != modbus::kBroadcast && !modbus::is_never_answered(pdu)) {
        open_ = std::move(open);
        return;
    }
    Transaction made;
    made.station = station;
    made.request = std::move(open.request.pdu);
    made.end = End::unasked;
    made.doubtful = doubtful;
    made.asked = made.sampled = piece.begin;
    made.sent = made.ended = piece.end;
    if (station == modbus::kBroadcast && modbus::is_broadcastable(pdu.front())) {
        arbiter::Asked broadcast = asked(made);
        broadcast.by = By::broadcast;
        outstanding_.add_broadcast(broadcast);
    }
    events_.emplace_back(std::move(made));
}

void Matcher::answer(const Piece& piece) {
    const Open open = *std::exchange(open_, std::nullopt);
    const bool pure_read = modbus::is_pure_read(open.request.pdu);
    // T6: this read has come back from the panel alone.
    const bool shows_no_echo = pure_read && !open.echoed && open.damaged == 0;
    Transaction made;
    made.station = open.request.station;
    made.request = open.request.pdu;
    made.reply = copy_of(pdu_of(piece));
    made.end = End::answered;
    made.doubtful = is_doubtful(open, piece);
    made.asked = open.begin;
    made.sent = open.end;
    made.replied = piece.begin;
    made.ended = piece.end;
    made.sampled = outstanding_.sampled(piece.end, made.station, made.request, open.begin);
    made.damaged = open.damaged;
    if (shows_no_echo && may_echo_until_ == TimePoint::max()) may_echo_until_ = TimePoint{};
    damage_ = false;
    remember(made);
    note(FrameKind::reply, made.station, piece);
    events_.emplace_back(std::move(made));
}

/// True if the reply may be to another request, or no reply at all.
bool Matcher::is_doubtful(const Open& open, const Piece& piece) const {
    // T1: the master may have given up, and asked.
    if (piece.ambiguous && piece.begin - open.end > settings_.least_give_up) return true;
    // T6: the line may have returned the request.
    const bool equal = std::ranges::equal(open.request.pdu, pdu_of(piece));
    if (equal && (open.echoed || piece.begin < may_echo_until_)) return true;
    // T3: damaged bytes may have been a request.
    if (open.damaged >= modbus::kMinAdu || (equal && open.unsure)) return true;
    return may_answer_older(open, piece);
}

/// True if the reply may be to a broadcast (T11), or to an older request that is not equal to the
/// open request (T2).
bool Matcher::may_answer_older(const Open& open, const Piece& piece) const {
    const std::uint8_t station = open.request.station;
    const ByteView reply = pdu_of(piece);
    const bool exception = modbus::exception_of(reply).has_value();
    if (!exception && outstanding_.answered_by(piece.end, station, reply, By::broadcast))
        return true;
    const arbiter::Asked* const oldest = outstanding_.answered_by(piece.end, station, reply);
    if (oldest == nullptr) return false;
    // Where a write equals its reply, the open request may be the reply to the older request.
    if (oldest->pdu != open.request.pdu || std::ranges::equal(oldest->pdu, reply)) return true;
    const auto request = modbus::Request::make(oldest->pdu, modbus::QuantityCheck::wide);
    return !request || outstanding_.clear_at(piece.end, station, *request, true) > piece.end;
}

/// A panel answers in order: a reply that no other request can have had closes all earlier requests
/// (T2). After a reply in doubt the open request takes the place of the oldest request, and of its
/// window, because one reply of the two may still come.
void Matcher::remember(const Transaction& made) {
    arbiter::Asked request = asked(made);
    const bool announced = announces_reply(made.reply);
    const auto* const oldest = outstanding_.answered_by(made.ended, made.station, made.reply);
    if (oldest != nullptr) request.until = oldest->until;
    if (!made.doubtful) {
        outstanding_.on_reply(made.ended, made.station, request, made.reply);
    } else {
        const auto late = outstanding_.on_late(made.ended, made.station, made.reply, false);
        if (!late) outstanding_.set_last_reply(made.ended, made.station, made.reply);
        if (late && announced) expect_announced(made.station, *late, made.ended);
        outstanding_.add(made.station, request);
    }
    if (!announced) return;
    request.sent = made.sampled;  // of equal requests the first may be announced
    expect_announced(made.station, std::move(request), made.ended);
}

/// T10: the reply comes behind the exception that ended at `now`.
void Matcher::expect_announced(std::uint8_t station, arbiter::Asked request, TimePoint now) {
    request.until = now + settings_.late_window;
    outstanding_.add(station, std::move(request));
}

/// The open request has had no reply.
void Matcher::give_up(TimePoint now) {
    const Open open = *std::exchange(open_, std::nullopt);
    Transaction made;
    made.station = open.request.station;
    made.request = open.request.pdu;
    made.end = open.damaged > 0 ? End::damaged : open.wrong ? End::wrong : End::silent;
    made.damaged = open.damaged;
    made.doubtful = open.doubtful;
    made.asked = made.sampled = open.begin;
    made.sent = open.end;
    made.ended = std::max(now, open.end);
    if (!open.came_damaged) outstanding_.add(made.station, asked(made));
    events_.emplace_back(std::move(made));
}

/// True if this frame with the form of a request may be a late reply (T2) or a duplicate (T12).
bool Matcher::may_be_late(const Piece& piece) const {
    const std::uint8_t station = piece.bytes.front();
    const ByteView pdu = pdu_of(piece);
    return has_form_of_reply(piece.bytes) &&
           (outstanding_.is_last_reply(piece.end, station, pdu, settings_.late_window) ||
            outstanding_.answered_by(piece.end, station, pdu) != nullptr);
}

/// True if this good frame is the open request once more, byte for byte.
bool Matcher::equals_open(const Piece& piece) const {
    return open_ && open_->request.station == piece.bytes.front() &&
           std::ranges::equal(open_->request.pdu, pdu_of(piece));
}

/// T6. A write that comes back is its reply, except on a line that has returned a read.
bool Matcher::is_echo(const Piece& piece) const {
    if (piece.kind == Piece::Kind::damaged || !equals_open(piece)) return false;
    // Behind a damaged reply (T3) the master may ask the same at once.
    if (open_->echoed || open_->damaged > 0 || piece.begin - open_->end >= kEcho) return false;
    const bool known = may_echo_until_ != TimePoint::max() && piece.begin < may_echo_until_;
    return known || modbus::is_pure_read(open_->request.pdu);
}

/// The request as the memory of the past keeps requests: by its first bit.
arbiter::Asked Matcher::asked(const Transaction& made) const {
    return {By::us, made.asked, made.asked + settings_.late_window, epoch_, made.request};
}

void Matcher::note(FrameKind kind, std::uint8_t station, const Piece& piece) {
    events_.emplace_back(Frame{piece.end, kind, station, piece.bytes});
}

}  // namespace panelgate::tap
