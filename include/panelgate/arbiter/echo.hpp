#pragma once

#include <cstddef>
#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// Watches for our own frame at the front of what is heard after it was sent. One frame, pure.
class EchoFilter {
  public:
    enum class Expect : std::uint8_t {
        nothing,    ///< the line has no echo
        perhaps,    ///< bytes that look like it are held back until they are it, or are not
        certainly,  ///< anything else at the front is a collision
    };

    EchoFilter() = default;
    EchoFilter(Bytes frame, Expect expect) : frame_(std::move(frame)), expect_(expect) {}

    /// Takes what is heard and gives what is not echo: a part of `bytes`, or a copy that lives
    /// until the next call.
    ByteView feed(ByteView bytes);
    /// The line is silent: what was held back and never became the echo.
    Bytes release();

    /// Bytes are held back that may still turn out not to be the echo.
    bool pending() const { return expect_ == Expect::perhaps && matched_ > 0; }
    std::size_t held() const { return pending() ? matched_ : 0; }
    /// The echo has begun, and so many bytes at least have to come until it shows that it is none,
    /// or until it is over. 0: nothing has begun.
    std::size_t missing() const;
    /// It watches for the echo, as long as nothing else has come.
    bool expected() const { return expect_ != Expect::nothing; }
    /// The frame that it watches for: the one sent last.
    ByteView frame() const { return frame_; }
    /// The whole frame came back.
    bool complete() const { return complete_; }
    /// An echo was certain and something else came.
    bool mismatch() const { return mismatch_; }

  private:
    Bytes frame_;
    Expect expect_ = Expect::nothing;
    std::size_t matched_ = 0;  ///< of the frame, while it is being compared
    bool complete_ = false;
    bool mismatch_ = false;
    Bytes released_;
};

/// The reply to this request can never be the request itself: it shows whether there is an echo.
bool teaches_echo(const modbus::Request& request);

/// Two bytes or more of `heard` stand like this in our own frame: a part of its echo.
bool holds_fragment(ByteView heard, ByteView frame);

/// What is known of a line's echo (P8): told by the configuration, or learned from reads, whose
/// answer cannot be mistaken for their echo. Never from 05 or 06. Pure.
class EchoMemory {
  public:
    explicit EchoMemory(EchoMode mode);

    EchoState state() const { return state_; }
    /// What is sent comes back, as far as anybody knows: it has, and not just once has it not.
    bool expects_one() const {
        return state_ == EchoState::present || (heard_ && state_ != EchoState::absent);
    }
    bool known() const { return state_ == EchoState::present || state_ == EchoState::absent; }
    /// The device was opened again: it may be another one.
    void forget();
    EchoFilter::Expect expect(const modbus::Request& request) const;
    /// This request could be confirmed by its own echo, and nobody knows whether there is one.
    /// `tried`: a read was sent for it already; where that did not tell, it goes all the same.
    bool must_be_learned_before(const modbus::Request& request, bool tried) const;

    /// The whole echo of this request came back. True when that is news.
    bool on_echo(const modbus::Request& request);
    /// A good reply to this request came; `fragment`: with a part of the request in front of it.
    /// Other bytes in front, and whatever stands behind, tell nothing about an echo (FRM-07).
    void on_reply_without_echo(const modbus::Request& request, bool fragment);
    /// The read that was to tell did not.
    void on_unclear();
    /// Its own echo was heard and no answer: where it could be its own answer, that may be what it
    /// was, because the line has no echo any more.
    void on_unanswered(const modbus::Request& request);
    /// What came back may have been an echo, where none was known: learn again, unless the
    /// configuration knows.
    void on_suspected() {
        if (mode_ == EchoMode::automatic && state_ == EchoState::absent) begin();
    }
    /// The echo differed: learn again, unless the configuration knows.
    void on_mismatch();

  private:
    void begin();

    /// Replies one after another without any echo, until there is none, where one was heard: bytes
    /// are lost now and then, and a write would be confirmed by the next echo.
    static constexpr int kNoMore = 16;

    EchoMode mode_;
    EchoState state_;
    bool heard_ = false;  ///< an echo, since the device was opened
    int missed_ = 0;      ///< in a row
};

}  // namespace panelgate::arbiter
