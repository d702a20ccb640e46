#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// The reads that a station is known to answer: one of them tells whether it is there. Pure.
class LearnedReads {
  public:
    void on_answered(const modbus::Request& read, const modbus::Span& span) {
        std::uint32_t& longest = longest_[static_cast<std::size_t>(span.table)];
        longest = std::max(longest, span.count);
        if (!cheapest_ || span.count < cheapest_->span()->count) cheapest_ = read;
        if (!largest_ || span.count > largest_->span()->count) largest_ = read;
    }
    /// What clients want of a station that has never answered: it may answer nothing else.
    void on_wanted(const modbus::Request& request) {
        if (request.span()) last_ = request;
    }
    bool any() const { return cheapest_.has_value(); }
    /// The cheapest that it has answered; else what was asked last.
    modbus::Request probe() const {
        if (cheapest_) return *cheapest_;
        return last_ ? *last_ : modbus::Request::read({modbus::Table::holding_registers, 0, 1});
    }
    /// The largest that it has answered; else the probe.
    modbus::Span largest() const { return largest_ ? *largest_->span() : *probe().span(); }
    /// Longest read of this table that it has answered, in items.
    std::uint32_t longest(modbus::Table table) const {
        return longest_[static_cast<std::size_t>(table)];
    }

  private:
    std::optional<modbus::Request> cheapest_;  ///< that it has answered
    std::optional<modbus::Request> largest_;   ///< that it has answered; so are parts of it
    std::optional<modbus::Request> last_;      ///< probe before it has answered any
    std::array<std::uint32_t, modbus::kTables.size()> longest_{};  ///< by table
};

/// What a station with outstanding replies has done since the line was reopened because of them.
/// Pure.
class ReconnectState {
  public:
    void on_opened() {
        opened_ = true;
        answered_ = false;
    }
    /// A request to it has ended without its own reply.
    void on_outstanding() { opened_ = answered_ = false; }
    /// `quick`: within half of its timeout. A slow one is not asked for another length again: that
    /// takes as long as waiting.
    void on_replied(bool quick) {
        answered_ = opened_;
        if (only_known_reads_ && quick && ++replies_ >= kEnough) only_known_reads_ = false;
    }
    /// `distinct_length`: a read sent only because its reply's length is distinct.
    void on_probe_unanswered(bool distinct_length) {
        only_known_reads_ = distinct_length;
        replies_ = 0;
    }

    /// True if it has answered each request since then, and at least one. These may have been the
    /// outstanding replies in order: then as many are still to come, at once.
    bool answered() const { return answered_; }
    /// True if it may answer only the reads that it has answered before.
    bool only_known_reads() const { return only_known_reads_; }

  private:
    static constexpr int kEnough =
        16;  ///< replies after which the other length may just have been lost

    int replies_ = 0;  ///< since it did not answer a read of another length
    bool opened_ = false;
    bool answered_ = false;
    bool only_known_reads_ = false;
};

}  // namespace panelgate::arbiter
