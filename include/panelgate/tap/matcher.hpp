#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tap/cutter.hpp"
#include "panelgate/tap/habits.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tap/settings.hpp"

namespace panelgate::tap {

/// Listens to a line whose master is somebody else, and tells which reply was to which request.
/// Pure: bytes and time in, events out. Never says that a reply belongs to a request where it may
/// be another's without `doubtful`. Memory is bounded.
class Matcher {
  public:
    explicit Matcher(const Settings& settings);

    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    /// What was said meanwhile nobody here has heard: what is open ends in doubt.
    void on_line_down(TimePoint now);

    /// What has happened, in its order.
    std::optional<Event> poll_action();
    std::optional<TimePoint> next_deadline() const;

  private:
    struct Asked {
        Question question;
        TimePoint begin;
        TimePoint end;
        bool damaged = false;  ///< bytes that are no frame were heard behind it
        std::size_t damaged_bytes = 0;
        bool wrong = false;      ///< its station said something else
        bool disturbed = false;  ///< somebody did: its master may have given it up at once
        bool doubtful = false;
    };
    enum class Reading : std::uint8_t { answer, request, open };

    void cut(bool silence);
    void take(Piece piece);
    bool resolve(Piece& piece);
    void on_answer(Piece piece);
    void on_request(Piece piece);
    void on_reply(Piece piece);
    void on_damaged(Piece piece);
    void answer(Piece piece, bool in_doubt);
    void ask(const Piece& piece, bool doubtful);
    void give_up(TimePoint now);
    void give_up_for(const Piece& request);
    bool is_old_reply(const Habits& habits, const Piece& piece) const;
    Reading read(const Piece& piece) const;
    Duration quick(const Habits& habits) const;
    Duration patience(const Habits& habits) const;
    std::optional<TimePoint> resolved_at() const;
    Habits& of(std::uint8_t station);
    const Question* question() const { return asked_ ? &asked_->question : nullptr; }
    void note(FrameKind kind, std::uint8_t station, const Piece& piece);
    void tell(Transaction transaction) { events_.emplace_back(std::move(transaction)); }

    Settings settings_;
    Cutter cutter_;
    std::optional<Asked> asked_;
    std::optional<Piece> held_;  ///< its answer, or the same request again: what follows tells
    std::map<std::uint8_t, Habits> habits_;
    GiveUp give_up_;        ///< of the whole line
    bool noise_ = false;    ///< since the last good frame
    TimePoint last_end_{};  ///< of a good frame
    std::deque<Event> events_;
};

}  // namespace panelgate::tap
