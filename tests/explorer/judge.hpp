#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "few.hpp"
#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "rules.hpp"

namespace panelgate::explorer {

/// Register values tell which address they are of and how many requests its station had served.
constexpr unsigned value_of(unsigned address, unsigned served) {
    return address << 8 | (served & 0xFF);
}

/// Holds what is sent and answered against the promises, in the words of the first one broken.
/// Knows what the panels did; shares no code with the arbiter. Plain values, to be copied.
class Judge {
  public:
    /// A request that was accepted and not answered yet.
    struct Open {
        arbiter::Ticket ticket = 0;
        Wish wish{};
        TimePoint submitted{};
        std::uint16_t value = 0;   ///< of a write
        std::uint16_t served = 0;  ///< by its station, when it came in
        bool gone = false;         ///< its client
        bool sent = false;
        bool executed = false;

        bool covers(std::uint8_t station, std::uint8_t function, unsigned address) const {
            return wish.station == station && function == (wish.write ? 6 : 3) &&
                   wish.address <= address && address < wish.address + unsigned{wish.count};
        }
    };
    using Opens = Few<Open, 6>;

    void on_accepted(Open open);
    void on_gone(std::uint8_t client);
    void on_line(TimePoint now);
    void on_heard(TimePoint now) { heard_until_ = now; }
    /// A device server keeps its line's silences itself: what it was given is in its hands.
    void on_taken(TimePoint now) { sent_until_ = std::min(sent_until_, now); }
    /// `for_somebody`: not a probe, nor a read to learn the echo.
    void on_transmit(TimePoint now, ByteView adu, TimePoint end, bool for_somebody);
    /// A station has taken a request in.
    void on_served(std::uint8_t station, ByteView pdu);
    void on_finish(TimePoint now, const arbiter::Finish& finish);
    /// Everybody whose deadline has passed must have been answered.
    void on_time(TimePoint now);
    void fail(std::string_view what) {
        if (violation_.empty()) violation_ = what;
    }

    std::string_view violation() const { return violation_; }
    const Opens& open() const { return open_; }
    bool is_open(arbiter::Ticket ticket) const {
        return std::ranges::find(open_, ticket, &Open::ticket) != open_.end();
    }
    std::uint16_t served(std::uint8_t station) const { return served_[station]; }
    TimePoint sent_until() const { return sent_until_; }
    TimePoint heard_until() const { return heard_until_; }

  private:
    void check_write(ByteView pdu);
    void check_read(ByteView adu);
    void check_values(const Open& open, ByteView reply);

    std::string_view violation_;  ///< a literal
    Opens open_;
    std::array<std::uint16_t, 3> served_{};
    TimePoint sent_until_{};
    TimePoint heard_until_{};
};

}  // namespace panelgate::explorer
