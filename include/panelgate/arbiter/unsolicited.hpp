#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "panelgate/arbiter/attempt/arrivals.hpp"
#include "panelgate/arbiter/book/judge.hpp"
#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/echo.hpp"
#include "panelgate/arbiter/outbox.hpp"
#include "panelgate/arbiter/quiet.hpp"
#include "panelgate/arbiter/stations.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// Frames and bytes that belong to no transaction: collected until a silence ends them, classified,
/// and passed to the stations that they concern. Pure.
class UnsolicitedFrames {
  public:
    explicit UnsolicitedFrames(const SerialFormat& serial, const modbus::CrcOrders& orders = {})
        : serial_(serial), orders_(orders) {}

    /// The frame sent last: its echo may come late.
    void on_sent(TimePoint now, ByteView adu, bool echoes = false) {
        late_echo_.on_sent(now, adu, echoes);
        frame_before_ = replied_ != 0 ? std::move(last_frame_) : Bytes{};
        last_frame_.assign(adu.begin(), adu.end());
        values_size_ = 0;
        replied_before_ = std::exchange(replied_, std::uint8_t{0});
    }
    /// Bytes after this answer are its station's trail, and may be such values as it has.
    void on_replied(TimePoint now, std::uint8_t station, ByteView reply = {}) {
        replied_ = station;
        replied_at_ = now;
        if (reply.size() < 2 || reply[0] > modbus::kReadInputRegisters) return;
        values_header_ = {station, reply[0], reply[1]};
        values_size_ = reply.size() + modbus::kAduOverhead;
    }
    LateEcho& late_echo() { return late_echo_; }
    /// True if this is the frame sent last, or before, heard right behind its reply.
    bool is_own_behind_reply(TimePoint heard_at, ByteView adu) const {
        const bool is_last = std::ranges::equal(adu, last_frame_);
        return heard_at <= replied_at_ + timing::kLongestTrail &&
               (is_last ? replied_ != 0 : std::ranges::equal(adu, frame_before_));
    }
    /// True if it is, or comes back long after it was sent: no other master's.
    bool is_own(TimePoint heard_at, ByteView adu) const {
        return is_own_behind_reply(heard_at, adu) || late_echo_.is_own(heard_at, adu);
    }
    /// The station that answered the frame before the one on the wire; 0: none.
    std::uint8_t replied_before() const { return replied_before_; }
    void forget() {
        idle_.clear();
        cut_.clear();
    }

    /// Unsolicited bytes (MST-04): counted, never matched with a later request.
    void hear(TimePoint now, ByteView bytes);
    bool pending() const { return !idle_.empty(); }
    /// True if that has begun with the last answer's header, and is shorter: the rest may follow a
    /// hole. Fewer bytes may be left of an echo.
    bool has_begun() const {
        return serial_.mode == SerialMode::rtu && idle_.size() >= values_header_.size() &&
               idle_.size() < values_size_ &&
               std::equal(values_header_.begin(), values_header_.end(), idle_.begin());
    }
    /// True if more is collected than any frame has.
    bool full() const { return idle_.size() > modbus::ReplyFramer::kMaxHeard; }
    /// Takes and classifies what a silence has ended.
    std::vector<modbus::Unused> take(std::uint8_t asked);
    /// Takes what the line has delimited, a `good` frame or none (ASCII).
    std::vector<modbus::Unused> take_delimited(std::uint8_t asked, bool good);

    /// The same, but what a pause or our own request has cut in two is whole: our own frame,
    /// another master's request, or an answer to one. Its first piece has passed as damage. What
    /// holds a late reply stays damage, and closes nothing, but names the station that is there.
    std::vector<modbus::Unused> joined(TimePoint now, std::vector<modbus::Unused> parts,
                                       const Stations& stations);

    /// Counts, traces, and updates the stations. `idle`: no request has wholly left since the last
    /// reply, so that bytes may be its trail.
    void note(TimePoint now, const std::vector<modbus::Unused>& parts, bool idle,
              Stations& stations, Quiet& quiet, Outbox& outbox);
    /// What came shows that this station is there.
    static void note_life(TimePoint now, std::uint8_t station, Stations& stations, Outbox& outbox);
    /// True if the station sent this instead of the right reply: not the echo, a duplicate, an
    /// outstanding reply, or its answer to a broadcast or another master. `heard_after`: from the
    /// end of the request to the first byte behind it.
    bool is_wrong_reply(TimePoint now, ByteView adu, const Stations& stations,
                        Duration heard_after) const;

  private:
    Facts facts_of(TimePoint now, ByteView adu, bool damaged, const Stations& stations) const;
    static void note_reply(TimePoint now, TimePoint heard_at, const modbus::Unused& part, Done done,
                           bool asked, Stations& stations, Quiet& quiet, Outbox& outbox);
    void let_reply_pass(TimePoint now, ByteView request, const Stations& stations,
                        Quiet& quiet) const;

    SerialFormat serial_;
    modbus::CrcOrders orders_;
    Bytes idle_;
    Arrivals arrivals_;  ///< of those
    Bytes cut_;          ///< the last damaged bytes, which may go on
    Bytes last_frame_;
    Bytes frame_before_;  ///< if it was answered
    LateEcho late_echo_;
    std::array<std::uint8_t, 3> values_header_{};  ///< of the answer to it, if a read's
    std::size_t values_size_ = 0;                  ///< with address and CRC; 0: none
    std::uint8_t replied_ = 0;                     ///< to the last frame; 0: none, or not yet
    std::uint8_t replied_before_ = 0;
    TimePoint replied_at_{};
};

}  // namespace panelgate::arbiter
