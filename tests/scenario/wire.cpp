#include "wire.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "speech.hpp"

namespace panelgate::scenario {

Duration Wire::time_of(std::size_t characters, double rate) const {
    const Duration exact = wire_time(plan_.settings.serial, characters);
    if (rate == 1) return exact;
    return Duration(static_cast<Duration::rep>(static_cast<double>(exact.count()) * rate));
}

TimePoint Wire::Frame::end_of(std::size_t byte, const Wire& wire) const {
    return start + wire.time_of(byte + 1, rate) + (byte >= hole_before ? hole : Duration{});
}

Wire::FramePtr Wire::put(Said said) {
    auto frame = std::make_shared<Frame>(Frame{std::move(said), {}, {}, {}});
    const TimePoint now = agenda_.now();
    frame->start = now;
    frame->end = frame->end_of(frame->bytes.size() - 1, *this);
    spoken_until_ = std::max(spoken_until_, frame->end);
    std::erase_if(air_, [&](const FramePtr& other) { return other->end <= now; });
    for (const FramePtr& other : air_) {
        if (!other->garbled_from) other->garbled_from = now;
        frame->garbled_from = now;
        witness_.on_collision(now, other->station);
        witness_.on_collision(now, frame->station);
    }
    if (now < whispered_until_) witness_.on_collision(now, frame->station);
    air_.push_back(frame);
    return frame;
}

TimePoint Wire::say(Said said) {
    begin_();
    const FramePtr frame = put(std::move(said));
    if (frame->damaged) {
        witness_.on_garbled(agenda_.now());
    } else {
        witness_.on_said(frame->start, understood(plan_.settings.serial, frame->bytes));
    }
    deliver_in_chunks(frame);
    return frame->end;
}

void Wire::whisper(Bytes bytes) {
    if (agenda_.now() < spoken_until_) return;
    auto frame = std::make_shared<Frame>();
    frame->bytes = std::move(bytes);
    frame->start = agenda_.now();
    frame->connection = connection_;
    whispered_until_ = frame->end_of(frame->bytes.size() - 1, *this);
    deliver_in_chunks(frame);
}

void Wire::send(Bytes adu) {
    Held held{.bytes = std::move(adu), .connection = connection_};
    if (agenda_.now() < stalled_until_) {
        held_out_.push_back(std::move(held));
    } else if (agenda_.now() < says_held_until_) {
        leave_in_turn(std::move(held));
    } else {
        leave(std::move(held.bytes), held.connection);
    }
}

/// A device server has one buffer and one UART: nothing that it is given overtakes what it still
/// holds.
void Wire::leave_in_turn(Held held) {
    const TimePoint at = std::max(agenda_.now(), says_held_until_);
    says_held_until_ = at + time_of(held.bytes.size(), plan_.line.own_rate) +
                       silent_interval(plan_.settings.serial) + random_.between(0us, 2ms);
    agenda_.at(at, [this, held = std::move(held)] { leave(held.bytes, held.connection); });
}

void Wire::leave(Bytes adu, std::uint64_t connection) {
    Said said;
    said.station = understood(plan_.settings.serial, adu)[0];
    said.bytes = std::move(adu);
    said.rate = plan_.line.own_rate;
    said.connection = connection;
    const FramePtr frame = put(std::move(said));
    echo(frame);
    hand_over(*frame);
    agenda_.at(frame->end, [this, frame] {
        asked_since_ = frame->start;
        if (!frame->garbled_from) ask_(frame->bytes, frame->connection);
    });
}

/// An adapter that still holds a frame hands it over behind the begin of a request (LinePlan).
void Wire::hand_over(const Frame& request) {
    const Duration each = plan_.line.hands_over;
    if (each == Duration{} || request.station != plan_.odd || last_reply_.empty()) return;
    const bool answers =
        modbus::answers(modbus::pdu_of(request.bytes), modbus::pdu_of(last_reply_));
    if (!answers || agenda_.now() < handed_over_ + each) return;
    handed_over_ = agenda_.now();
    agenda_.at(request.start + (request.end - request.start) / 2, [this, held = last_reply_] {
        agenda_.tell("next is what the adapter has held");
        arrive({.bytes = held, .answer_of = plan_.odd, .connection = connection_, .reply = held});
    });
}

/// What the gateway hears of its own frame: nothing, all, or what a receiver that is switched late
/// lets through.
void Wire::echo(const FramePtr& frame) {
    const LinePlan& line = plan_.line;
    if (line.echo || (line.echo_writes && frame->bytes[1] > 4)) {
        const bool damaged = random_.chance(line.damaged_echo);
        const bool cut = random_.chance(line.cut_echo);
        if (!damaged && !cut) {
            deliver_in_chunks(frame);
            const std::size_t size = frame->bytes.size();
            if (line.echo_twice)
                agenda_.at(frame->end, [this, frame, size] { deliver(frame, 0, size); });
            return;
        }
        const auto heard = std::make_shared<Frame>(*frame);
        const auto size = static_cast<unsigned>(heard->bytes.size());
        if (damaged) heard->bytes[random_.below(size)] ^= 0x10;
        if (cut) heard->bytes.pop_back();
        witness_.on_collision(agenda_.now(), frame->station);
        return deliver_in_chunks(heard);
    }
    if (!random_.chance(line.partial_echo)) return;
    const auto part = std::make_shared<Frame>(*frame);
    part->bytes.resize(random_.between(1, 7));
    part->garbled_from.reset();
    // As they are sent, or all of them from a buffer when the driver is switched off.
    if (random_.chance(0.3)) return deliver_in_chunks(part);
    const Duration later = random_.between(0us, 1ms);
    buffered_ = part;
    agenda_.at(frame->end + later, [this] { empty_buffer(); });
}

/// Bytes reach the gateway in the pieces of a receive FIFO, each when its last byte is there; what
/// an adapter holds back for longer than 15 ms looks like the end of the frame to anybody. A pause
/// empties the FIFO.
void Wire::deliver_in_chunks(const FramePtr& frame) {
    const auto fits = static_cast<unsigned>(15ms / character_time(plan_.settings.serial));
    const unsigned most = std::max(fits, 1u);
    const std::size_t size = frame->bytes.size();
    std::size_t from = 0;
    while (from < size) {
        std::size_t to =
            from + random_.between(1, std::min(static_cast<unsigned>(size - from), most));
        if (frame->hole > Duration::zero() && from < frame->hole_before)
            to = std::min(to, frame->hole_before);
        agenda_.at(frame->end_of(to - 1, *this),
                   [this, frame, from, to] { deliver(frame, from, to); });
        from = to;
    }
}

/// A buffer gives back what it holds in order.
void Wire::empty_buffer() {
    if (const FramePtr part = std::exchange(buffered_, nullptr))
        deliver(part, 0, part->bytes.size());
}

void Wire::deliver(const FramePtr& frame, std::size_t from, std::size_t to) {
    empty_buffer();
    if (frame->garbled_from) garble(*frame, from, to);
    const std::size_t end = frame->answer_to;
    const bool answered = end > from && end <= to && !frame->garbled_from;
    const ByteView part = ByteView(frame->bytes).subspan(from, to - from);
    const auto said = [](const Frame& whole) {
        return ByteView(whole.bytes)
            .subspan(whole.answer_from, whole.answer_to - whole.answer_from);
    };
    const bool ends = to == frame->bytes.size() && !frame->garbled_from;
    arrive({{part.begin(), part.end()},
            answered ? frame->station : std::uint8_t{0},
            frame->connection,
            ends && frame->copy ? understood(plan_.settings.serial, frame->bytes) : Bytes{},
            answered ? understood(plan_.settings.serial, said(*frame)) : Bytes{}});
}

/// Something else than what was said; never a good frame by chance: that is the CRC's affair.
void Wire::garble(Frame& frame, std::size_t from, std::size_t to) {
    witness_.on_garbled(agenda_.now());
    for (std::size_t i = from; i < to; ++i) {
        if (frame.end_of(i, *this) > *frame.garbled_from)
            frame.bytes[i] = static_cast<std::uint8_t>(random_.next());
    }
    const bool answer = frame.answer_to > 0;
    const std::size_t begin = answer ? frame.answer_from : 0;
    const std::size_t end = answer ? frame.answer_to : frame.bytes.size();
    const bool last = end > from && end <= to && end - begin > 3;
    const Bytes said = understood(plan_.settings.serial,
                                  ByteView(frame.bytes).subspan(begin, last ? end - begin : 0));
    for (const auto& [word, order] : modbus::kCrcOrders) {
        if (modbus::crc_ok(said, order)) frame.bytes[end - 1] ^= 1;
    }
}

void Wire::arrive(Held held) {
    if (plan_.line.hangs) held.connection = connection_;
    if (!up_ || held.connection != connection_) return;
    if (agenda_.now() < stalled_until_) {
        held_in_.push_back(std::move(held));
        return;
    }
    if (!held.copy.empty()) agenda_.tell("next ends the copy of what was said before");
    if (!held.copy.empty()) witness_.on_copy(agenda_.now(), held.copy);
    if (!held.reply.empty()) witness_.on_reply(agenda_.now(), held.reply);
    if (!held.reply.empty() && held.answer_of == plan_.odd) last_reply_ = held.reply;
    hear_(held.bytes, held.answer_of);
}

void Wire::stall(TimePoint until) {
    stalled_until_ = until;
    agenda_.at(until, [this] { release(); });
}

/// What was sent on a connection that is gone is lost, or executed with its reply unheard.
void Wire::release() {
    for (Held& held : std::exchange(held_in_, {})) arrive(std::move(held));
    for (Held& held : std::exchange(held_out_, {})) {
        if (held.connection != connection_ && random_.chance(0.5)) continue;
        leave_in_turn(std::move(held));
    }
}

bool Wire::is_quiet_for(Duration silence) const { return agenda_.now() >= spoken_until_ + silence; }

}  // namespace panelgate::scenario
