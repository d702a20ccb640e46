#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/learned.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/station_health.hpp"
#include "panelgate/base/fault.hpp"

namespace panelgate::arbiter {

/// One station: three states (StationHealth), four learned numbers (learned.hpp), and the reads
/// that it answers. What was asked of it is in the line's Outstanding. Pure.
class Station {
  public:
    /// `frame`: duration of a usual reply on this line.
    Station(std::uint8_t id, const StationSettings& settings, const OfflineSettings& offline,
            bool listed, Duration frame);

    /// Applies new settings; what is known of the station is kept.
    void apply(const StationSettings& settings, const OfflineSettings& offline, bool listed);

    const StationSettings& settings() const { return settings_; }
    std::uint8_t id() const { return settings_.id; }
    const StationHealth& health() const { return health_; }
    const KnownReads& reads() const { return reads_; }
    const Trail& trail() const { return trail_; }
    const ThinkTimes& think_times() const { return think_times_; }
    /// How the station has done lately, in one word for people; no decision depends on the word.
    Condition condition() const;

    // When it may be asked

    /// `station_gap` and `after_write` (T14) hold this station alone until then.
    TimePoint rests_until() const { return rests_until_; }
    /// True if its last transactions failed. Ignored writes say nothing about reads (T14).
    bool is_suspect(bool is_read) const {
        return failed_reads_ > 0 || (failed_writes_ > 0 && !(is_read && answers_reads()));
    }
    /// True if the budget of suspects holds its requests (P4). One damaged transaction is not
    /// enough: it may have met another station's frame (T3); nor is one silence where frames get
    /// lost on the line, `lossy` (T1).
    bool is_doubtful(bool is_read, bool lossy) const {
        return (is_suspect(is_read) && (fails_often() || (was_silent() && !lossy))) ||
               speculative();
    }
    /// True if two transactions in a row failed.
    bool fails_often() const { return failed_reads_ + failed_writes_ > 1; }
    /// From when its failures are within its own share, with two timeouts in advance (P4).
    TimePoint affordable_at() const {
        return silences_.next() - 2 * silences_.time_for(settings_.response_timeout);
    }
    /// True if its last attempt was silent.
    bool was_silent() const { return (lately_ & 1) != 0; }
    /// True if nothing shows that its next request may be unanswered: only then reads are retried.
    bool answers_now(bool is_read) const {
        return !is_suspect(is_read) && !was_silent() && !health_.offline() && !speculative();
    }
    /// True if it has answered reads, and the last one too.
    bool answers_reads() const { return reads_.any() && failed_reads_ == 0; }
    /// True if so many writes in a row were unanswered that a read must show whether it is there.
    bool wants_check() const { return wants_check_; }
    /// True if it is neither listed nor was ever heard: there may be no such station.
    bool speculative() const { return !listed_ && !health_.last_heard(); }
    /// When the station was last asked, or wanted by a client, and the client.
    TimePoint asked() const { return asked_; }
    Client wanted_by() const { return wanted_by_; }
    /// End of its last failed attempt.
    TimePoint failed() const { return failed_; }

    // How to ask it

    /// From the end of a request to the beginning of its reply: `response_timeout`, or, adaptive,
    /// the floor and twice the time that 98 of 100 replies needed, doubled after each timeout in a
    /// row; as configured at most, and until enough is known.
    Duration response_timeout() const;
    /// How long after a request its reply may still come.
    Duration latest_reply() const { return settings_.response_timeout + late_window_.value(); }
    /// Longest recent lateness of its replies (T2); 0: it is not late regularly.
    Duration lateness() const { return late_window_.worst(); }
    /// The silence inside its replies that is to be waited for; 0: as long as on the line.
    Duration reply_hole() const { return hole_.learned(); }
    /// True if its request may be sent again: reads of a station that was online, as often as
    /// configured; writes where the station says so (P2).
    bool may_retry(const Group& group) const;

    // What happens

    void on_wanted(TimePoint now, Client client, const modbus::Request& request) {
        asked_ = now;
        wanted_by_ = client;
        reads_.on_wanted(request);
    }
    void on_asked(TimePoint now, const Group& group) {
        asked_ = now;
        if (group.request.is_read()) wants_check_ = false;
    }
    void on_line_down() { health_.on_line_down(); }
    /// A broadcast has left at `sent`: the station may need its time behind a write.
    void on_broadcast(TimePoint sent) {
        if (settings_.after_write > Duration{})
            rests_until_ = std::max(rests_until_, sent + settings_.after_write);
    }
    struct Replied {
        bool back = false;              ///< it was offline
        bool trailed = false;           ///< something followed the previous reply
        std::optional<Duration> drift;  ///< new: its replies come this near the response timeout
        std::optional<Duration> trail;  ///< new: this long something follows its replies
    };
    /// An attempt was answered at `came`; the reply began `needed` after the request.
    Replied on_reply(TimePoint came, const Attempt& attempt, bool refused, Duration needed);
    /// A late reply came, so long after the timeout. True if the station was offline.
    bool on_late(TimePoint now, Duration lateness);
    /// A copy of its last reply came, or bytes that belong to no reply.
    void on_followed(TimePoint now, bool is_copy) { trail_.on_followed(now, is_copy); }
    /// The attempt that was sent at `started`, right behind its last reply, was damaged.
    void on_disturbed(TimePoint started) { trail_.on_disturbed(started); }
    /// An attempt failed that occupied the line for `cost`.
    void on_failed(TimePoint now, const Attempt& attempt, Verdict verdict, Duration cost,
                   bool learns_holes);
    /// A whole transaction failed. Returns true if that took the station offline.
    bool on_given_up(TimePoint now, Fault fault, bool is_read);
    bool take_half_open(TimePoint now) { return health_.take_half_open(now); }

  private:
    StationSettings settings_;
    bool listed_ = false;
    StationHealth health_;
    KnownReads reads_;
    ThinkTimes think_times_;
    LateWindow late_window_;
    ReplyHole hole_;
    Trail trail_;
    ProbeBudget silences_{ProbeBudget::kSuspect};  ///< of its own, whatever it answers in between
    std::uint8_t lately_ = 0;  ///< the last 8 attempts, latest lowest: 1 was silent
    int failed_reads_ = 0;     ///< transactions in a row
    int failed_writes_ = 0;    ///< likewise
    bool wants_check_ = false;
    TimePoint rests_until_{};
    TimePoint asked_{};
    Client wanted_by_ = 0;
    TimePoint failed_{};
};

}  // namespace panelgate::arbiter
