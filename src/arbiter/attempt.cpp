#include "panelgate/arbiter/attempt.hpp"

#include <iterator>

#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

using modbus::Unused;

namespace {

constexpr std::size_t kHeader = 3;  // bytes of a read's reply: address, function, byte count
constexpr int kRatesDiffer = 2;     // percent, between two devices on one line

}  // namespace

Attempt::Timing Attempt::timing_of(const Settings& line, TimePoint now, std::size_t size,
                                   Duration lead) {
    Timing timing;
    timing.leaving = frame_time(line.serial, size);
    timing.started = now;
    timing.sent = now + lead + timing.leaving;
    timing.end_of_frame = line.end_of_frame;
    timing.hole = line.reply_hole;
    timing.longest_reply = 2 * frame_time(line.serial, modbus::kMaxLongRtuAdu) + line.reply_hole;
    timing.serial = line.serial;
    timing.paced = line.paced;
    // ASCII pauses can be longer than frames, and a character carries less than its time.
    timing.steady = !line.may_stall && line.serial.mode == SerialMode::rtu;
    return timing;
}

Attempt::Attempt(Group group, const Timing& timing, EchoFilter echo,
                 const modbus::CrcOrders& orders)
    : group_(std::move(group)),
      timing_(timing),
      orders_(orders),
      echo_(std::move(echo)),
      framer_(
          group_.station, group_.request.pdu(), orders_,
          has_delimiters() ? modbus::ReplyFramer::Ends::told : modbus::ReplyFramer::Ends::by_length,
          group_.request.byte_count()),
      pace_(byte_time(timing.serial), timing.steady),
      computed_end_(timing.sent),
      first_byte_(timing.sent),
      last_byte_(timing.sent),
      end_confirmed_(!timing.confirm_end) {}

/// The request may have left sooner than computed, by the clocks of the line's other devices.
bool Attempt::can_join(TimePoint now, const Job& job) const {
    const TimePoint earliest_end =
        timing_.sent - (timing_.sent - timing_.started) * kRatesDiffer / 100;
    const auto& items = job.request.span();
    return timing_.paced && now < earliest_end && !group_.probe && group_.attempts == 1 &&
           job.station == group_.station && group_.span && items && !job.alone &&
           group_.span->contains(*items) && group_.jobs.size() < JobQueue::kMost;
}

void Attempt::on_rx(TimePoint now, ByteView bytes) {
    pace_.on_read(now, bytes.size());
    const bool was_complete = echo_.complete();
    const ByteView rest = echo_.feed(bytes);
    if (echo_.complete() && !was_complete) {
        pace_.restart(now, rest.size());
        // The echo may lack its last byte, and the reply have given its first one (T6).
        if (echo_.frame().back() == group_.station) feed(echo_.frame().last(1));
    }
    if (rest.size() < bytes.size()) last_byte_ = std::max(last_byte_, now);
    if (rest.empty()) return;
    if (has_heard_) {
        const TimePoint began = now - wire_time(timing_.serial, rest.size());
        longest_pause_ = std::max(longest_pause_, began - last_byte_);
    } else {
        first_byte_ = now;
    }
    has_heard_ = true;
    last_byte_ = now;
    feed(rest);
}

void Attempt::feed(ByteView bytes) {
    collect(framer_.feed(bytes));
    if (!framer_.ends_with_other_frame()) return;
    framer_.drop_pending();
    collect(std::nullopt);
}

void Attempt::on_frame_end(bool good) {
    if (const Bytes buffered = echo_.release(); !buffered.empty()) {
        has_heard_ = true;
        feed(buffered);
    }
    collect(framer_.on_end(good));
}

void Attempt::on_frame_cut() {
    if (const Bytes buffered = echo_.release(); !buffered.empty()) feed(buffered);
    framer_.on_cut();
    collect(std::nullopt);
}

void Attempt::on_silence(TimePoint now) {
    if (!is_hearing() || now < deadline()) return;
    if (const Bytes buffered = echo_.release(); !buffered.empty()) {
        has_heard_ = true;
        feed(buffered);
    }
    collect(framer_.on_silence());
}

/// Takes what the framer has found, in order. Bytes behind the reply count for nothing (FRM-07).
void Attempt::collect(std::optional<Bytes> reply) {
    const std::size_t behind = framer_.parts_behind();
    std::vector<Unused> parts = framer_.take_unused();
    const std::size_t front = reply ? parts.size() - std::min(behind, parts.size()) : parts.size();
    for (std::size_t i = 0; i < front; ++i) add(std::move(parts[i]), false, true);
    if (!reply) return;
    const Bytes adu = modbus::encode_adu(group_.station, *reply, orders_.of(group_.station));
    add(modbus::classify_frame(adu, group_.station, true), true, false);
    for (std::size_t i = front; i < parts.size(); ++i) add(std::move(parts[i]), false, false);
}

void Attempt::add(Unused part, bool answers, bool in_front) {
    const bool own = part.kind == Unused::Kind::own;
    answers = answers || (own && modbus::answers(group_.request.pdu(), modbus::pdu_of(part.bytes),
                                                 group_.request.byte_count()));
    if (!answers && in_front) disturbed_ = disturbed_ || part.kind != Unused::Kind::damaged;
    if (part.kind == Unused::Kind::damaged) {
        const bool foreign = begins_with_request(part.bytes, echo_.frame(), orders_);
        if (!foreign) append_up_to(modbus::ReplyFramer::kMaxHeard, damaged_bytes_, part.bytes);
        disturbed_ = disturbed_ || foreign;
        fragment_ = fragment_ || (in_front && holds_beginning(part.bytes, echo_.frame()));
    }
    heard_.push_back({std::move(part), answers});
}

std::optional<TimePoint> Attempt::busy_until() const {
    const std::size_t echo = echo_.missing();
    return pace_.busy_until(echo > 0 ? echo : framer_.missing());
}

TimePoint Attempt::deadline() const {
    if (is_broadcast()) return timing_.sent;
    const TimePoint over = give_up();
    if (instead_ == Instead::reply) return timing_.sent;
    if (!is_hearing()) return over;
    // What has no known length goes on as long as it is no frame; so do the bytes that the echo
    // filter buffers, which begin like the reply.
    const bool may_be_reply = framer_.has_candidate() || echo_.pending();
    const bool has_hole = echo_.pending() ||
                          (framer_.has_candidate() &&
                           (framer_.knows_length() || !modbus::crc_ok(framer_.pending(), orders_)));
    Duration silence = has_hole ? timing_.hole : timing_.end_of_frame;
    if (framer_.is_inside()) silence = silent_interval(timing_.serial);
    const TimePoint silent = std::max(timing_.sent, last_byte_) + silence;
    // A possible reply is heard to its end, also after the timeout, but not without limit.
    return std::min(silent, may_be_reply ? over + timing_.longest_reply : over);
}

Verdict Attempt::verdict(TimePoint now) const {
    if (instead_ == Instead::reply) return Verdict::wrong;
    if (is_hearing() && now < deadline()) return Verdict::open;
    const bool own = is_own_beginning();
    if ((framer_.was_damaged_whole() && !own) || lost_beginning()) return Verdict::damaged;
    if (now < give_up()) return Verdict::open;
    if (instead_ == Instead::unrelated) return Verdict::wrong;
    const bool damaged =
        (framer_.was_damaged() && !own) || echo_.mismatch() || instead_ == Instead::contested;
    return damaged ? Verdict::damaged : Verdict::silent;
}

/// An adapter that switches late lets a part of our request through (T6): no damage where no reply
/// can begin so. The reply to a write can.
bool Attempt::is_own_beginning() const {
    const ByteView own = echo_.frame();
    const auto length = group_.request.reply_length();
    if (damaged_bytes_.size() < kHeader || damaged_bytes_.size() > own.size()) return false;
    return group_.request.is_read() && length && own[2] != *length - kHeader - modbus::kCrcSize &&
           std::ranges::equal(damaged_bytes_, own.first(damaged_bytes_.size()));
}

void Attempt::on_end(TimePoint now, Duration left) {
    if (!wants_end(now)) return;
    const TimePoint end = now + left;
    if (left <= Duration::zero() || has_heard_ || end > computed_end_ + timing::kLatestEnd) {
        end_confirmed_ = true;
        return;
    }
    timing_.sent = end;
}

Bytes Attempt::release_pending() {
    Bytes pending = echo_.release();
    const Bytes begun = framer_.take_pending();
    pending.insert(pending.end(), begun.begin(), begun.end());
    return pending;
}

}  // namespace panelgate::arbiter
