#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
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

}  // namespace panelgate::tap
