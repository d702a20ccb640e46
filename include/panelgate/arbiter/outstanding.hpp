#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

/// The requests to one station whose replies may still come (P1), oldest first. As a rule they are
/// one and the same; on a way that may stall there may be others among them, which were to prove
/// it. Panels serve in turn: a reply that fits several is that of the oldest. Pure.
class Debt {
  public:
    static constexpr std::size_t kMost = 16;  ///< the oldest is forgotten beyond that

    struct Owed {
        TimePoint sent{};
        Bytes pdu;
    };

    bool empty() const { return owed_.empty(); }
    std::size_t size() const { return owed_.size(); }
    void clear() { owed_.clear(); }
    void add(TimePoint sent, const Bytes& pdu);
    /// The oldest one is owed no more. Not of an empty one.
    void pop() { owed_.pop_front(); }
    /// The one that left first, and last. Not of an empty one.
    TimePoint first_sent() const { return owed_.front().sent; }
    TimePoint last_sent() const { return owed_.back().sent; }
    /// It owes something, and nothing but replies to this very request.
    bool is_only(const Bytes& pdu) const;
    /// This reply may be one of them.
    bool fits(ByteView reply) const { return oldest(reply) != nullptr; }
    /// A normal reply to one of them could be taken for that to this request: the same function,
    /// and the same length or echoed fields. `again`: this request is repeated, so that a reply to
    /// its own earlier attempts is an answer to it.
    bool is_ambiguous(const modbus::Request& request, bool again) const;
    /// The request of what this reply answers was served, and a station serves in turn: those of
    /// the same connection (that left at `connected` or later) and before `sent` were served, too.
    void close_before(TimePoint sent, TimePoint connected);
    /// This reply may be one of them, but not by being one to the very same request.
    bool fits_other(ByteView reply, const Bytes& pdu) const;
    /// A request of another function is among them.
    bool has_other_function(std::uint8_t function) const;
    /// The oldest that this reply may answer, or nullptr.
    const Owed* oldest(ByteView reply) const;
    /// ... that left later than `open`: the last one where none did; nullptr where none fits.
    const Owed* oldest(ByteView reply, TimePoint open) const;
    /// This reply has come: the oldest that it may answer is owed no more. What that was; nothing
    /// where none fits.
    Bytes take(ByteView reply);

  private:
    PoolDeque<Owed> owed_;
};

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

/// What panels that answer broadcasts, as none should, may still say to the last ones: behind the
/// turnaround it would pass for the reply to a write that is confirmed in the same words (P8).
/// Pure.
class BroadcastReplies {
  public:
    static constexpr std::size_t kBroadcasts = 16;  ///< that are remembered

    void on_sent(TimePoint sent, ByteView request) {
        Sent& oldest = last_[next_++ % kBroadcasts];
        oldest = {sent, modbus::normal_write_reply(request)};
    }
    /// From then on no reply to a broadcast can be taken for that to `request`. `window`: how long
    /// after a broadcast has left its station may answer it.
    TimePoint over(const modbus::Request& request, Duration window) const {
        TimePoint over{};
        if (request.is_read()) return over;
        for (const Sent& one : last_) {
            if (!one.reply.empty() && modbus::answers(request.pdu(), one.reply))
                over = std::max(over, one.at + window);
        }
        return over;
    }

  private:
    struct Sent {
        TimePoint at{};
        Bytes reply;
    };
    std::array<Sent, kBroadcasts> last_;
    std::size_t next_ = 0;
};

/// What other masters of the line have asked, as far as it was heard: what answers one of these may
/// be its reply. Pure.
class Questions {
  public:
    static constexpr std::size_t kMost = 8;  ///< the oldest is forgotten beyond that

    /// These bytes begin with another master's request. Nobody answers a broadcast.
    void on_heard(TimePoint now, ByteView bytes);
    bool empty() const { return asked_.empty(); }
    void clear() { asked_.clear(); }
    /// This frame answers one that was heard at `since` or later.
    bool fit(ByteView adu, TimePoint since = TimePoint::min()) const;

  private:
    struct Question {
        TimePoint at{};
        Bytes adu;
    };
    std::vector<Question> asked_;
};

}  // namespace panelgate::arbiter
