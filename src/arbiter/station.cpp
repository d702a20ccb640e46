#include "panelgate/arbiter/station.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

Station::Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
                 Duration frame)
    : settings_(settings),
      listed_(listed),
      health_(offline),
      late_(settings.late_window, settings.response_timeout),
      adaptive_(settings.timeout_floor, settings.response_timeout),
      trail_(frame) {}

void Station::owe(TimePoint now, const Bytes& pdu, TimePoint sent) {
    constexpr std::size_t kMost = 16;  // more attempts than that are not made for one request
    owed_pdu_ = pdu;
    proved_ = false;
    owed_.push_back(sent);
    if (owed_.size() > kMost) owed_.pop_front();
    rest_for_owed(now);
}

/// Of those that it may be the reply to, the oldest that could still come: one of long ago must not
/// make a later one look late.
TimePoint Station::answered_request(TimePoint now) const {
    const auto open = [&](TimePoint sent) {
        return now < sent + settings_.response_timeout + late_.value();
    };
    const auto found = std::ranges::find_if(owed_, open);
    return found == owed_.end() ? owed_.back() : *found;
}

/// Until what left last can no longer be answered: within its timeout, and so much later as its
/// replies may be late.
void Station::rest_for_owed(TimePoint now) {
    not_before_ = std::max(now, owed_.back() + settings_.response_timeout) + late_.value();
}

void Station::on_proved(TimePoint now, TimePoint sent) {
    if (!owes() || proved_ || owed_.back() >= sent) return;
    proved_ = true;
    not_before_ = std::max(not_before_, now + settings_.response_timeout + late_.value());
}

void Station::on_asked(TimePoint now, const Group& group, bool held_back) {
    if (now >= not_before_ && !held_back) owed_.clear();
    if (!owes()) damaged_ = false;
    asked_ = now;
    if (group.span) last_read_ = group.pdu;
}

Stray Station::judge(TimePoint now, ByteView pdu) const {
    const bool copy = copies_.is_copy(now, pdu);
    if (copy && copies_.known()) return Stray::copy;  // what is owed comes all the same
    if (owes() && modbus::answers(owed_pdu_, pdu)) return Stray::late;
    if (copy) return Stray::copy;
    return copies_.is_second(now, pdu) ? Stray::second : Stray::unasked;
}

Station::Heard Station::on_stray_frame(TimePoint now, ByteView pdu) {
    Heard heard;
    heard.stray = judge(now, pdu);
    const bool may_be_copy = copies_.is_copy(now, pdu);
    if (heard.stray != Stray::late) {
        copies_.on_unasked(now, pdu);
        not_before_ = std::max(not_before_, copies_.rest_until());
        if (heard.stray == Stray::copy) trail_.on_stray(now);
        return heard;
    }
    // Panels serve in turn: it is the oldest one that is owed.
    const TimePoint asked = answered_request(now);
    const TimePoint due = asked + settings_.response_timeout;
    // Behind a wait that was cut short it tells how long the panel needs; what was held up for
    // longer than the whole timeout does not.
    if (now <= due) slowest_.add(now - asked);
    heard.lateness = std::max(now - due, Duration::zero());
    if (heard.lateness > Duration::zero()) late_.on_late(heard.lateness);
    // What repeats the reply before it may be that once more, and what is owed still comes.
    if (may_be_copy) {
        copies_.on_doubt(now, pdu);
    } else {
        owed_.pop_front();
    }
    heard.settled = owed_.empty();
    copies_.on_reply(now, owed_pdu_, Bytes(pdu.begin(), pdu.end()));
    if (heard.settled) not_before_ = now + copies_.hold();
    heard.back = health_.on_reply(now);
    missed_ = false;
    probes_ = 0;
    return heard;
}

void Station::on_damaged_bytes(TimePoint now, std::uint8_t id, ByteView bytes) {
    const Bytes* copy = copies_.copy_in(now, id, bytes);
    if (copy == nullptr) return;
    const Bytes reply = *copy;
    if (owes()) return copies_.on_doubt(now, reply);
    copies_.on_unasked(now, reply);
}

Station::Replied Station::on_reply(TimePoint now, const Attempt& attempt, Duration waited,
                                   Duration think) {
    const Group& group = attempt.group();
    Replied result;
    result.back = health_.on_reply(now);
    probes_ = 0;
    failed_in_a_row_ = 0;
    failing_.clear();
    missed_ = false;
    lately_ = result.back ? 0 : static_cast<std::uint8_t>(lately_ << 1);
    // What answers a retry may be the reply to the attempt before: it tells nothing.
    if (group.silent_after == Duration::zero()) slowest_.add(waited);
    turnaround_.add(think);
    adaptive_.on_reply();
    late_.on_timely();
    if (drift_.check(turnaround_, settings_.response_timeout))
        result.drift = turnaround_.quantile(0.95);
    result.trailed = trail_.seen();
    trail_.on_reply(now);
    if (attempt.was_held() && copies_.is_copy(now, attempt.reply())) copies_.on_confirmed();
    copies_.on_reply(now, group.pdu, attempt.reply());
    if (trail_.hold() > Duration::zero() && !std::exchange(trail_told_, true))
        result.trail = trail_.hold();
    const bool exception = modbus::exception_of(attempt.reply()).has_value();
    audible_ = !group.settles;          // once is enough where it does not tell
    if (group.settles && !exception) {  // an exception may be that to what was owed
        owed_.clear();
        not_before_ = now;
    }
    if (owes()) {
        // Each attempt may be answered, and nobody knows which one this reply was for.
        owed_.pop_front();
        owed_.push_back(attempt.timing().sent);
        rest_for_owed(now);
    } else {
        not_before_ = std::max(not_before_, now + copies_.take_doubt());
    }
    if (!group.span || exception) return result;
    std::uint32_t& longest = longest_read_.at(group.span->function);
    longest = std::max(longest, group.span->count);
    remember_read(*group.span, group.pdu);
    return result;
}

namespace {

/// The reply to one of these reads cannot answer the other.
bool tells_apart(ByteView a, ByteView b) {
    return a[0] != b[0] ||
           modbus::reply_length_from_request(a) != modbus::reply_length_from_request(b);
}

}  // namespace

/// The cheapest read to probe with, and the cheapest one of another shape.
void Station::remember_read(const ReadSpan& span, const Bytes& pdu) {
    const auto known = read_span(0, cheapest_read_);
    if (known && span.count >= known->count) {
        const auto other = read_span(0, other_read_);
        const bool cheaper = !other || span.count < other->count;
        if (cheaper && tells_apart(pdu, cheapest_read_)) other_read_ = pdu;
        return;
    }
    if (known && tells_apart(pdu, cheapest_read_)) other_read_ = cheapest_read_;
    cheapest_read_ = pdu;
}

Bytes Station::settling_pdu() const {
    // A second copy of what is owed would come behind it all the same.
    if (!owes() || !audible_ || damaged_ || copies_.known() || cheapest_read_.empty()) return {};
    if (tells_apart(cheapest_read_, owed_pdu_)) return cheapest_read_;
    if (!other_read_.empty() && tells_apart(other_read_, owed_pdu_)) return other_read_;
    auto part = read_span(0, cheapest_read_);
    if (part->count < 2) return {};
    --part->count;
    Bytes pdu = encode_span(*part);
    return tells_apart(pdu, owed_pdu_) ? pdu : Bytes{};
}

void Station::on_failed(TimePoint now, Verdict verdict, Duration cost) {
    if (verdict == Verdict::silent) adaptive_.on_timeout();
    audible_ = false;
    // Some say a damaged reply once more, behind what else they have been asked since.
    damaged_ = damaged_ || verdict != Verdict::silent;
    if (health_.offline() || flaky()) ++probes_;
    const int silent = verdict == Verdict::silent ? 1 : 0;
    lately_ = static_cast<std::uint8_t>(lately_ << 1 | silent);
    if (failing()) failing_.spend(now, cost);
    if (!health_.offline()) spend(now, cost);
}

bool Station::on_given_up(TimePoint now, Fault fault) {
    ++failed_in_a_row_;
    missed_ = false;
    if (fault == Fault::damaged && !health_.offline()) {
        health_.on_damaged();
        return false;
    }
    return health_.on_silence(now, stranger());
}

bool Station::may_retry(const Group& group) const {
    if (group.abandoned() || health_.offline() || failing() || stranger()) return false;
    if (suspect() && !group.first_silence) return false;
    const bool harmless = modbus::is_pure_read(group.pdu) || settings_.retry_writes;
    return harmless && group.attempts <= settings_.retries;
}

Duration Station::short_wait(std::optional<Duration> line) const {
    const std::optional<Duration> own = slowest();
    const Duration whole = settings_.response_timeout;
    if (!own && !line) return whole;
    return std::min(whole, std::max<Duration>(20ms, (own ? *own : *line) * 3 / 2 + 8ms));
}

Duration Station::patience(const Group& group, std::optional<Duration> line, bool hurry,
                           bool spent) const {
    const Duration whole = settings_.response_timeout;
    if (group.silent_after > Duration::zero()) {
        // A retry behind a whole timeout waits as long as the panel has ever needed; one behind a
        // shorter wait longer than that was.
        if (group.silent_after >= whole) return short_wait(line);
        return settings_.adaptive_timeout ? whole : std::min(whole, 2 * group.silent_after);
    }
    if ((health_.offline() || spent) && !slowest()) {
        // Nobody knows how long it needs: now and then one waits longer, and longer each time.
        constexpr int kOneIn = 4;
        constexpr int kDoublings = 6;
        const int longer = probes_ % kOneIn == kOneIn - 1 ? 1 + probes_ / kOneIn % kDoublings : 0;
        return std::min(whole, short_wait(line) * (1 << longer));
    }
    if (health_.offline() || suspect() || stranger() || spent) return short_wait(line);
    // Not a write: what it needs may be longer, and its outcome is worth waiting for.
    if (hurry && slowest() && modbus::is_pure_read(group.pdu))
        return std::min(timeout(), short_wait(line));
    return timeout();
}

Bytes Station::probe_pdu() const {
    if (!cheapest_read_.empty()) return cheapest_read_;
    if (!last_read_.empty()) return last_read_;
    return modbus::encode_read(modbus::Table::holding_registers, 0, 1);
}

std::uint32_t Station::longest_read(std::uint8_t function) const {
    return function < longest_read_.size() ? longest_read_[function] : 0;
}

}  // namespace panelgate::arbiter
