#pragma once

#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::explorer {

/// How an arbiter is broken on purpose, from outside.
enum class Flaw : std::uint8_t {
    none,
    forgets_at_line_loss,     ///< what is owed does not outlive the line
    repeats_at_partial_echo,  ///< the first bytes of a request that come back end its attempt
    answers_twice,
    loses_an_answer,
    ignores_who_left,
    sends_twice,
    spins,                ///< names a deadline that has passed
    takes_no_slow_reply,  ///< behind a silence, though it is in time
};

/// An arbiter that can tell its state: times counted from `now`, without tickets and counters.
template <class A>
std::optional<std::uint64_t> inner_digest(const A& arbiter, TimePoint now) {
    if constexpr (requires { arbiter.digest(now); }) return arbiter.digest(now);
    return std::nullopt;
}

static_assert(std::is_copy_constructible_v<arbiter::Arbiter>,
              "its parts hold no references to one another");

/// The arbiter that is explored: a value, so that a state is kept by copying it.
class Subject {
  public:
    /// The settings must outlive it and its copies.
    Subject(const arbiter::Settings& settings, Flaw flaw)
        : settings_(&settings), arbiter_(settings), flaw_(flaw) {}

    Result<arbiter::Ticket> submit(TimePoint now, arbiter::Job job) {
        now_ = now;
        const Result<arbiter::Ticket> ticket = arbiter_.submit(now, std::move(job));
        arbiter_.check_invariants();
        if (!ticket) return ticket;
        last_ticket_ = *ticket + renamed_;
        return last_ticket_;
    }
    void cancel(TimePoint now, arbiter::Client client) {
        if (flaw_ == Flaw::ignores_who_left) return;
        arbiter_.cancel(now, client);
        arbiter_.check_invariants();
    }
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    void on_line_up(TimePoint now) {
        now_ = now;
        arbiter_.on_line_up(now);
        arbiter_.check_invariants();
    }
    void on_line_down(TimePoint now);
    std::optional<arbiter::Action> poll_action();
    std::optional<TimePoint> next_deadline() const;

    const arbiter::Arbiter& arbiter() const { return arbiter_; }

  private:
    std::optional<arbiter::Action> poll_arbiter();
    void start_afresh();

    const arbiter::Settings* settings_;
    arbiter::Arbiter arbiter_;
    Flaw flaw_;
    std::vector<arbiter::Action> waiting_;  ///< told before what the arbiter says
    std::uint64_t last_ticket_ = 0;
    std::uint64_t renamed_ = 0;  ///< tickets of arbiters before this one
    Bytes last_sent_;
    bool was_asked_for_ = true;  ///< by a client
    TimePoint now_{};
    TimePoint sent_{};
    bool heard_ = true;    ///< anything since then
    bool missed_ = false;  ///< nothing was heard of a request before
    std::optional<TimePoint> repeat_at_;
    int finished_ = 0;
};

}  // namespace panelgate::explorer
