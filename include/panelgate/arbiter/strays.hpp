#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "panelgate/arbiter/ledger.hpp"
#include "panelgate/arbiter/outstanding.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// What is heard and belongs to no transaction: gathered until a silence ends it, told apart, and
/// handed to whom it concerns. Pure.
class Strays {
  public:
    explicit Strays(const SerialFormat& serial, const modbus::CrcOrders& orders = {})
        : serial_(serial), orders_(orders) {}

    /// The frame sent last: its echo may come late.
    void on_sent(ByteView adu) {
        last_frame_.assign(adu.begin(), adu.end());
        replied_before_ = std::exchange(replied_, std::uint8_t{0});
        ++sent_since_;
        if (adu[0] != 0) return;
        broadcast_ = last_frame_;
        sent_since_ = 0;
    }
    /// What stands behind this answer is its station's trail.
    void on_replied(std::uint8_t station) { replied_ = station; }
    /// Who answered what was sent before the frame on the wire; 0: nobody.
    std::uint8_t replied_before() const { return replied_before_; }
    void forget() {
        idle_.clear();
        others_.clear();
    }

    /// Bytes that nobody asked for (MST-04): counted, never matched with a later request.
    void hear(ByteView bytes);
    bool pending() const { return !idle_.empty(); }
    /// More is gathered than any frame has.
    bool full() const { return idle_.size() > modbus::ReplyFramer::kMaxHeard; }
    /// A silence has ended what was gathered.
    std::vector<modbus::Unused> take(std::uint8_t asked);
    /// The line has told that it ends, and whether it is a `good` frame (ASCII).
    std::vector<modbus::Unused> take_told(std::uint8_t asked, bool good);

    /// Counts, traces, and tells the stations. `idle`: no request has wholly left since the last
    /// reply, so that bytes may be its trail.
    void note(TimePoint now, const std::vector<modbus::Unused>& parts, bool idle,
              Stations& stations, Quiet& quiet, Ledger& ledger);
    /// It is the reply that its station gives instead of the right one: not the echo, nor a copy,
    /// nor what was owed, nor its answer to a broadcast or to another master.
    bool is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations) const;

  private:
    Ledger::Part judge(TimePoint now, const modbus::Unused& part, const Stations& stations) const;
    bool answers_broadcast(ByteView adu) const;
    bool answers_other_master(TimePoint now, ByteView adu) const;
    void let_reply_pass(TimePoint now, ByteView request, const Stations& stations,
                        Quiet& quiet) const;

    SerialFormat serial_;
    modbus::CrcOrders orders_;
    Bytes idle_;
    Bytes last_frame_;
    Questions others_;
    Bytes broadcast_;           ///< the last one
    unsigned sent_since_ = 0;   ///< frames behind it
    std::uint8_t replied_ = 0;  ///< what was sent last; 0: nobody, or not yet
    std::uint8_t replied_before_ = 0;
};

}  // namespace panelgate::arbiter
