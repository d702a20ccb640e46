#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::standby {

/// What a box is on one line.
enum class Role : std::uint8_t {
    listening,  ///< the line is only heard
    claiming,   ///< the line was silent: one read shows whether a panel answers
    active      ///< the line's master
};
inline std::string_view label(Role role) {
    constexpr std::string_view kWords[] = {"listening", "claiming", "active"};
    return kWords[static_cast<std::size_t>(role)];
}

/// What the owner of a seat does next.
enum class Deed : std::uint8_t {
    listen,     ///< sends nothing any more, and hears the line
    probe,      ///< sends one read to a panel that has answered, then calls on_probed()
    drive,      ///< drives the line
    keep_alive  ///< sends a cheap read: an active master is never silent for long
};

/// One box's place at a line that two boxes share. The wire is the lease: the master is never
/// silent for longer than kSilence, and who hears silence for longer than its patience may claim
/// the line. A box that was stopped, or that hears another master of a lower rank, listens first.
/// Pure: time is an argument; a call returns at most one deed.
class Seat {
  public:
    /// Longest silence of an active master; a keep-alive is sent before.
    static constexpr Duration kSilence = 500ms;
    static constexpr Duration kKeepAlive = 350ms;
    /// Silence that a claim needs: with rank 1 half a second more.
    static constexpr Duration kPatience = 1s;
    static constexpr Duration kPatienceOfRank = 500ms;
    /// A box that has not run for so long was stopped: another box may be the master by now.
    static constexpr Duration kStopped = 1s;
    static constexpr Duration kProbe = 1s;          ///< longest wait for the panel's answer
    static constexpr Duration kRetry = 500ms;       ///< pause behind a probe without an answer
    static constexpr Duration kLongestRetry = 10s;  ///< … when all panels have been asked
    static constexpr Duration kLeaves = 5s;  ///< pause of a box that has left the line to the other
    static constexpr Duration kPeerCounts = 3s;  ///< what the peer said counts for so long

    explicit Seat(unsigned rank) : rank_(rank) {}

    /// Sets the longest time that a master is silent on this line, such as while it waits for a
    /// panel: silence has to be longer before it counts. Never less than kSilence.
    void set_quiet(Duration quiet) { quiet_ = std::max(quiet, kSilence); }

    Role role() const { return role_; }
    TimePoint since() const { return since_; }
    /// Why the role is what it is: a clause for people.
    std::string_view why() const { return why_; }
    /// True if probes were not answered while the line was silent: this box may be deaf.
    bool is_deaf() const { return deaf_; }
    /// True if a frame may be sent now: the box is the master, and was not stopped.
    bool may_send(TimePoint now) const { return role_ == Role::active && now < looked_ + kStopped; }

    /// The line can be used, or not.
    std::optional<Deed> on_line(TimePoint now, bool up);
    /// Something was heard that this box has not asked for.
    std::optional<Deed> on_heard(TimePoint now);
    /// Another master's request was heard.
    std::optional<Deed> on_foreign_request(TimePoint now);
    /// This box has sent a frame.
    void on_sent(TimePoint now) { sent_ = now; }
    /// The peer says whether it is the line's master.
    void on_peer(TimePoint now, bool active) {
        peer_active_ = active;
        peer_said_ = now;
    }
    /// `all_tried`: each panel has been asked once more, so that the pause may grow.
    std::optional<Deed> on_probed(TimePoint now, bool answered, bool all_tried = true);
    /// No panel answers this master, and the other box is there: it may have the line.
    std::optional<Deed> on_unanswered(TimePoint now);
    /// Call each 100 ms.
    std::optional<Deed> look(TimePoint now);

  private:
    std::optional<Deed> listen(TimePoint now, std::string_view why);
    void enter(TimePoint now, Role role, std::string_view why);
    std::optional<Deed> try_to_claim(TimePoint now);

    unsigned rank_;
    Duration quiet_ = kSilence;
    Role role_ = Role::listening;
    std::string_view why_ = "it has just begun";
    TimePoint since_{};
    TimePoint heard_{};   ///< the last sign of another master, or when listening began
    TimePoint sent_{};    ///< the last own frame
    TimePoint looked_{};  ///< the last look
    TimePoint next_claim_{};
    Duration retry_ = kRetry;
    TimePoint peer_said_{};
    bool peer_active_ = false;
    bool up_ = false;
    bool deaf_ = false;
};

}  // namespace panelgate::standby
