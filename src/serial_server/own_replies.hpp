#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::serial_server {

/// Replies sent lately, and whether the adapter gives back what is sent: always, now and then, and
/// at once or behind the master's next request (P8). Takes the echoes out of what is heard. Where a
/// reply equals its request, its echo is a request by its bytes: it is one by its time, if no
/// master could have asked by then, or as long as the line may have an echo. Pure.
class OwnReplies {
  public:
    static constexpr std::size_t kMost = 8;

    /// The device was opened.
    void begin(EchoMode mode);
    /// A reply is being sent. `is_distinct`: no request is the same. `sure_until`: what has come
    /// whole before is no master's. `until`: it may come back until then.
    void add(Bytes frame, bool is_distinct, TimePoint sure_until, TimePoint until);
    /// True if an echo may come.
    bool any() const { return !sent_.empty(); }
    /// Takes the next byte, and returns what belongs to the master: valid until the next call.
    /// `starts`: a frame may begin with it.
    ByteView hear(TimePoint now, std::uint8_t byte, bool starts);
    /// What was heard is none of these: its bytes may have been.
    void disturb();
    /// Forgets those that do not come back any more. Returns what was kept as the beginning of one.
    Bytes expire(TimePoint now);
    std::optional<TimePoint> next_deadline() const;

  private:
    struct Sent {
        Bytes frame;
        bool is_distinct = false;
        bool disturbed = false;
        TimePoint sure_until;
        TimePoint until;
    };
    bool is_echo(const Sent& sent, TimePoint now) const;
    bool begins_one() const;  ///< what is kept does
    Bytes release();

    EchoMode mode_ = EchoMode::automatic;
    EchoState state_ = EchoState::unknown;
    std::deque<Sent> sent_;  ///< the oldest first
    Bytes kept_;             ///< heard, and the beginning of one of them
    Bytes released_;
};

}  // namespace panelgate::serial_server
