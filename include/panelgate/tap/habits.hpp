#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

/// Shorter than nearly all masters' timeouts: an adapter's latency timer plus a panel's think time.
inline constexpr Duration kQuickest = 30ms;

/// The time after which the line's master gives up without an answer, learned from requests that
/// were surely not answered: the least of the last ones, at least three. A master's timeout may be
/// changed, so the value is dropped after the master has waited for later replies three times
/// without giving up in between.
class GiveUp {
  public:
    void seen(Duration interval);
    /// A reply came this long after its request, and the master had still waited.
    void outwaited(Duration interval);
    std::optional<Duration> least() const;
    /// True if the master's timeout for other stations does not apply here.
    bool is_different() const { return refuted_; }

  private:
    static constexpr std::size_t kNeeded = 3;
    static constexpr std::size_t kKept = 8;
    std::deque<Duration> seen_;
    std::deque<Duration> outwaited_;  ///< since the last one seen
    bool refuted_ = false;            ///< by longer waits
};

/// Whether one station answers broadcasts, which is wrong: that looks like its answer to a write.
class BroadcastHabit {
  public:
    /// A broadcast was heard.
    void heard(TimePoint now) { since_ = since_.value_or(now); }
    /// A frame of the station came that may answer one. `asked`: or a request.
    void may_have_answered(bool asked) {
        since_.reset();
        none_ = none_ && asked;
    }
    /// A frame may have been missed.
    void missed() { since_.reset(); }
    /// The station has surely answered a request.
    void answered(TimePoint now);
    /// True if one had no answer, and none was seen to have one since.
    bool answers_none() const { return none_; }

  private:
    std::optional<TimePoint> since_;  ///< the first broadcast to which it has said nothing
    bool none_ = false;
};

/// What is known of one station, as far as it helps to match replies to requests.
class Habits {
  public:
    /// A reply that surely answers its request came `think` after it. `differs`: no copy of the
    /// request can be taken for it.
    void answered(Duration think, bool differs = true);
    /// A reply came. `noise`: and a few damaged bytes between its request and it.
    void replied(bool noise) { noisy_ = noise ? std::min(noisy_ + 1, kNoisy) : 0; }
    /// A read that was surely answered, and which a reply may look like.
    void asks(const Bytes& pdu);
    /// True if that frame may be a read that its master asks now and again.
    bool has_asked(ByteView pdu) const;

    /// Longest recent think time; empty before the first reply.
    std::optional<Duration> longest_think() const { return longest_; }
    /// The longest of the last ones but for one of eight; empty before the first reply.
    std::optional<Duration> usual_think() const;

    /// True if it has never answered nearly as soon as that, by its last reads.
    bool is_too_soon(Duration think) const;
    /// What may be its answer to a write came: true if too soon, which is believed when it has
    /// happened some times.
    bool seems_too_soon(Duration think);
    void expect_copies() { hasty_ = 0; }
    /// True if there is noise in front of its replies as a rule.
    bool is_noisy() const { return noisy_ >= kNoisy; }

    GiveUp give_up;
    BroadcastHabit broadcasts;
    std::optional<TimePoint> repeated;  ///< when it last sent more than it was asked for
    int owed = 0;                       ///< replies, to requests that are outstanding in the book

  private:
    static constexpr std::size_t kThinks = 32;
    static constexpr std::size_t kSlower = 8;  ///< one of so many is an exception
    static constexpr std::size_t kReads = 16;
    static constexpr int kNoisy = 8;
    static constexpr int kHasty = 3;
    static constexpr std::size_t kSome = 3;  ///< replies that show how soon it answers
    std::optional<Duration> longest_;
    std::deque<Duration> differing_;  ///< those of replies that differ from their request
    int noisy_ = 0;                   ///< replies with noise in front, in a row
    int hasty_ = 0;                   ///< answers to writes that seemed too soon
    std::deque<Duration> thinks_;
    std::deque<Bytes> reads_;  ///< the last one last
};

}  // namespace panelgate::tap
