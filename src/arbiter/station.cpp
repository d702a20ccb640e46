#include "panelgate/arbiter/station.hpp"

#include <algorithm>

namespace panelgate::arbiter {

bool StationHealth::on_reply(TimePoint now) {
    const bool back = on_late_reply(now);
    state_ = Health::online;
    last_success_ = now;
    return back;
}

bool StationHealth::on_late_reply(TimePoint now) {
    const bool back = offline();
    returns_ += silent_ > 0 ? 1u : 0u;
    state_ = Health::suspect;
    known_ = true;
    silent_ = 0;
    last_heard_ = now;
    return back;
}

void StationHealth::on_damaged() {
    returns_ += silent_ > 0 ? 1u : 0u;
    silent_ = 0;
    state_ = Health::suspect;
    // A station that was never heard: the damage may come from any sender.
    known_ = last_heard_.has_value();
}

bool StationHealth::on_silence(TimePoint now) {
    ++silent_;
    known_ = true;
    if (offline()) {
        pause_ = std::min(pause_ * 2, settings_.probe_max);
        next_probe_ = now + pause_;
        return false;
    }
    if (silent_ < settings_.after) {
        state_ = Health::suspect;
        return false;
    }
    state_ = Health::offline;
    pause_ = settings_.probe_min;
    next_probe_ = now + pause_;
    next_half_open_ = now + pause_;
    return true;
}

bool StationHealth::on_silent_write() {
    known_ = true;
    if (offline()) return false;
    state_ = Health::suspect;
    const bool is_last = silent_ + 1 >= settings_.after;
    if (!is_last) ++silent_;
    return is_last;
}

bool StationHealth::take_half_open(TimePoint now) {
    if (now < next_half_open_) return false;
    next_half_open_ = now + pause_;
    return true;
}

Station::Station(std::uint8_t id, const StationSettings& settings, const OfflineSettings& offline,
                 bool listed, Duration frame)
    : health_(offline),
      late_window_(settings.late_window, settings.response_timeout),
      trail_(frame) {
    settings_.id = id;
    apply(settings, offline, listed);
}

void Station::apply(const StationSettings& settings, const OfflineSettings& offline, bool listed) {
    const std::uint8_t id = settings_.id;
    settings_ = settings;
    settings_.id = id;
    listed_ = listed;
    health_.apply(offline);
    late_window_.apply(settings.late_window, settings.response_timeout);
}

Condition Station::condition() const {
    constexpr int kFlaky = 4;  // of the last eight attempts
    if (health_.offline()) return Condition::offline;
    if (fails_often()) return Condition::failing;
    if (std::popcount(lately_) >= kFlaky) return Condition::flaky;
    if (failed_reads_ + failed_writes_ > 0 || was_silent()) return Condition::missed;
    return health_.last_heard() ? Condition::well : Condition::unheard;
}

Duration Station::response_timeout() const {
    const Duration whole = settings_.response_timeout;
    if (!settings_.adaptive_timeout || !think_times_.known()) return whole;
    const Duration wanted = settings_.timeout_floor + 2 * think_times_.quantile(0.98);
    return std::min(whole, wanted * (1 << std::countr_one(lately_)));
}

bool Station::may_retry(const Group& group) const {
    if (group.abandoned() || !group.was_online || group.probe) return false;
    const bool harmless = group.request.is_read() || (settings_.retry_writes && group.repeatable);
    return harmless && group.attempts <= settings_.retries;
}

Station::Replied Station::on_reply(TimePoint came, const Attempt& attempt, bool refused,
                                   Duration needed) {
    const Group& group = attempt.group();
    Replied result;
    result.back = health_.on_reply(came);
    result.trailed = trail_.seen();
    lately_ = result.back ? 0 : static_cast<std::uint8_t>(lately_ << 1);
    wants_check_ = false;
    failed_reads_ = 0;
    if (!group.request.is_read()) failed_writes_ = 0;  // reads say nothing about writes (T14)
    if (result.back) silences_ = ProbeBudget{ProbeBudget::kSuspect};  // it is used at once
    // A reply to a retry may be that to the attempt before.
    if (group.attempts <= 1) think_times_.add(needed);
    result.drift = think_times_.take_report(settings_.response_timeout);
    trail_.on_reply(came);
    result.trail = trail_.take_report();
    late_window_.on_timely();
    hole_.on_reply(came, attempt.longest_pause());
    const bool is_write = !group.request.is_read();
    const Duration rest =
        std::max(settings_.station_gap, is_write ? settings_.after_write : Duration{});
    rests_until_ = came + rest;
    if (!refused && group.request.span()) reads_.on_answered(group.request);
    return result;
}

bool Station::on_late(TimePoint now, Duration lateness) {
    if (lateness > Duration::zero()) late_window_.on_late(lateness);
    trail_.on_reply(now);
    rests_until_ = std::max(rests_until_, now + settings_.station_gap);
    return health_.on_late_reply(now);
}

void Station::on_failed(TimePoint now, const Attempt& attempt, Verdict verdict, Duration cost,
                        bool learns_holes) {
    failed_ = now;
    if (attempt.group().probe && !health_.offline()) reads_.on_unanswered(attempt.group().request);
    const bool is_read = attempt.group().request.is_read();
    // An ignored write says nothing about reads (T14).
    const bool counts = verdict == Verdict::silent && (is_read || !answers_reads());
    lately_ = static_cast<std::uint8_t>(lately_ << 1 | (counts ? 1 : 0));
    if (!health_.offline() && (is_read || !answers_reads())) {
        constexpr int kMemory = 4;  // whole timeouts, or failures of this cost
        const Duration most = std::max(settings_.response_timeout, cost);
        silences_.spend(now, cost, kMemory * silences_.time_for(most));
    }
    if (!is_read) rests_until_ = std::max(rests_until_, now + settings_.after_write);
    if (learns_holes && verdict == Verdict::damaged && attempt.was_cut_off())
        hole_.on_broken(now, std::max(attempt.longest_pause(), attempt.timing().hole),
                        settings_.response_timeout);
}

bool Station::on_given_up(TimePoint now, Fault fault, bool is_read) {
    ++(is_read ? failed_reads_ : failed_writes_);
    if (was_heard(fault) && !health_.offline()) {
        health_.on_damaged();
        return false;
    }
    if (is_read || !reads_.any() || failed_reads_ > 0) return health_.on_silence(now);
    wants_check_ = health_.on_silent_write();
    return false;
}

}  // namespace panelgate::arbiter
