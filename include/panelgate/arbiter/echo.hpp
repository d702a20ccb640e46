#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// Takes our own frame out of what is heard behind it (P8, T6). For one frame. Pure.
class EchoFilter {
  public:
    enum class Expect : std::uint8_t {
        nothing,    ///< the line has no echo
        perhaps,    ///< matching bytes are buffered until they are the echo, or are not
        certainly,  ///< other bytes in front are a collision
    };

    EchoFilter() = default;
    EchoFilter(Bytes frame, Expect expect)
        : frame_(std::move(frame)), expect_(expect), possible_(expect != Expect::nothing) {}

    /// Returns what is no echo: a part of `bytes`, or a buffer that is valid until the next call.
    ByteView feed(ByteView bytes);
    /// The line is silent: returns the buffered bytes that did not become the echo.
    Bytes release();
    /// The whole frame came, which feed() did not find: other bytes were in front.
    void on_whole_frame() { complete_ = true; }

    /// True if bytes are buffered that may still turn out to be no echo.
    bool pending() const { return expect_ == Expect::perhaps && matched_ > 0; }
    /// Bytes until an echo that has begun is complete or disproved, at least; 0: none has begun.
    std::size_t missing() const;
    /// The frame that was sent.
    ByteView frame() const { return frame_; }
    /// True if the line may have an echo.
    bool possible() const { return possible_; }
    /// True if the whole frame came back.
    bool complete() const { return complete_; }
    /// True if an echo was certain and other bytes came.
    bool mismatch() const { return mismatch_; }
    /// True if this reply PDU equals the request that was sent.
    bool is_own(ByteView pdu) const {
        return frame_.size() == pdu.size() + modbus::kAduOverhead &&
               std::ranges::equal(modbus::pdu_of(frame_), pdu);
    }

  private:
    Bytes frame_;
    Expect expect_ = Expect::nothing;
    bool possible_ = false;
    std::size_t matched_ = 0;  ///< bytes of the frame that have matched so far
    std::ptrdiff_t lost_ = 0;  ///< bytes of those that were not heard: the first at most
    bool complete_ = false;
    bool mismatch_ = false;
    Bytes released_;
};

/// True if the reply can never equal this request: the reply shows whether there is an echo.
bool teaches_echo(const modbus::Request& request);

/// True if the bytes begin with another master's request, and not with our `own` frame.
bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders);

/// True if address and function of `frame` stand in `heard`: a part of the echo.
bool holds_beginning(ByteView heard, ByteView frame);

/// What is known of a line's echo (P8, T6): configured, or learned from requests whose replies
/// cannot be mistaken for their echo, anew after each opening of the device. Pure.
class EchoMemory {
  public:
    explicit EchoMemory(EchoMode mode) : mode_(mode) { forget(); }

    EchoState state() const { return state_; }
    /// The device was opened: it may be another one.
    void forget();
    EchoFilter::Expect expect() const;
    /// True if a read must show first whether this request could be confirmed by its own echo.
    bool must_be_learned_before(const modbus::Request& request) const {
        return state_ == EchoState::unknown && !request.is_read();
    }
    /// A whole request came back. Returns true if the line is now known to have an echo.
    bool on_echo();
    /// A reply came without an echo in front, and nothing else was in front.
    void on_no_echo();
    /// The echo differed: learned again, unless configured.
    void on_mismatch() {
        if (mode_ != EchoMode::on) forget();
    }

  private:
    /// Replies in a row without an echo, until the adapter is taken for another one: echoes get
    /// lost now and then (T3), and the next one would confirm a write.
    static constexpr int kNoMore = 16;

    EchoMode mode_;
    EchoState state_ = EchoState::unknown;
    int missed_ = 0;  ///< replies in a row without an echo
};

}  // namespace panelgate::arbiter
