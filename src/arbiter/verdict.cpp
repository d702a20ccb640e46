#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

using fact::when;

// Handles an attempt's outcome: its jobs are answered or it is retried, and its station is judged.

using Kind = StationEvent::Kind;

namespace {

/// How a failed attempt ended.
TransactionEnd end_of(Verdict verdict) {
    if (verdict == Verdict::silent) return TransactionEnd::timeout;
    return verdict == Verdict::wrong ? TransactionEnd::wrong : TransactionEnd::damaged;
}

/// What its jobs are told if nothing better comes.
Fault fault_of(Verdict verdict) {
    if (verdict == Verdict::silent) return Fault::timeout;
    return verdict == Verdict::wrong ? Fault::wrong : Fault::damaged;
}

/// True if another attempt could still answer one of the jobs in time.
bool in_time(TimePoint now, const Group& group) {
    return std::ranges::any_of(group.jobs, [&](const Job& job) { return now < job.start_by; });
}

}  // namespace

void Arbiter::conclude(TimePoint now, Verdict verdict) {
    const std::vector<modbus::Unused> unsolicited =
        unsolicited_.joined(now, active_->take_unsolicited(), stations_);
    const std::uint8_t station = active_->group().station;
    for (const modbus::Unused& part : unsolicited) {
        if (unsolicited_.late_echo().on_heard(now, part.bytes) ||
            unsolicited_.is_own_behind_reply(now, part.bytes)) {
            hear_again(now, part.bytes[0], modbus::pdu_of(part.bytes));
        } else if (begins_with_request(part.bytes, active_->echo().frame(), orders_) &&
                   part.bytes[0] == station)
            stations_.book().on_foreign(now, part.bytes, true);
    }
    const std::vector<modbus::Unused> set_aside = active_->take_set_aside();
    outbox_.inside_attempt(true);
    if (verdict == Verdict::replied) settle(now);
    const Duration usual = stations_.of(station).usual();
    note(now, unsolicited);
    // A late one has shown that the station needs longer now.
    if (const Duration longer = stations_.of(station).usual(); active_ && longer > usual)
        active_->allow_for(longer + latency_);
    for (const modbus::Unused& part : set_aside)
        outbox_.on_unsolicited(now, part, Done::unasked, station);
    if (verdict == Verdict::doubtful) {
        ask_again(now);
    } else if (verdict != Verdict::open && verdict != Verdict::replied) {
        fail(now, verdict);
    }
    outbox_.inside_attempt(false);
}

/// The last bit of a broadcast has left: no reply comes, the line rests for the turnaround.
void Arbiter::end_broadcast(TimePoint now) {
    Attempt attempt = take_active(now);
    quiet_.rest_until(attempt.timing().sent + settings_.broadcast_turnaround + latency_);
    stations_.book().on_broadcast(attempt.timing().sent, attempt.group().request.pdu());
    outbox_.report(attempt, TransactionEnd::ok);
    // Their deadline passed unnoticed while it was leaving.
    for (const Job& job : attempt.group().expire(now)) outbox_.finish(job, Fault::timeout);
    for (const Job& job : attempt.group().jobs)
        outbox_.finish(job, modbus::normal_write_reply(job.request.pdu()));
}

/// Whether it may be another master's answer, or our own request.
Facts Arbiter::facts_of_others(TimePoint now, const Claims& claims) const {
    const bool contested = claims.contested || (active_->may_answer_first_heard() &&
                                                !unsolicited_.is_own(now, active_->first_heard()));
    return when(contested, fact::other_master) |
           when(active_->is_late_echo(now, echo_memory_), fact::late_echo);
}

/// Whether it may be the echo of the request, or a confirmation to all, which equal the answer to a
/// write. `early`: it began before the request had left, on a line that keeps pace.
Facts Arbiter::facts_of_equals(TimePoint now, const Station& station, bool early) const {
    const Attempt& attempt = *active_;
    if (attempt.answers().had_candidate()) return 0;
    const Group& group = attempt.group();
    const Bytes& reply = attempt.reply();
    const bool too_quick =
        early || station.is_far_too_quick(attempt.first_sign(now), stations_.times());
    const bool like_broadcast =
        !modbus::exception_of(reply) && group.doubted.empty() && !group.request.is_read() &&
        station.replies().may_answer_broadcast(stations_.book().behind_broadcast(now, reply));
    const bool like_echo = attempt.may_be_its_echo(now, too_quick, echo_memory_) ||
                           station.replies().may_repeat_confirmation(now, reply);
    return when(like_echo, fact::like_echo) | when(like_broadcast, fact::like_broadcast) |
           when(attempt.precedes_echo(), fact::before_echo);
}

/// What is true of the frame that has the form of the answer.
Facts Arbiter::facts_of_reply(TimePoint now, const Station& station, bool early) const {
    const Attempt& attempt = *active_;
    const Group& group = attempt.group();
    const Bytes& reply = attempt.reply();
    const OutstandingRequests& book = stations_.book();
    const ReplyHabits& habits = station.replies();
    const Claims claims = habits.claims(book, now, reply, &attempt);
    const Duration first_sign = attempt.first_sign(now);
    const bool refusal = modbus::exception_of(reply).has_value();
    const bool first = !attempt.answers().had_candidate();
    const bool is_early = early && !settings_.paced && pace_.believed();
    // What comes early again, and is the same, answers each time.
    const bool before_end =
        early && first && !settings_.paced && pace_.expects_none_early() && reply != group.doubted;
    // An earlier request may have been refused; the next refusal may be that again.
    const bool refuses_other =
        refusal && !group.probe && (attempt.refusal_was_rejected() || claims.other_outstanding);
    const bool overdue =
        claims.passed && (station.is_slow(attempt.begun_after(now)) || habits.is_disordered());
    const bool too_soon =
        first && group.attempts <= 1 && station.is_far_too_quick(first_sign, claims.passed);
    const bool other = (claims.passed && attempt.answers().follows_other()) ||
                       (first && claims.outdated && group.doubted.empty());
    const bool contradicted = other || (attempt.is_undecided(claims.repeats_other) &&
                                        (group.doubts == 0 || !habits.answers_twice()));
    const bool may_be_followed = attempt.goes_on() || holds_answer(now, habits) > Duration::zero();
    const bool misnumbered = refusal && group.may_doubt_refusal() &&
                             habits.may_refuse_other(book, now, claims, group.request.function());
    const bool repeats = station.may_be_duplicate(now, attempt, claims, is_early);
    const bool may_ask = group.may_doubt(reply) ||
                         (refusal && group.may_doubt_refusal() && attempt.may_have_collided()) ||
                         (repeats && !group.jobs.empty() &&
                          habits.earlier_write(book, now, group.request.pdu(), reply) != nullptr);
    return fact::answers | facts_of_others(now, claims) | when(refuses_other, fact::refuses_other) |
           when(overdue, fact::overdue) | facts_of_equals(now, station, is_early) |
           when(misnumbered, fact::misnumbered) | when(repeats, fact::repeats) |
           when(too_soon, fact::too_soon) | when(before_end, fact::before_end) |
           when(contradicted, fact::contradicted) |
           when(first && may_be_followed, fact::may_be_followed) | when(may_ask, fact::may_ask);
}

/// How long the answer is held because another one may follow, or (ASCII) has already begun.
Duration Arbiter::holds_answer(TimePoint now, const ReplyHabits& habits) const {
    const bool begun = ascii_ && ascii_->goes_on();
    return std::max(habits.holds_answers(now), begun ? active_->timing().hole : Duration::zero());
}

/// Returns true if it is the answer.
bool Arbiter::takes_reply(TimePoint now, Station& station, bool early) {
    Attempt& attempt = *active_;
    if (early && !settings_.paced && pace_.believed() && attempt.replied_too_early())
        station.replies().on_perhaps_copied(now);
    const Facts facts = facts_of_reply(now, station, early);
    const Done done = judge(facts);
    if ((facts & fact::overdue) != 0) station.on_doubted(attempt.waited(now));
    if (done == Done::contested) attempt.reject_contested();
    if (done == Done::reject) attempt.reject_reply();
    const auto keep = [&](Answers::Kept as) { attempt.keep_candidate(station.needed(), as); };
    if (done == Done::keep) keep(Answers::Kept::believed);
    if (done == Done::ask_again) keep(Answers::Kept::doubted);
    if (done == Done::suspect_echo) keep(Answers::Kept::echo);
    // Whatever it answers: it is neither our own frame nor an adapter's copy.
    if ((facts & (fact::like_broadcast | fact::repeats)) == fact::like_broadcast &&
        attempt.reply() != attempt.group().request.pdu())
        UnsolicitedFrames::note_life(now, station.id(), stations_, outbox_);
    if (done == Done::hold)
        attempt.keep_candidate(holds_answer(now, station.replies()), Answers::Kept::held);
    if (done != Done::accept && (facts & fact::before_end) != 0) attempt.mark_early();
    attempt.group().odd_pace =
        early && !settings_.paced && !pace_.unbound() && attempt.group().attempts <= 1;
    return done == Done::accept;
}

/// Learns from the reply that has come whether the line keeps its rate.
void Arbiter::learn_pace(bool early) {
    const Group& group = active_->group();
    if (group.doubted_as_early)
        pace_.on_asked_again(active_->reply() == group.doubted ||
                             (!early && !group.early_may_be_old));
    if (active_->answers().follows_early()) pace_.on_followed();
    pace_.on_reply(early);
    pace_.on_rate(active_->pace().hasty());
    if (const auto& look = active_->pace().end_look()) wake_latency_.on_look(look->whole);
}

/// The reply has come.
void Arbiter::settle(TimePoint now) {
    Station& station = stations_.of(active_->group().station);
    const bool early = active_->replied_early();
    if (!takes_reply(now, station, early)) return;
    learn_pace(early);
    Attempt attempt = take_active(now);
    Group& group = attempt.group();
    const Bytes& reply = attempt.reply();
    const Duration think =
        std::max(attempt.waited(now) - silent_interval(settings_.serial), Duration::zero());
    const Duration needed = attempt.first_sign(now);
    OutstandingRequests& book = stations_.book();
    const TimePoint proved =
        station.replies().surely_answered(book, attempt.timing().started, reply);
    group.started = station.replies().sampled(book, now, group);
    const Station::Replied replied = station.on_reply(book, now, attempt, needed, think);
    stations_.on_reply(now, group.shows_pace() ? std::optional(needed) : std::nullopt);
    station.on_kept(now, attempt.came_at(now));
    explain_condition(now, group.station, replied.before);
    if (replied.back) stations_.on_recovery();
    if (settings_.may_stall) stations_.on_proved(now, proved);
    if (!settings_.paced && pace_.unbound() && now < attempt.timing().sent)
        quiet_.on_answered_early(now);
    unsolicited_.on_replied(now, group.station, reply);
    quiet_.await_until(station.trail_until());
    outbox_.on_answered(now, attempt, think, replied);
    attempt.teach(echo_memory_);
    if (attempt.answers().may_be_echo()) echo_memory_.on_suspected(now, group.station);
    const bool refused = modbus::exception_of(reply).has_value();
    outbox_.report(attempt, refused ? TransactionEnd::exception : TransactionEnd::ok);
    const bool shows_echo = attempt.echoed() && !attempt.timing().echoes;
    if (!group.confirms.empty()) return confirm(now, group, reply, shows_echo);
    if (refused) {
        give_back(group);
    } else if (group.span && station.settings().max_age > Duration::zero()) {
        memory_.store({group.station, *group.span}, reply, group.started);
    }
    for (const Job& job : group.jobs)
        outbox_.finish(job, Sharing::part_for(group, reply, job), &job != &group.jobs.front());
}

/// P8: a reply came that may have been the write's echo, an answer to a broadcast, or the last
/// confirmation once more, and a read has now shown what the station holds.
void Arbiter::confirm(TimePoint now, const Group& group, ByteView reply, bool shows_echo) {
    const bool is_answer = modbus::returns_values(group.written)
                               ? has_values(group, reply)
                               : is_confirmed(now, group, reply, shows_echo);
    const Result<Bytes> outcome = is_answer ? Result<Bytes>(group.confirms) : Fault::timeout;
    for (const Job& job : group.jobs) outbox_.finish(job, outcome);
}

/// Where the place does not hold what was written (a command that resets itself), or cannot be
/// read, only a line on which writes do not come back leaves no doubt: an adapter need not echo
/// reads. A confirmation that repeats one was none where the place still holds what that confirmed;
/// where the panel has just said one in place of another's it must hold what was written.
bool Arbiter::is_confirmed(TimePoint now, const Group& group, ByteView reply, bool shows_echo) {
    const OutstandingRequests& book = stations_.book();
    const auto broadcast = book.behind_broadcast(group.doubted_at, group.confirms);
    const bool holds = holds_written(group.written, reply);
    ReplyHabits& habits = stations_.of(group.station).replies();
    if (broadcast && holds) habits.on_broadcast_unanswered();
    if (broadcast && !holds && !modbus::exception_of(reply))
        habits.on_broadcast_answered(*broadcast, false);
    if (echo_memory_.comes_again(now, group.station) ||
        habits.may_repeat_confirmation(now, group.confirms, timing::kForgetDuplicates))
        return holds;
    const BookEntry* const earlier =
        habits.earlier_write(book, group.doubted_at, group.written, group.confirms);
    const bool repeats = earlier || habits.may_repeat_confirmation(now, group.confirms);
    if (broadcast || !repeats)
        return !shows_echo && (holds || (echo_memory_.echoes_no_writes() && !broadcast));
    const bool is_true = holds || !earlier || !holds_written(earlier->pdu, reply);
    habits.on_checked(book, group, is_true);
    return is_true;
}

/// P1: values came that may be an earlier reply's, of a request that is not repeated (17h), and a
/// read has now shown what the station holds. Where it is refused nothing can tell.
bool Arbiter::has_values(const Group& group, ByteView reply) {
    if (modbus::exception_of(reply)) return true;
    const bool equal = std::ranges::equal(reply.subspan(1), ByteView(group.confirms).subspan(1));
    stations_.of(group.station).replies().on_checked(stations_.book(), group, equal);
    return equal;
}

/// An early reply was all that came. Is it another request's, as far as is known?
void Arbiter::doubt_as_early(TimePoint now) {
    Group& group = active_->group();
    const Claims claims =
        stations_.of(group.station)
            .replies()
            .claims(stations_.book(), now, active_->answers().candidate(), &*active_);
    const bool may_be_old = claims.repeats || claims.repeats_other || claims.other_outstanding;
    group.early_may_be_old = group.early_may_be_old || may_be_old;
    pace_.on_doubted();
}

/// The reply may be a duplicate of an earlier one, and the real one may still come. The station's
/// health is not affected.
void Arbiter::ask_again(TimePoint now) {
    if (active_->answers().is_early()) doubt_as_early(now);
    if (active_->answers().follows_early()) pace_.on_followed();
    active_->remember_doubt();
    Attempt attempt = take_active(now);
    outbox_.on_doubted(now, attempt);
    outbox_.report(attempt, TransactionEnd::doubtful);
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    station.replies().on_doubted(stations_.book(), now, group, attempt.timing().sent);
    if (!group.doubted.empty()) station.on_doubted(attempt.waited_for_doubted());
    station.on_kept(now, group.doubted_at);
    if (attempt.answers().contradicted()) station.replies().on_contradicted(now, group.doubts > 1);
    group.silent_after = group.cut_after = {};
    finish_barred(group);
    if (group.doubts <= Group::kMostDoubts && in_time(now, group) && !group.abandoned()) {
        if (!group.request.is_read())
            return schedule_.retry(now, confirming(group, station), {}, stations_);
        outbox_.decide(now, Decision::Kind::doubted, group.jobs.front());
        return schedule_.retry(now, std::move(group), station.usual(), stations_);
    }
    for (const Job& job : group.jobs)
        outbox_.finish(job, job.gone ? Fault::cancelled : Fault::timeout);
}

/// Ends those who may not ask again.
void Arbiter::finish_barred(Group& group) {
    for (const Job& job : take_if(group.jobs, [](const Job& one) { return one.barred; }))
        outbox_.finish(job, job.gone ? Fault::cancelled : Fault::timeout);
}

/// Makes a read for the jobs of this write, whose confirmation may be its echo.
Group Arbiter::confirming(Group& write, const Station& station) {
    Group read{.jobs = std::move(write.jobs),
               .station = write.station,
               .request = station.replies().reads().probe()};
    read.written = write.request.pdu();
    read.doubted_at = write.doubted_at;
    if (auto back = read_back(read.written)) read.request = std::move(*back);
    if (!teaches_echo(read.request))
        read.request = modbus::Request::read({modbus::Table::holding_registers, 0, 1});
    read.attempts = write.attempts;
    read.started = write.started;
    read.confirms = std::move(write.doubted);
    return read;
}

/// What a failed attempt tells, and what stays outstanding of it.
void Arbiter::learn_from_failure(TimePoint now, const Attempt& attempt, Verdict verdict) {
    const modbus::Request& request = attempt.group().request;
    Station& station = stations_.of(attempt.group().station);
    OutstandingRequests& book = stations_.book();
    // Some panels repeat it at once, and a transport that stalls may hold that back.
    if (attempt.came_damaged() && !settings_.may_stall) {
        station.replies().on_damaged_reply(book, now, request, attempt.timing().sent);
    } else if (!attempt.both_came()) {
        station.replies().on_unanswered(book, now, request.pdu(), attempt.timing().sent);
    }
    if (attempt.contested()) book.on_foreign_over(attempt.group().station);
    if (attempt.answered_before_echo() &&
        echo_memory_.on_answered_before(now, request, attempt.group().station))
        outbox_.on_echoed_again(attempt.group().station);
    if (settings_.learns_holes && verdict == Verdict::damaged && attempt.was_cut_off())
        station.on_broken_reply(now, std::max(attempt.longest_pause(), attempt.timing().hole));
    if (verdict == Verdict::silent && attempt.echoed()) echo_memory_.on_unanswered(request);
}

void Arbiter::fail(TimePoint now, Verdict verdict) {
    Attempt attempt = take_active(now);
    outbox_.on_failed(attempt, verdict);
    const bool silent = verdict == Verdict::silent;
    outbox_.report(attempt, end_of(verdict));
    Group& group = attempt.group();
    Station& station = stations_.of(group.station);
    const TimePoint sent = attempt.timing().sent;
    const Duration cost = now - attempt.timing().started + stations_.gap(group.station);
    learn_from_failure(now, attempt, verdict);
    const bool cut_off = verdict == Verdict::damaged && attempt.was_cut_off();
    const bool affordable = stations_.affords_retry(now, station);
    const Condition before = station.condition();
    stations_.on_failed(now, group, verdict, cost, attempt.disturbed());
    if (const auto until = schedule_.line_rests_until(now, group, sent, station)) {
        quiet_.quarantine(now, group.station, *until);
        station.on_line_rests(now, *until - now);
        outbox_.decide({.at = now,
                        .kind = Decision::Kind::line_rests,
                        .station = group.station,
                        .time = *until - now});
    }
    group.silent_after =
        silent ? std::min(now - sent, attempt.timing().patience) - latency_ : Duration::zero();
    group.cut_after = cut_off ? now - sent : Duration::zero();
    finish_barred(group);
    const bool again = group.confirms.empty() && in_time(now, group) && affordable;
    if (again && station.may_retry(group)) {
        station.on_retry(silent);
        // One never heard may be followed by others like it, and each would take as long.
        const Duration dear = before == Condition::unheard ? cost : stations_.patience(now, group);
        schedule_.retry(now, std::move(group), dear, stations_);
    } else if (group.confirms.empty() && group.joined()) {
        station.on_retry(silent);
        give_back(group);  // health unaffected: the panel may only not answer this length
    } else {
        give_up(now, group, fault_of(verdict));
    }
    explain_condition(now, attempt.group().station, before);
}

void Arbiter::explain_condition(TimePoint now, std::uint8_t station, Condition before) {
    const Condition is = stations_.condition(station);
    if (is != before && before != Condition::unheard)
        outbox_.decide(
            {.at = now, .kind = Decision::Kind::condition, .station = station, .condition = is});
}

/// The parts of a joined read are sent again, except for clients that have left.
void Arbiter::give_back(Group& group) {
    for (const Job& job : schedule_.give_back(group)) outbox_.finish(job, Fault::cancelled);
}

/// No further attempt: all jobs are answered, and the station is judged.
void Arbiter::give_up(TimePoint now, const Group& group, Fault fault) {
    for (const Job& job : group.jobs) outbox_.finish(job, fault);
    Backlog& backlog = schedule_.backlog();
    if (group.learns_for != 0 && was_heard(fault)) echo_memory_.on_unclear();
    if (group.learns_for != 0 && !was_heard(fault)) {
        // P8: the write never left, and its station is silent.
        const auto asked = [&](const Job& job) { return job.ticket == group.learns_for; };
        for (const Job& job : backlog.queue().remove_if(asked)) outbox_.finish(job, fault);
    }
    Station& station = stations_.of(group.station);
    if (group.probe) station.replies().on_probe_unanswered(group.distinct_length);
    if (group.distinct_length) return;
    if (!station.on_given_up(now, fault, group.request.is_read())) return;
    if (!station.speculative()) outbox_.event(Kind::offline, group.station);
    const auto theirs = [&](const Job& job) { return job.station == group.station; };
    for (const Job& job : backlog.queue().remove_if(theirs)) outbox_.finish(job, Fault::offline);
}

/// Ends the attempt: accounts for its time, and passes on what the echo filter buffered.
Attempt Arbiter::take_active(TimePoint now) {
    Attempt attempt = std::move(*active_);
    active_.reset();
    const Duration behind = attempt.is_broadcast() ? settings_.broadcast_turnaround
                                                   : stations_.gap(attempt.group().station);
    outbox_.on_ended(now, attempt, behind);
    quiet_.take_rested(now);  // the attempt's own time
    outbox_.written(attempt.group(), true);
    const Group& group = attempt.group();
    if (attempt.echoed() || attempt.echo().mismatch()) unsolicited_.late_echo().on_came();
    if (attempt.echoed() &&
        echo_memory_.on_echo(group.request, !group.confirms.empty(), group.station))
        outbox_.event(Kind::echo, attempt.group().station);
    if (attempt.heard_itself()) echo_memory_.on_write_echo(group.request, group.station);
    if (attempt.heard_itself_again()) hear_again(now, group.station, group.request.pdu());
    // Where a reply may come before the request has left, early bytes prove nothing.
    const bool keeps_pace = settings_.paced || pace_.believed();
    if (const auto noise = attempt.early_noise(); noise && keeps_pace)
        stations_.on_trail(*noise, unsolicited_.replied_before());
    unsolicited_.hear(attempt.last_byte(), attempt.release_pending());
    return attempt;
}

}  // namespace panelgate::arbiter
