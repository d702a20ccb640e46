#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "panelgate/arbiter/attempt/group.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// The PDUs that have answered one attempt: the reply that is judged, a candidate that is kept
/// until it is clear whether another one follows, and those that differ. Bounded. Pure.
class Answers {
  public:
    static constexpr std::size_t kMostSaid = 8;

    /// What becomes of a candidate when nothing else comes.
    enum class Kept : std::uint8_t {
        none,      ///< there has been no candidate
        believed,  ///< it is the answer
        doubted,   ///< the attempt is doubtful
        held,      ///< it is the answer, unless another one differs
        echo,      ///< the attempt is doubtful: it may be the echo, on a line that had none so far
    };
    /// What came in one burst with an answer, and differs from it.
    struct Others {
        bool any = false;            ///< one has begun, at least
        std::vector<Bytes> whole{};  ///< answers themselves
    };
    struct Times {
        TimePoint began{};
        TimePoint came{};
    };

    /// This answer came, to be judged. Returns the candidate before it, if that was no answer.
    std::optional<Bytes> add(Bytes reply, Others others, const Group& group);
    /// Another one has begun, which differs from the candidate.
    void on_other_begun() {
        kept_ = Kept::doubted;
        contradicted_ = true;
    }
    /// The reply is none. Returns it.
    Bytes reject() { return *std::exchange(reply_, std::nullopt); }
    /// The reply may be none: it is a candidate.
    void keep(Kept kind, const Times& times) {
        kept_ = kind;
        candidate_ = std::exchange(reply_, std::nullopt);
        times_ = times;
    }
    /// The candidate began before the request had left: no reply of any request here.
    void mark_early() { early_ = Early::candidate; }
    /// The candidate is none. Returns it.
    std::optional<Bytes> drop_candidate() { return std::exchange(candidate_, std::nullopt); }
    /// Nothing else came: the candidate is the reply.
    void believe() {
        reply_ = drop_candidate();
        in_time_ = times_;
    }
    /// The attempt is doubtful: its group remembers what came.
    void remember_in(Group& group);

    bool has_reply() const { return reply_.has_value(); }
    /// The whole reply PDU; there must be one.
    const Bytes& reply() const { return *reply_; }
    bool has_candidate() const { return candidate_.has_value(); }
    /// True if it is the candidate that is held, and not yet contradicted.
    bool holds() const { return candidate_ && kept_ == Kept::held; }
    const Bytes& candidate() const { return *candidate_; }
    /// True if the candidate is all that came, and began before the request had left.
    bool is_early() const { return early_ == Early::candidate; }
    /// True if the reply came behind such a one.
    bool follows_early() const { return early_ == Early::followed; }
    bool had_candidate() const { return kept_ != Kept::none; }
    /// True if asking again decides about the candidate.
    bool is_doubted() const { return kept_ == Kept::doubted || may_be_echo(); }
    /// True if the candidate may have been the echo.
    bool may_be_echo() const { return kept_ == Kept::echo; }
    /// Set if the reply was a candidate, or repeats one that may have been it.
    const std::optional<Times>& in_time() const { return in_time_; }
    /// When the candidate came, if the reply repeats it.
    const std::optional<TimePoint>& first_came() const { return first_came_; }
    /// True if one that differs from it came before the reply.
    bool follows_other() const {
        return had_candidate() && !first_came_ && (!in_time_ || contradicted_);
    }
    /// True if two came that differ, before one was given.
    bool contradicted() const { return contradicted_; }
    /// ... unless just one of these came for an earlier attempt, too: the reply. `is_copy`: it has
    /// answered another request.
    bool is_undecided(bool is_copy, const Group& group) const;
    /// Takes those that began too early or contradict the reply.
    std::vector<Bytes> take_set_aside() { return std::exchange(set_aside_, {}); }

  private:
    void note_said(const Bytes& reply);
    void choose(const Group& group);

    std::optional<Bytes> reply_;
    std::optional<Bytes> candidate_;
    Kept kept_ = Kept::none;
    Times times_;  ///< of the candidate
    std::optional<Times> in_time_;
    std::optional<TimePoint> first_came_;
    enum class Early : std::uint8_t { none, candidate, followed } early_{};
    bool contradicted_ = false;
    PoolVector<Bytes> said_;  ///< the values that came, where they differ, each once
    std::vector<Bytes> set_aside_;
};

}  // namespace panelgate::arbiter
