#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "random.hpp"
#include "sound_plant.hpp"

namespace panelgate::sound {

inline constexpr std::uint16_t kRefused = 48;  ///< a refusing panel refuses reads from here on
inline constexpr std::uint16_t kMemory = 100;  ///< the first register that clients write
inline constexpr std::uint16_t kCells = 32;
inline constexpr std::uint16_t kCommand = kMemory + kCells - 1;  ///< of a resetting panel

/// Reads that a client repeats in turn: of addresses below kMemory, or of what the client itself
/// writes.
std::vector<Bytes> draw_questions(Random& random, std::size_t client);

/// A panel of a sound plant: the requests that the panel hears, and its replies.
class Panel {
  public:
    Panel(const PanelPlan& plan, std::uint64_t seed) : plan_(plan), random_(seed * 100 + plan.id) {}

    const PanelPlan& plan() const { return plan_; }
    Kind kind() const { return plan_.kind; }
    Duration think() { return random_.between(plan_.least_think, plan_.most_think); }

    /// A request has come whole. True if the panel answers it.
    bool hears_request(const Bytes& adu, TimePoint start, TimePoint end);
    /// A reply of any panel begins.
    void hears_reply(TimePoint start);
    /// Carries the request out; returns the reply.
    Bytes serve(const Bytes& pdu);
    void replies_until(TimePoint end) {
        replied_ = end;
        thinking_ = false;
    }
    /// The connection of the request is gone: the panel does not reply.
    void forget() { thinking_ = false; }

    /// Count of requests that the panel has served.
    std::size_t served() const { return past_.size(); }
    /// True if the panel has given this reply to this request after `since` served requests, or
    /// would have given this reply to a read.
    bool has_said(const Bytes& pdu, const Bytes& reply, std::size_t since) const;

  private:
    using Memory = std::array<std::uint16_t, kCells>;
    struct Served {
        Memory memory{};  ///< behind the request
        Bytes write;      ///< the request, if it was a write
    };
    /// The reply to this request directly behind the served request number `turn`.
    Bytes reply_at(const Bytes& pdu, std::size_t turn) const;
    std::uint16_t value(unsigned address, std::size_t turn) const;
    void store(const Bytes& pdu, Memory& memory) const;

    PanelPlan plan_;
    Random random_;
    std::vector<Served> past_;
    bool thinking_ = false;
    TimePoint replied_{};  ///< the end of its last reply
    /// A panel of libmodbus waits until then for the reply of another panel.
    TimePoint expects_until_{};
};

}  // namespace panelgate::sound
