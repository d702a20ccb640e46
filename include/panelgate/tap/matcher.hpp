#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tap/cutter.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tap/settings.hpp"

namespace panelgate::tap {

/// Listens to a line with another master, and matches replies to requests. Pure: bytes and time in,
/// events out. A reply that may belong to another request is marked `doubtful`, by fixed rules that
/// each name their threat (docs/how/threats.md): nothing is learned from a panel's habits, and
/// nothing can be asked again. Memory is bounded.
class Matcher {
  public:
    explicit Matcher(const Settings& settings);

    /// Bytes came; `now` is the time of the last byte.
    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    /// What the line carries from now on is missed: an open request ends in doubt.
    void on_line_down(TimePoint now);

    /// Returns the next event, in order.
    std::optional<Event> poll_action();
    /// When on_deadline() is due; empty: nothing is waited for.
    std::optional<TimePoint> next_deadline() const;

  private:
    /// The request whose reply the master waits for.
    struct Open {
        PendingRequest request;
        TimePoint begin;
        TimePoint end;
        std::size_t damaged = 0;    ///< bytes of damage heard behind the request
        bool came_damaged = false;  ///< the reply came last, damaged
        bool wrong = false;     ///< the station has sent a frame that does not answer the request
        bool echoed = false;    ///< the request was heard twice at once
        bool doubtful = false;  ///< the request may be a late reply
        bool unsure = false;    ///< damage preceded the request, and may have hidden a request (T3)
    };

    void cut(bool silence);
    void take(Piece piece);
    void on_answer(Piece piece);
    void on_request(Piece piece);
    void on_reply(const Piece& piece);
    void on_echo(const Piece& piece);
    void on_damaged(const Piece& piece);

    void ask(const Piece& piece, bool doubtful);
    void answer(const Piece& piece);
    void remember(const Transaction& made);
    void expect_announced(std::uint8_t station, arbiter::Asked request, TimePoint now);
    void give_up(TimePoint now);

    bool is_doubtful(const Open& open, const Piece& piece) const;
    bool may_answer_older(const Open& open, const Piece& piece) const;
    bool may_be_late(const Piece& piece) const;
    bool equals_open(const Piece& piece) const;
    bool is_echo(const Piece& piece) const;

    const PendingRequest* pending() const { return open_ ? &open_->request : nullptr; }
    arbiter::Asked asked(const Transaction& made) const;
    void note(FrameKind kind, std::uint8_t station, const Piece& piece);

    Settings settings_;
    Cutter cutter_;
    std::optional<Open> open_;
    /// What the line's master has asked, seen from the master: By::us is the master.
    arbiter::Outstanding outstanding_;
    unsigned epoch_ = 0;  ///< number of the connection to the line (T8)
    /// The line may return requests until this time (T6); max: no read has shown that yet.
    TimePoint may_echo_until_ = TimePoint::max();
    bool damage_ = false;  ///< since the last good frame, while no request was open
    std::deque<Event> events_;
};

}  // namespace panelgate::tap
