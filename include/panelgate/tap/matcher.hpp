#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "panelgate/arbiter/book/outstanding_requests.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tap/cutter.hpp"
#include "panelgate/tap/habits.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tap/places.hpp"
#include "panelgate/tap/settings.hpp"

namespace panelgate::tap {

/// Listens to a line with another master, and matches replies to requests. Pure: bytes and time in,
/// events out. A reply that may belong to another request is always marked `doubtful`. One that is
/// believed is told when its master goes on, or no second one has come for a while: two different
/// answers to one request are both in doubt. Memory is bounded.
class Matcher {
  public:
    explicit Matcher(const Settings& settings);

    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    /// Anything sent meanwhile is missed: an open request ends in doubt.
    void on_line_down(TimePoint now);

    /// Returns the next event, in order.
    std::optional<Event> poll_action();
    std::optional<TimePoint> next_deadline() const;

  private:
    struct Asked {
        PendingRequest pending;
        TimePoint begin;
        TimePoint end;
        bool damaged = false;  ///< damaged bytes were heard after it
        std::size_t damaged_bytes = 0;
        bool wrong = false;      ///< its station sent another frame
        bool disturbed = false;  ///< another frame came: its master may have given it up at once
        bool doubtful = false;
    };
    enum class Reading : std::uint8_t { answer, request, open };

    void cut(bool silence);
    void take(Piece piece);
    bool resolve(Piece& piece);
    bool resolve_echo(Piece& candidate, Piece& piece);
    bool resolve_read(Piece& candidate, Piece& piece);
    void on_answer(Piece piece);
    void on_request(Piece piece);
    void on_reply(Piece piece);
    void close(const Piece& piece);
    void on_damaged(Piece piece);
    void answer(Piece piece, bool in_doubt);
    void remember(const Transaction& made, bool unanswered, bool outstanding);
    bool is_doubtful(const Asked& asked, const Piece& piece, const arbiter::Claims& claimed) const;
    bool misses_request(const Asked& asked, Duration think) const;
    bool may_answer_broadcast(const Piece& piece, bool asked);
    bool is_duplicate(const Piece& piece, const Bytes& request,
                      const arbiter::Claims& claimed) const;
    bool is_last_again(const Piece& piece, const Bytes& request);
    void hold(Transaction made);
    void tell_held();
    bool is_second_answer(const Piece& piece) const;
    void ask(const Piece& piece, bool doubtful);
    void on_broadcast(const Piece& piece);
    void give_up(TimePoint now);
    void give_up_for(const Piece& request);
    arbiter::Claims claims(const Piece& piece, ByteView open = {}) const;
    bool repeats_last(const Piece& piece) const;
    bool is_old_reply(const Piece& piece) const;
    Reading read(const Piece& piece) const;
    bool is_repeated(const Piece& piece) const;
    bool copies(TimePoint now) const;
    bool comes_too_soon(const Piece& piece);
    void learn_of_copies(const Piece& copy);
    Duration quick(const Habits& habits) const;
    Duration usual(const Habits& habits) const;
    Duration patience(const Habits& habits) const;
    std::optional<TimePoint> resolved_at() const;
    Habits& of(std::uint8_t station);
    const PendingRequest* pending() const { return asked_ ? &asked_->pending : nullptr; }
    void note(FrameKind kind, std::uint8_t station, const Piece& piece);
    void report(Transaction transaction) { events_.emplace_back(std::move(transaction)); }

    Settings settings_;
    Cutter cutter_;
    std::optional<Asked> asked_;
    std::optional<Piece>
        candidate_;  ///< its answer, or the same request again: later frames decide
    std::optional<Transaction> held_;  ///< believed, if no second answer comes
    TimePoint held_until_{};
    std::map<std::uint8_t, Habits> habits_;
    std::map<std::uint8_t, Places> places_;
    arbiter::OutstandingRequests book_;  ///< what the line's master has asked, seen from it
    GiveUp give_up_;                     ///< of the whole line
    std::optional<TimePoint> copied_;    ///< when a request was last heard twice at once
    bool noise_ = false;                 ///< since the last good frame
    TimePoint last_end_{};               ///< of a good frame
    std::deque<Event> events_;
};

}  // namespace panelgate::tap
