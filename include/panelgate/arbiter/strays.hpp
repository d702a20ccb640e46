#pragma once

#include <optional>
#include <vector>

#include "panelgate/arbiter/ledger.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// What is heard and belongs to no transaction: gathered until a silence ends it, told apart, and
/// handed to whom it concerns. Pure.
class Strays {
  public:
    explicit Strays(const SerialFormat& serial) : serial_(serial) {}

    /// The frame sent last: its echo may come late.
    void on_sent(ByteView adu) { last_frame_.assign(adu.begin(), adu.end()); }
    /// Who answered last: what stands behind that is its trail.
    void on_replied(std::uint8_t station) { replied_ = station; }
    std::uint8_t replied() const { return replied_; }
    void forget() { idle_.clear(); }

    /// Bytes that nobody asked for (MST-04): counted, never matched with a later request.
    void hear(ByteView bytes);
    bool pending() const { return !idle_.empty(); }
    /// More is gathered than any frame has.
    bool full() const { return idle_.size() > modbus::ReplyFramer::kMaxHeard; }
    /// A silence has ended what was gathered.
    std::vector<modbus::Unused> take(std::uint8_t asked);

    /// Counts, traces, and tells the stations. `idle`: no request has wholly left since the last
    /// reply, so that bytes may be its trail.
    void note(TimePoint now, const std::vector<modbus::Unused>& parts, bool idle,
              Stations& stations, Quiet& quiet, Ledger& ledger) const;
    /// It is the reply that its station gives instead of the right one: not the echo, nor a copy,
    /// nor what was owed.
    bool is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations) const;

  private:
    Ledger::Part judge(const modbus::Unused& part, const Stations& stations) const;
    void let_reply_pass(TimePoint now, ByteView request, const Stations& stations,
                        Quiet& quiet) const;

    SerialFormat serial_;
    Bytes idle_;
    Bytes last_frame_;
    std::uint8_t replied_ = 0;
};

}  // namespace panelgate::arbiter
