#include "panelgate/arbiter/station.hpp"
#include "panelgate/arbiter/book/timing.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

Station::Station(const StationSettings& settings, const OfflineSettings& offline, bool listed,
                 Duration frame)
    : settings_(settings), listed_(listed), replies_(settings), health_(offline), trail_(frame) {}

void Station::apply(const StationSettings& settings, const OfflineSettings& offline, bool listed) {
    settings_ = settings;
    listed_ = listed;
    replies_.apply(settings);
    health_.apply(offline);
}

void Station::on_asked(OutstandingRequests& book, TimePoint now, const Group& group,
                       bool in_transit) {
    replies_.on_asked(book, now, group, in_transit);
    asked_ = now;
    writes_in_a_row_ = group.request.is_read() ? 0 : std::min(writes_in_a_row_ + 1, kWritesInARow);
    polls_passed_over_ = group.is_poll() ? 0 : std::min(polls_passed_over_ + 1, kPollsPassedOver);
    if (group.request.is_read()) read_turn_ = wants_check_ = woken_by_write_ = false;
}

Station::Heard Station::on_unsolicited_frame(OutstandingRequests& book, TimePoint now, Done done,
                                             ByteView pdu, bool asked) {
    Heard heard{replies_.on_unsolicited(book, now, done, pdu, asked)};
    if (done == Done::duplicate) trail_.on_unsolicited(now);
    // It may be the true answer to the last request: then the one before it shows no pace.
    if (done == Done::second) times_ = times_before_;
    if (!is_late(done)) return heard;
    // Probes wait for less long, and any of many may have been answered.
    if (heard.needed && (!heard.at_least || health_.offline())) times_.add_long(*heard.needed);
    return heard;
}

bool Station::on_sign_of_life(TimePoint now) {
    missed_ = false;
    probes_ = 0;
    return health_.on_late_reply(now);
}

Station::Replied Station::on_reply(OutstandingRequests& book, TimePoint now, const Attempt& attempt,
                                   Duration waited, Duration think) {
    const Group& group = attempt.group();
    Replied result;
    result.before = condition();
    result.back = health_.on_reply(now);
    probes_ = 0;
    wants_check_ = read_turn_ = false;
    if (group.request.is_read()) {
        read_missed_ = false;
    } else {
        ignored_places_ = 0;
    }
    failed_in_a_row_ = 0;
    failing_.clear();
    missed_ = false;
    lately_ = result.back ? 0 : static_cast<std::uint8_t>(lately_ << 1);
    if (group.shows_pace()) {
        times_before_ = times_;
        times_.add(waited);
        if (!group.request.is_read())
            slowest_write_ = std::max(waited, slowest_write_.value_or(waited));
    }
    if (!group.shows_pace()) times_.add_long(waited);  // if not to the attempt before: more
    turnaround_.add(think);
    result.drift = turnaround_.take_report(settings_.response_timeout);
    result.trailed = trail_.seen();
    const TimePoint came = attempt.came_at(now);
    const auto& first = attempt.answers().first_came();
    trail_.on_reply(first.value_or(came));
    if (first) trail_.on_unsolicited(came);  // its copy
    replies_.on_answered(book, came, attempt, waited);
    result.trail = trail_.take_report();
    const bool exception = modbus::exception_of(attempt.reply()).has_value();
    hole_.on_reply(now, attempt.longest_pause());
    if (const auto& look = attempt.pace().end_look())
        clock_drift_.on_look(look->reply, look->whole);
    unusual_ = exception ? kUnusualReplies : std::max(unusual_ - 1, 0);
    return result;
}

void Station::on_failed(TimePoint now, Verdict verdict, Duration cost,
                        const modbus::Request* write) {
    const bool is_read = write == nullptr;
    if (!is_read && !is_ignored(*write)) ++ignored_places_;
    if (!is_read) ignored_ = write->pdu();
    read_missed_ = read_missed_ || is_read;
    read_turn_ = !is_read;
    failed_ = now;
    if (verdict != Verdict::silent) unusual_ = kUnusualReplies;
    if (health_.offline() || flaky()) ++probes_;
    const int silent = verdict == Verdict::silent ? 1 : 0;
    lately_ = static_cast<std::uint8_t>(lately_ << 1 | silent);
    if (failing()) failing_.spend(now, cost);
    // A silent write says nothing about reads; damage does.
    if (!health_.offline()) spend(now, cost, is_read || silent == 0);
}

bool Station::take_half_open(TimePoint now, bool is_read) {
    if (!is_read && woken_by_write_) return false;
    if (!health_.take_half_open(now)) return false;
    woken_by_write_ = !is_read && replies_.reads().any();
    return true;
}

bool Station::on_given_up(TimePoint now, Fault fault, bool is_read) {
    ++failed_in_a_row_;
    missed_ = false;
    if (was_heard(fault) && !health_.offline()) {
        health_.on_damaged();
        return false;
    }
    if (is_read || !answers_reads()) return health_.on_silence(now, speculative());
    wants_check_ = health_.on_silent_write();
    return false;
}

Condition Station::condition() const {
    if (health_.offline()) return Condition::offline;
    if (failing()) return Condition::failing;
    if (flaky()) return Condition::flaky;
    if (missed_last()) return Condition::missed;
    return health_.last_heard() ? Condition::well : Condition::unheard;
}

bool Station::may_retry(const Group& group) const {
    if (group.abandoned() || health_.offline() || failing() || speculative()) return false;
    if (missed_last() && !group.first_silence) return false;
    const bool harmless = group.request.is_read() || (settings_.retry_writes && group.repeatable);
    const int failed = group.attempts - group.doubts;
    return harmless && failed <= settings_.retries;
}

Duration Station::twice_what_take(double share) const {
    const Duration think = turnaround_.quantile(share);
    return think + std::max(think, times_.shortest().value_or(Duration{}));
}

Duration Station::response_timeout() const {
    const Duration whole = settings_.response_timeout;
    if (!settings_.adaptive_timeout || !turnaround_.known()) return whole;
    const Duration wanted = settings_.timeout_floor + twice_what_take(0.98);
    return std::min(whole, wanted * (1 << std::countr_one(lately_)));
}

Duration Station::usual(std::optional<Duration> line, bool is_write) const {
    const std::optional<Duration> own = is_write ? std::max(slowest(), slowest_write_) : slowest();
    const Duration whole = settings_.response_timeout;
    if (!own && !line) return whole;
    return std::min(whole, std::max(timing::kShortestWait,
                                    (own ? *own : *line) * 3 / 2 + timing::kReceiveMargin));
}

Duration Station::patience(const Group& group, std::optional<Duration> line, bool urgent,
                           bool flaky_beside_others) const {
    const Duration whole = settings_.response_timeout;
    if (group.silent_after > Duration::zero()) {
        // A retry after a whole timeout waits as long as the panel has ever needed; one after a
        // shorter wait waits longer than that.
        if (group.silent_after >= whole) return usual(line);
        return settings_.adaptive_timeout ? whole : std::min(whole, 2 * group.silent_after);
    }
    if (group.distinct_length) return usual(line);
    // A station that stopped inside a reply is alive but may still be delayed: the two attempts
    // together wait as long as one.
    if (group.cut_after > Duration::zero() && !health_.offline())
        return std::max(usual(line), whole - group.cut_after);
    constexpr int kDear = 16;
    if (health_.offline() && slowest() && turnaround_.known() && probes_ % kDear != kDear - 1) {
        // A few replies delayed by a network must not make probes long: one in kDear waits as long
        // as it has ever needed, the others as long as most replies take.
        constexpr double kMost = 0.75;
        const Duration most =
            std::max(timing::kShortestWait, twice_what_take(kMost) + timing::kReceiveMargin);
        return std::min(usual(line), most);
    }
    if ((health_.offline() || flaky_beside_others) && !slowest()) {
        // Its think time is unknown: one in kOneIn waits longer, and longer each time.
        constexpr int kOneIn = 4;
        constexpr int kDoublings = 6;
        const int longer = probes_ % kOneIn == kOneIn - 1 ? 1 + probes_ / kOneIn % kDoublings : 0;
        return std::min(whole, usual(line) * (1 << longer));
    }
    if (health_.offline() || missed_last() || speculative() || flaky_beside_others)
        return usual(line);
    if (urgent && slowest())
        return std::min(response_timeout(), std::max(times_.share_of_few(whole),
                                                     usual(line, !group.request.is_read())));
    // A write that is not repeated waits for the configured time: the panel may have become slower,
    // and only the reply shows whether it was executed.
    const bool repeatable = group.request.is_read() || settings_.retry_writes;
    return repeatable ? response_timeout() : whole;
}

}  // namespace panelgate::arbiter
