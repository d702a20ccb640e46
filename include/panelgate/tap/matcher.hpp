#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tap/cutter.hpp"
#include "panelgate/tap/heard.hpp"
#include "panelgate/tap/settings.hpp"

namespace panelgate::tap {

/// After how long without an answer the line's master goes on: learned from requests that were
/// surely not answered. The least of the last ones; nothing before there were three. A master may
/// be given another timeout, so what was learned holds until replies later than that were waited
/// for three times, and nothing was given up between.
class GiveUp {
  public:
    void seen(Duration interval);
    /// So long behind its request a reply came, and the master had not gone on.
    void outwaited(Duration interval);
    std::optional<Duration> least() const;
    /// What others have shown of the master does not hold here.
    bool is_another() const { return refuted_; }

  private:
    static constexpr std::size_t kNeeded = 3;
    static constexpr std::size_t kKept = 8;
    std::deque<Duration> seen_;
    std::deque<Duration> outwaited_;  ///< since the last one seen
    bool refuted_ = false;            ///< by them
};

/// How one station answers, as far as that helps to tell whose a reply is.
class Habits {
  public:
    explicit Habits(const Settings& settings) : settings_(settings) {}

    /// A reply that surely was to that request came so long behind it. A panel answers in order:
    /// nothing older is owed any more.
    void answered(Duration think);
    /// A reply came that may be to an older request. Two in a row that come as replies here use to
    /// come, and nothing is owed any more: late ones would not keep that time.
    void answered_perhaps(Duration think);
    /// A request went unanswered: its reply may still come.
    void owes(TimePoint asked, const Bytes& request);
    /// May this reply be to another request than this one?
    bool owes_other(TimePoint now, const Bytes& request, ByteView reply) const;
    /// When the oldest of the same requests was asked that this reply may answer.
    std::optional<TimePoint> owed_since(TimePoint now, const Bytes& request) const;
    /// Is this a late reply? Then it, and what was asked before it, is owed no more.
    bool settle(TimePoint now, ByteView reply);
    bool is_owed(TimePoint now, ByteView reply) const;
    void forget_owed() { owed_.clear(); }

    /// The longest think time lately; nothing before the first reply.
    std::optional<Duration> longest_think() const { return longest_; }

    GiveUp give_up;
    Bytes last_request;                 ///< PDU of the last one that was answered
    Bytes last_reply;                   ///< its reply: address to CRC
    std::optional<TimePoint> repeated;  ///< when it last said a reply twice

  private:
    struct Owed {
        TimePoint asked;
        Bytes request;
    };
    bool is_open(const Owed& owed, TimePoint now) const {
        return now - owed.asked < settings_.late_window;
    }

    Settings settings_;
    std::deque<Owed> owed_;
    std::optional<Duration> longest_;
    int usual_ = 0;  ///< replies in a row that came as usual while something was owed
};

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
