#pragma once

#include <algorithm>

#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// What is known of the way to the wire, where it may hold frames back and deliver them later (RTU
/// over TCP). A connection proves nothing: the kernel of a device server that hangs takes it, and
/// what was sent on the one before may be served, and answered, behind that. Pure.
class Way {
  public:
    void on_opened(TimePoint now) { opened_ = now; }
    /// A request that was started then has been answered.
    void on_proved(TimePoint started) { proved_ = std::max(proved_, started); }

    /// What was sent before then has passed.
    TimePoint proved() const { return proved_; }
    /// What was sent before then was sent on another connection.
    TimePoint opened() const { return opened_; }

  private:
    TimePoint opened_{};
    TimePoint proved_{};
};

/// What a station that owes replies has shown on the connection that was opened because of them.
/// Pure.
class Return {
  public:
    void on_opened() {
        opened_ = true;
        answered_ = false;
    }
    /// A request to it has ended without its own reply.
    void on_owed() { opened_ = answered_ = false; }
    void on_replied() {
        answered_ = opened_;
        in_vain_ = 0;
    }
    /// `told_apart`: a read that nobody would have asked for but to tell its reply apart.
    void on_in_vain(bool told_apart) {
        plainly_ = told_apart;
        in_vain_ = std::min(in_vain_ + 1, kMost);
    }

    /// It has answered each request since then, and one at least. That may have been the replies
    /// that it owes, one behind another: then as many are still to come, at once.
    bool answered() const { return answered_; }
    /// It may not answer other reads than it is used to.
    bool plainly() const { return plainly_; }
    /// Neither did it answer those that it is used to: perhaps it answers writes alone.
    bool reads_in_vain() const { return in_vain_ >= kMost; }

  private:
    static constexpr int kMost = 3;

    int in_vain_ = 0;  ///< one after another
    bool opened_ = false;
    bool answered_ = false;
    bool plainly_ = false;
};

}  // namespace panelgate::arbiter
