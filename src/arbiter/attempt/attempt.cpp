#include "panelgate/arbiter/attempt/attempt.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <utility>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

using modbus::Unused;

namespace {
constexpr std::size_t kHeader = 3;  // bytes of a read's reply: address, function, byte count
}

Attempt::Timing Attempt::timing_of(const Wire& line, TimePoint now, std::size_t size,
                                   Duration lead) {
    Timing timing;
    timing.leaving = frame_time(line.serial, size);
    const Duration leaving = lead + timing.leaving;
    timing.started = now;
    timing.sent = now + leaving;
    timing.end_of_frame = line.end_of_frame;
    timing.hole = line.reply_hole;
    timing.longest_reply = 2 * frame_time(line.serial, modbus::kMaxLongRtuAdu) + line.reply_hole;
    timing.serial = line.serial;
    // ASCII pauses can be longer than frames, and a character carries less than its time.
    timing.steady = !line.may_stall && line.serial.mode == SerialMode::rtu;
    // Rates may differ by 2 %, at both ends in the same direction.
    if (line.paced) timing.tolerance = leaving * 3 / 100 + character_time(line.serial);
    return timing;
}

Attempt::Attempt(Group group, const Timing& timing, EchoFilter echo,
                 const modbus::CrcOrders& orders)
    : group_(std::move(group)),
      timing_(timing),
      orders_(orders),
      echo_(std::move(echo)),
      own_(echo_.expected()),
      framer_(group_.station, group_.request.pdu(), orders_,
              has_delimiters() ? modbus::ReplyFramer::Ends::told
                               : modbus::ReplyFramer::Ends::by_length),
      pace_({byte_time(timing.serial), timing.steady, timing.wake_latency, timing.drift}),
      computed_end_(timing.sent),
      first_byte_(timing.sent),
      last_byte_(timing.sent),
      end_confirmed_(!timing.confirm_end) {}

bool Attempt::can_join(TimePoint now, const Job& job) const {
    const bool leaving = timing_.tolerance && now < earliest_end();
    const auto& items = job.request.span();
    return leaving && !group_.probe && group_.attempts == 1 && job.station == group_.station &&
           group_.span && items && !job.alone && group_.span->contains(*items) &&
           group_.jobs.size() < JobQueue::kMost;
}

Verdict Attempt::on_rx(TimePoint now, ByteView bytes, const Ends& ends) {
    const auto planned = next_look();
    pace_.on_read(now, bytes.size());
    const Verdict verdict = hear(now, bytes, ends);
    pace_.on_judged(now, planned, verdict == Verdict::replied);
    pace_.drop_if_late(now, busy_until());
    return verdict;
}

std::optional<InputPace::Look> Attempt::next_look() const {
    if (!pace_.is_kept()) return std::nullopt;
    const std::size_t rest = missing();
    return pace_.look(rest, pace_.bytes() + rest > modbus::kMinAdu && rest != echo_.missing());
}

std::optional<TimePoint> Attempt::busy_until() const {
    const auto next = next_look();
    return next ? std::optional(pace_.busy_until(*next)) : std::nullopt;
}

std::size_t Attempt::missing() const {
    const std::size_t echo = echo_.missing();
    if (!timing_.as_asked) return echo > 0 ? echo : framer_.missing();
    if (!echo_.pending()) return echo > 0 ? echo : framer_.missing_as_asked();
    return std::max(group_.request.reply_length().value_or(0), echo_.pending_size() + echo) -
           echo_.pending_size();
}

Verdict Attempt::hear(TimePoint now, ByteView bytes, const Ends& ends) {
    const bool was_complete = echo_.complete();
    const TimePoint before = std::exchange(buffered_at_, now);
    const std::size_t last = std::exchange(buffered_last_, bytes.size());
    ByteView rest = echo_.feed(bytes);
    if (echo_.complete() && !was_complete) {
        pace_.restart(now, rest.size());
    }
    if (echo_.pending() || rest.size() < bytes.size()) last_byte_ = std::max(last_byte_, now);
    const bool may_lend = !has_delimiters() && echo_.complete() && !was_complete;
    if (may_lend && echo_.frame().back() == group_.station) {
        lender_.emplace(group_.station, group_.request.pdu(), orders_);
        const std::uint8_t lent = group_.station;
        lender_->feed(ByteView(&lent, 1));
    }
    if (rest.empty()) {
        if (echo_.pending() && !echo_since_) echo_since_ = now;
        return Verdict::open;
    }
    append_up_to(modbus::kReadRequestAdu, first_heard_, rest);
    heard_size_ += rest.size();
    if (now < timing_.sent && !comes_back(rest)) early_ = now;
    rest = drop_stale(now, before, rest, std::min(rest.size(), bytes.size()), last);
    if (rest.empty()) return Verdict::open;
    drop_what_ended(now, rest.size());
    const bool anew = std::exchange(begins_anew_, false);
    if (!heard_ || anew) first_byte_ = now;
    // The bytes buffered as an echo were the beginning, where only we delay the rest.
    if (!heard_ && timing_.steady && echo_since_ && !echo_.complete())
        first_byte_ = std::min(now, std::max(*echo_since_, timing_.sent));
    if (heard_)
        longest_pause_ =
            std::max(longest_pause_, now - wire_time(timing_.serial, rest.size()) - last_byte_);
    heard_ = true;
    last_byte_ = now;
    arrivals_.add(now, rest.size());
    return feed(rest, ends);
}

/// Returns the bytes that may be of a reply. All but the last `fresh` the echo filter gives back:
/// they came `before`, `last` of them at once, and are the beginning of our own frame.
ByteView Attempt::drop_stale(TimePoint now, TimePoint before, ByteView bytes, std::size_t fresh,
                             std::size_t last) {
    const std::size_t given_back = bytes.size() - fresh;
    std::size_t stale = given_back > 0 && is_stale(before, given_back) ? given_back : 0;
    if (stale > last && !is_stale(before, last)) stale -= last;  // the reply's beginning
    if (fresh > 0 && is_stale(now, fresh)) {
        disturbed_ = true;
        // The reply may have begun behind what continues our own frame.
        const auto own = std::ranges::mismatch(bytes, echo_.frame()).in1 - bytes.begin();
        const std::size_t behind =
            given_back > 0 ? bytes.size() - static_cast<std::size_t>(own) : 0;
        stale = bytes.size() - (behind > 0 && !is_stale(now, behind) ? behind : 0);
    }
    stale_.insert(stale_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(stale));
    return bytes.subspan(stale);
}

/// True if all that has come while the request is leaving is its beginning, these bytes, too.
bool Attempt::comes_back(ByteView bytes) {
    const ByteView behind = echo_.frame().subspan(came_back_);
    if (behind.size() < bytes.size() || !std::ranges::equal(bytes, behind.first(bytes.size())))
        return false;
    came_back_ += bytes.size();
    return true;
}

/// Drops bytes that are no part of the reply once the silence after them was longer than any inside
/// a frame.
void Attempt::drop_what_ended(TimePoint now, std::size_t size) {
    if (has_delimiters()) return;
    const TimePoint first = now - wire_time(timing_.serial, size);
    const bool over = first >= last_byte_ + 3 * character_time(timing_.serial) / 2;
    if (!heard_ || !over || !framer_.has_pending() || framer_.has_candidate()) return;
    framer_.drop_pending();
    collect();
}

Verdict Attempt::feed(ByteView bytes, const Ends& ends) {
    if (accept(framer_.feed(bytes)) == Verdict::replied) return Verdict::replied;
    if (lender_) {
        if (auto reply = lender_->feed(bytes)) {
            own_.borrowed = true;
            return accept(std::move(reply));
        }
    }
    if (is_hold_over()) return believe();
    return framer_.ends_with_other_frame() ? judge_pending(ends) : Verdict::open;
}

/// True if the candidate was held only for what had begun behind it, and that is no other answer.
bool Attempt::is_hold_over() const {
    if (!answers_.holds() || framer_.has_candidate()) return false;
    Unused begun;
    begun.bytes.assign(framer_.pending().begin(), framer_.pending().end());
    return last_byte_ >= timing_.sent + timing_.usual && !differs(begun, answers_.candidate());
}

Verdict Attempt::believe() {
    answers_.believe();
    first_byte_ = answers_.in_time()->began;
    return Verdict::replied;
}

Verdict Attempt::accept(std::optional<Bytes> reply) {
    reply_came_ = last_byte_;
    const bool fed = reply && !own_.borrowed;
    const std::size_t behind = collect(fed ? reply->size() + modbus::kAduOverhead : 0);
    if (!reply) return Verdict::open;
    if (own_.may_be_echo(echo_, *reply)) return Verdict::open;
    Answers::Others others = take_others(*reply, behind);
    if (const auto surplus = answers_.add(std::move(*reply), std::move(others), group_))
        add_unsolicited(*surplus);
    if (const auto& before = answers_.in_time()) first_byte_ = before->began;
    return Verdict::replied;
}

bool Attempt::differs(const Unused& part, const Bytes& reply) const {
    if (part.kind == Unused::Kind::damaged) {
        const Bytes whole = adu_of(reply);
        const std::size_t same =
            static_cast<std::size_t>(std::ranges::mismatch(whole, part.bytes).in1 - whole.begin());
        return same >= kHeader && same < std::min(part.bytes.size(), whole.size());
    }
    if (part.kind != Unused::Kind::own) return false;
    const ByteView pdu = modbus::pdu_of(part.bytes);
    return group_.is_values(pdu) && !std::ranges::equal(pdu, reply) &&
           modbus::answers(group_.request.pdu(), pdu);
}

Answers::Others Attempt::take_others(const Bytes& reply, std::size_t behind) {
    Answers::Others others;
    if (!group_.is_values(reply)) return others;
    const auto first = unsolicited_.end() - static_cast<std::ptrdiff_t>(behind);
    others.any = std::any_of(first, unsolicited_.end(),
                             [&](const Unused& part) { return differs(part, reply); });
    const auto whole = [&](const Unused& part) {
        return part.kind == Unused::Kind::own && differs(part, reply);
    };
    const auto found = std::partition(first, unsolicited_.end(), std::not_fn(whole));
    for (auto part = found; part != unsolicited_.end(); ++part) {
        const ByteView pdu = modbus::pdu_of(part->bytes);
        others.whole.emplace_back(pdu.begin(), pdu.end());
    }
    unsolicited_.erase(found, unsolicited_.end());
    return others;
}

std::vector<Unused> Attempt::take_set_aside() {
    std::vector<Unused> frames;
    for (const Bytes& pdu : answers_.take_set_aside()) frames.push_back(own_frame(pdu));
    return frames;
}

Bytes Attempt::release_pending() {
    Bytes pending = echo_.release();
    const Bytes begun = own_.borrowed ? Bytes{} : framer_.take_pending();
    pending.insert(pending.end(), begun.begin(), begun.end());
    return pending;
}

/// Turns pending bytes into unsolicited parts. Did the station send them instead of the reply?
Verdict Attempt::judge_pending(const Ends& ends) {
    const std::size_t before = unsolicited_.size();
    framer_.drop_pending();
    collect();
    judge_unsolicited(before, ends);
    return instead_ == Instead::reply ? Verdict::wrong : Verdict::open;
}

void Attempt::judge_unsolicited(std::size_t from, const Ends& ends) {
    for (; from < unsolicited_.size(); ++from) {
        const Unused& part = unsolicited_[from];
        if (part.kind != Unused::Kind::own) continue;
        const bool exception = (part.bytes[1] & modbus::kExceptionBit) != 0;
        const std::uint8_t function = modbus::plain_function(part.bytes[1]);
        const bool refuses_other = exception && function != group_.request.function();
        if (!ends(part.bytes)) {
            // It may be the exception to this request, with another function's number.
            disturbed_ = disturbed_ || refuses_other;
            continue;
        }
        const bool other = !exception && function != group_.request.function();
        refused_other_ = refused_other_ || refuses_other;
        disturbed_ = disturbed_ || other;
        instead_ = std::max(instead_, other ? Instead::unrelated : Instead::reply);
    }
}

/// Notes when these parts came, and the reply between them.
void Attempt::date(std::vector<Unused>& parts, std::size_t behind, std::size_t reply) {
    std::size_t rest = framer_.pending().size();
    for (std::size_t i = parts.size() + 1; i-- > 0;) {
        if (reply > 0 && i + behind == parts.size()) {
            reply_came_ = std::max(timing_.sent, arrivals_.before(rest));
            rest += reply;
        }
        if (i == 0) break;
        parts[i - 1].came = std::max(timing_.sent, arrivals_.before(rest));
        rest += parts[i - 1].bytes.size();
    }
}

std::size_t Attempt::collect(std::size_t reply) {
    const std::size_t behind = framer_.parts_behind();
    std::vector<Unused> parts = framer_.take_unused();
    date(parts, behind, reply);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const bool foreign = begins_with_request(parts[i].bytes, echo_.frame(), orders_);
        const bool in_front = i + behind < parts.size();
        if (std::ranges::equal(parts[i].bytes, echo_.frame())) on_own_frame(in_front);
        const bool damaged = parts[i].kind == Unused::Kind::damaged;
        if (in_front && (!damaged || foreign)) on_frame_in_front();
        if (damaged && answers_.holds() && differs(parts[i], answers_.candidate()))
            answers_.on_other_begun();
        if (damaged && !foreign) {
            if (in_front) noise_in_front_ += parts[i].bytes.size();
            own_.fragment =
                own_.fragment || (in_front && holds_fragment(parts[i].bytes, echo_.frame()));
            append_up_to(modbus::ReplyFramer::kMaxHeard, damaged_bytes_, parts[i].bytes);
            disturbed_ = disturbed_ || !is_only_own_beginning();
        }
        unsolicited_.push_back(std::move(parts[i]));
    }
    return std::min(behind, parts.size());
}

/// The reply begins behind it: if both came at once, when is unknown.
void Attempt::on_frame_in_front() {
    frames_in_front_ = begins_anew_ = true;
    first_byte_ = std::max(first_byte_, std::min(last_byte_, timing_.sent));
}

/// Our own request came, which the filter did not take out: a candidate came before it.
void Attempt::on_own_frame(bool in_front) {
    own_.came_back = true;
    const bool is_behind = !in_front || (answers_.has_candidate() && !timing_.echoes);
    own_.again = own_.again || echo_.complete() || is_behind;
    begins_anew_ = true;  // the reply, behind it
    if (!timing_.echoes) return;
    own_.behind = true;
    if (const auto candidate = answers_.drop_candidate()) {
        own_.before = group_.request.is_read();
        add_unsolicited(*candidate);
    }
}

std::vector<Unused> Attempt::take_unsolicited() { return std::exchange(unsolicited_, {}); }

TimePoint Attempt::deadline() const {
    if (is_broadcast()) return timing_.sent;
    const TimePoint over = give_up();
    if (!is_hearing()) return in_doubt() ? std::min(over, timing_.sent + timing_.usual) : over;
    // The bytes that the echo filter buffers begin like the reply, too.
    // So does what has no known length, as long as it is no frame.
    const bool hole = echo_.pending() ||
                      (framer_.has_candidate() &&
                       (framer_.knows_length() || !modbus::crc_ok(framer_.pending(), orders_)));
    Duration silence = hole ? timing_.hole : timing_.end_of_frame;
    if (framer_.is_inside()) silence = silent_interval(timing_.serial);
    const TimePoint silent = std::max(timing_.sent, last_byte_) + silence;
    // A possible reply is heard to its end, also after the timeout, but not without limit.
    const bool may_be_reply = framer_.has_candidate() || echo_.pending();
    return std::min(silent, may_be_reply ? over + timing_.longest_reply : over);
}

Verdict Attempt::on_deadline(TimePoint now, const Ends& ends) {
    if (now < deadline()) return Verdict::open;
    if (is_hearing()) {
        if (take_from_echo(ends) == Verdict::replied) return Verdict::replied;
        const std::size_t before = unsolicited_.size();
        if (accept(framer_.on_silence()) == Verdict::replied) return Verdict::replied;
        judge_unsolicited(before, ends);
    }
    const bool usual_is_over = now >= timing_.sent + timing_.usual;
    if (answers_.has_candidate() && usual_is_over)
        return answers_.is_doubted() ? Verdict::doubtful : believe();
    if (instead_ == Instead::reply) return Verdict::wrong;
    beheaded_ = beheaded_ || framer_.ends_beheaded(damaged_bytes_);
    if (answers_.has_candidate()) return Verdict::open;  // something else came behind it
    const bool own = is_only_own_beginning();
    if ((framer_.was_damaged_whole() && !own) || beheaded_) return Verdict::damaged;
    const Duration wait = in_doubt() ? timing_.usual : timing_.patience;
    if (now < timing_.sent + wait) return Verdict::open;
    if (instead_ == Instead::unrelated) return Verdict::wrong;
    const bool damaged = (framer_.was_damaged() && !own) || echo_.mismatch() || contested();
    return damaged ? Verdict::damaged : Verdict::silent;
}

Verdict Attempt::take_from_echo(const Ends& ends) {
    const Bytes released = echo_.release();
    if (released.empty()) return Verdict::open;
    const ByteView rest = drop_stale(buffered_at_, buffered_at_, released, 0, buffered_last_);
    if (rest.empty()) return Verdict::open;
    heard_ = true;
    arrivals_.add(buffered_at_, rest.size());
    return feed(rest, ends);
}

Verdict Attempt::on_frame_end(bool good, const Ends& ends) {
    take_from_echo(ends);
    const std::size_t before = unsolicited_.size();
    if (accept(framer_.on_end(good)) == Verdict::replied) return Verdict::replied;
    judge_unsolicited(before, ends);
    if (instead_ == Instead::reply) return Verdict::wrong;
    const bool damaged = framer_.was_damaged_whole() && !answers_.has_candidate();
    return damaged ? Verdict::damaged : Verdict::open;
}

void Attempt::on_end(TimePoint now, Duration left) {
    if (!wants_end(now)) return;
    const TimePoint end = now + left;
    if (left <= Duration::zero() || heard_ || end > computed_end_ + timing::kLatestEnd) {
        end_confirmed_ = true;
        return;
    }
    timing_.sent = end;
}

/// Learns nothing if the bytes in front of the reply may be a damaged echo, or show that the
/// transport was delayed and earlier bytes may be lost.
void Attempt::teach(EchoMemory& memory) const {
    const bool noisy = noise_in_front_ * 2 >= echo_.frame().size();
    const bool clean = !echo_.mismatch() && !noisy && !frames_in_front_;
    if (!echoed() && (own_.fragment || clean))
        memory.on_reply_without_echo(group_.request, own_.fragment, group_.station);
}

Duration Attempt::waited(TimePoint now) const {
    if (pace_.is_shorter()) return std::max(first_byte_ - timing_.sent, Duration::zero());
    const auto& before = answers_.in_time();
    return waited_for(before ? before->came : std::min(now, reply_came_), reply());
}

TimePoint Attempt::first_byte() const {
    if (!answers_.has_reply() || !timing_.steady) return first_byte_;
    return std::min(first_byte_, timing_.sent + waited(last_byte_));
}

bool Attempt::may_answer_first_heard() const {
    const std::size_t size = modbus::request_adu_length(first_heard_);
    return begins_with_request(first_heard_, echo_.frame(), orders_) &&
           first_heard_[0] == group_.station &&
           heard_size_ >= size + reply().size() + modbus::kAduOverhead &&
           modbus::answers(modbus::pdu_of(ByteView(first_heard_).first(size)), reply());
}

bool Attempt::in_doubt() const {
    if (echo_.mismatch() || answers_.has_candidate()) return true;
    const bool damaged = framer_.was_damaged() && !is_only_own_beginning();
    return timing_.is_last ? damaged && damaged_bytes_.size() >= kHeader : damaged || disturbed_;
}

/// An adapter that switches late lets a part of our request through: no damage where no reply can
/// begin so. That to a write does.
bool Attempt::is_only_own_beginning() const {
    const ByteView own = echo_.frame();
    const auto length = group_.request.reply_length();
    if (damaged_bytes_.size() < kHeader || damaged_bytes_.size() > own.size()) return false;
    return group_.request.is_read() && length && own[2] != *length - kHeader - 2 &&
           std::ranges::equal(damaged_bytes_, own.first(damaged_bytes_.size()));
}

bool Attempt::came_damaged_before() const {
    if (noise_in_front_ < reply().size() + modbus::kAduOverhead) return false;
    const std::array head{group_.station, reply().front()};
    const auto behind = std::ranges::search(damaged_bytes_, head).end();
    // A part of our own request's echo begins like the reply, but continues as the request.
    return behind != damaged_bytes_.end() && *behind != group_.request.pdu()[1];
}

Unused Attempt::own_frame(const Bytes& pdu) const {
    Unused part;
    part.kind = Unused::Kind::own;
    part.station = group_.station;
    part.bytes = adu_of(pdu);
    return part;
}

void Attempt::reject_reply() {
    const Bytes rejected = answers_.reject();
    refusal_rejected_ = refusal_rejected_ || modbus::exception_of(rejected).has_value();
    add_unsolicited(rejected);
    heard_ = false;
    disturbed_ = true;
}

void Attempt::keep_candidate(Duration needed, Answers::Kept kind) {
    answers_.keep(kind, {first_byte_, std::min(last_byte_, reply_came_)});
    timing_.usual = std::min(timing_.usual, needed);
    // The reply that the duplicate has delayed comes after it.
    if (answers_.is_doubted() || kind == Answers::Kept::held)
        timing_.usual = std::min(last_byte_ - timing_.sent + needed, timing_.patience);
    begins_anew_ = true;
    disturbed_ = true;
}

bool Attempt::is_stale(TimePoint now, std::size_t size) const {
    if (!timing_.tolerance || heard_) return false;
    const Duration before = (size - 1) * byte();
    return now - before < timing_.sent - *timing_.tolerance;
}

}  // namespace panelgate::arbiter
