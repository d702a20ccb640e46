#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

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

/// What is known of one station, as far as it helps to match replies to requests.
class Habits {
  public:
    /// A reply that surely answers its request came `think` after it.
    void answered(Duration think);
    /// A read that was surely answered, and which a reply may look like.
    void asks(const Bytes& pdu);
    /// True if that frame may be a read that its master asks now and again.
    bool has_asked(ByteView pdu) const;

    /// Longest recent think time; empty before the first reply.
    std::optional<Duration> longest_think() const { return longest_; }
    /// The longest of the last ones but for one of eight; empty before the first reply.
    std::optional<Duration> usual_think() const;

    GiveUp give_up;
    std::optional<TimePoint> repeated;  ///< when it last sent more than it was asked for
    int owed = 0;                       ///< replies, to requests that are outstanding in the book

  private:
    static constexpr std::size_t kThinks = 32;
    static constexpr std::size_t kSlower = 8;  ///< one of so many is an exception
    static constexpr std::size_t kReads = 16;
    std::optional<Duration> longest_;
    std::deque<Duration> thinks_;
    std::deque<Bytes> reads_;  ///< the last one last
};

}  // namespace panelgate::tap
