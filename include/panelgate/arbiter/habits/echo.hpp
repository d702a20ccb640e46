#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// Detects and removes our own frame at the front of what is heard after sending it. For one frame.
/// Pure.
class EchoFilter {
  public:
    enum class Expect : std::uint8_t {
        nothing,    ///< the line has no echo
        perhaps,    ///< matching bytes are buffered until they are the echo, or not
        certainly,  ///< anything else at the front is a collision
    };

    EchoFilter() = default;
    EchoFilter(Bytes frame, Expect expect) : frame_(std::move(frame)), expect_(expect) {}

    /// Takes what is heard and returns what is not echo: a part of `bytes`, or a buffer that is
    /// valid until the next call.
    ByteView feed(ByteView bytes);
    /// The line is silent: returns the buffered bytes that did not become the echo.
    Bytes release();

    /// True if bytes are buffered that may still turn out not to be the echo.
    bool pending() const { return expect_ == Expect::perhaps && matched_ > 0; }
    std::size_t pending_size() const { return pending() ? matched_ : 0; }
    /// Bytes until a begun echo is complete or disproved, at least; 0: none has begun.
    std::size_t missing() const;
    /// True while it still looks for the echo.
    bool expected() const { return expect_ != Expect::nothing; }
    /// The frame that it looks for: the one sent last.
    ByteView frame() const { return frame_; }
    /// True if it is the frame of this PDU.
    bool is_own(ByteView pdu) const {
        return frame_.size() == pdu.size() + modbus::kAduOverhead &&
               std::ranges::equal(modbus::pdu_of(frame_), pdu);
    }
    /// True if the whole frame came back.
    bool complete() const { return complete_; }
    /// True if an echo was certain and other bytes came.
    bool mismatch() const { return mismatch_; }

  private:
    Bytes frame_;
    Expect expect_ = Expect::nothing;
    std::size_t matched_ = 0;  ///< bytes of the frame that have matched so far
    bool complete_ = false;
    bool mismatch_ = false;
    Bytes released_;
};

/// What was seen of our own frame where the filter did not recognise it (P8): foreign bytes may
/// precede the echo. Pure.
struct OwnFrame {
    explicit OwnFrame(bool is_expected) : possible(is_expected) {}
    /// The first frame that equals our own confirms nothing, unless a part of the echo came before
    /// it. Remembers it.
    bool may_be_echo(const EchoFilter& filter, ByteView pdu);

    bool possible;           ///< the line may have an echo
    bool seen = false;       ///< after other bytes, where only its echo was expected
    bool fragment = false;   ///< a part of it came damaged
    bool behind = false;     ///< after another frame
    bool before = false;     ///< ... which was a candidate
    bool came_back = false;  ///< as a frame that is no answer
    bool borrowed = false;   ///< its last byte was lost, and the reply's first taken for it
    bool again = false;      ///< once more, behind its echo or the reply
};

/// True if the reply to this request can never equal the request: it shows whether there is an
/// echo.
bool teaches_echo(const modbus::Request& request);

/// True if this write's normal reply can never equal it: it shows whether writes come back.
bool teaches_echo_of_writes(const modbus::Request& request);

/// True if this reply to read_back() of the write holds what it wrote. False if that cannot be
/// told.
bool holds_written(ByteView write, ByteView reply);
/// The read of what this write names, for holds_written(), or of what it reads (17h); empty: none
/// tells.
std::optional<modbus::Request> read_back(ByteView write);

/// True if the bytes begin with another master's request: not our own frame, which an adapter
/// configured without echo may return. The reply framer would take a request followed by its reply
/// for damage.
bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders);

/// True if two or more consecutive bytes of `heard` also occur in `frame`: part of its echo.
bool holds_fragment(ByteView heard, ByteView frame);

/// What is known of a line's echo (P8): configured, or learned from reads, whose answers cannot be
/// mistaken for their echo. Never learned from 05 or 06. Pure.
class EchoMemory {
  public:
    explicit EchoMemory(EchoMode mode);

    EchoState state() const { return state_; }
    /// True if an echo is expected: one was heard, and has not been missing repeatedly since.
    bool expects_one() const {
        return state_ == EchoState::present || (heard_ && state_ != EchoState::absent);
    }
    bool known() const { return state_ == EchoState::present || state_ == EchoState::absent; }
    /// The device was reopened: it may be another one.
    void forget();
    EchoFilter::Expect expect(TimePoint now, const modbus::Request& request) const;
    /// True if this request could be confirmed by its own echo while the echo is unknown. `tried`:
    /// a read was already sent for it; if that was inconclusive, the request goes all the same.
    bool must_be_learned_before(const modbus::Request& request, bool tried) const;

    /// The whole echo of this request came back; `expected`: so had that of a write before. Returns
    /// true if the line is now known to have an echo.
    bool on_echo(const modbus::Request& request, bool expected = false, std::uint8_t station = 0);
    /// A good reply to this request came; `fragment`: preceded by a part of the request. Other
    /// bytes in front or behind say nothing about an echo (FRM-07).
    void on_reply_without_echo(const modbus::Request& request, bool fragment,
                               std::uint8_t station = 0);
    /// A write came back that its reply cannot equal, whatever the reads show.
    void on_write_echo(const modbus::Request& request, std::uint8_t station) {
        if (teaches_echo_of_writes(request) && !repeats(station)) writes_echo_ = true;
    }
    /// True if the last such write came back: an adapter may echo long frames only, or writes.
    bool echoes_writes() const { return writes_echo_ == true; }
    /// True if the last such write was answered without it.
    bool echoes_no_writes() const { return writes_echo_ == false; }
    /// A request came back once more, behind its echo or its reply, which cannot equal it: two
    /// converters in a row, or one that returns what it sends when the panel has answered. `pdu`:
    /// of the request. Returns true if that tells.
    bool on_again(TimePoint now, ByteView pdu);
    /// True if one has lately, or this station repeats its requests: what equals a write may be its
    /// echo, whatever came before it.
    bool comes_again(TimePoint now, std::uint8_t station) const {
        return repeats(station) || (again_at_ && now <= *again_at_ + timing::kForgetHabit);
    }
    /// A read was answered before it came back, and not behind that. Three of one station in a row
    /// show an echo that comes late. True if that tells.
    bool on_answered_before(TimePoint now, const modbus::Request& read, std::uint8_t station) {
        before_ = station == before_of_ ? before_ + 1 : 1;
        before_of_ = station;
        return before_ >= kNow && on_again(now, read.pdu());
    }
    /// True if a reply may come before its echo, which then follows.
    bool comes_late(TimePoint now) const { return before_ >= kNow && comes_again(now, 0); }
    /// The read that was to detect the echo was inconclusive.
    void on_unclear();
    /// Its echo was heard, but no answer: where both are equal, it may have been the answer, and
    /// the line has no echo any more.
    void on_unanswered(const modbus::Request& request);
    /// A reply may have been an echo where none was known: learn again, unless configured.
    void on_suspected(TimePoint now, std::uint8_t station) {
        const bool is_known = mode_ != EchoMode::automatic || comes_again(now, station);
        if (!is_known && state_ == EchoState::absent) begin();
    }
    /// The echo differed: learn again, unless configured.
    void on_mismatch();

  private:
    /// True if this station repeats its requests, on a line without an echo.
    bool repeats(std::uint8_t station) const { return habit_ != 0 && station == habit_; }
    void begin();
    void on_heard_of(std::uint8_t station);
    void on_missed_by(std::uint8_t station);

    /// Replies in a row without any echo until an echo heard before counts as gone: bytes get lost
    /// now and then, and the next echo would confirm a write.
    static constexpr int kNoMore = 16;
    /// Echoes in a row until a line that has had none is believed to have one: a panel may repeat
    /// a request once. Until then a read goes before each write.
    static constexpr int kNow = 3;

    EchoMode mode_;
    EchoState state_;
    bool heard_ = false;  ///< an echo, since the device was opened
    int missed_ = 0;      ///< in a row
    int echoes_ = 0;      ///< in a row, on a line that has had none
    bool had_none_ = false;
    // An echo is the adapter's, of the requests to all stations. One panel that repeats its own has
    // a habit.
    std::uint8_t only_ = 0;     ///< the only station whose requests came back; 0: none or several
    bool several_ = false;      ///< those of several did
    int missed_by_it_ = 0;      ///< replies in a row
    int missed_by_others_ = 0;  ///< replies, since it is only_
    std::uint8_t habit_ = 0;    ///< this station repeats requests, the line has no echo
    std::optional<bool> writes_echo_;  ///< empty: no write has shown it since the device was opened
    std::uint8_t before_of_ = 0;       ///< the station that has answered before its echo
    int before_ = 0;                   ///< ... so often in a row
    std::optional<TimePoint> again_at_;  ///< when a request came back once more
};

/// Our own frames that come back long after they have left: from a repeater, or a radio. Each is
/// byte for byte what was sent and comes after the same time, while another master that asks the
/// same does so at any time. Pure.
class LateEcho {
  public:
    /// `echoes`: the line gives it back at once, unless it stalls.
    void on_sent(TimePoint now, ByteView adu, bool echoes = false) {
        next_ = (next_ + 1) % sent_.size();
        sent_[next_].at = now;
        sent_[next_].adu.assign(adu.begin(), adu.end());
        sent_[next_].missing = echoes;
    }
    /// The echo of the frame sent last has come, or what was made of it.
    void on_came() { sent_[next_].missing = false; }
    /// This frame was heard. True if it is one of ours, and three in a row have come so.
    bool on_heard(TimePoint now, ByteView adu);
    /// ... without learning from it. So it is if its echo is still missing.
    bool is_own(TimePoint now, ByteView adu) const {
        return is_missing(now, adu) ||
               (times_ >= kEnough && now <= heard_at_ + timing::kForgetHabit && delay_of(now, adu));
    }

  private:
    static constexpr int kEnough = 3;
    static constexpr std::size_t kSent = 16;
    struct Sent {
        TimePoint at{};
        Bytes adu{};
        bool missing = false;
    };
    bool is_missing(TimePoint now, ByteView adu) const;
    /// How long before it was sent: the most usual of the times that are possible.
    std::optional<Duration> delay_of(TimePoint now, ByteView adu) const;
    bool is_usual(Duration delay) const {
        return delay - delay_ <= timing::kReceiveMargin && delay_ - delay <= timing::kReceiveMargin;
    }

    std::array<Sent, kSent> sent_;
    std::size_t next_ = 0;
    Duration delay_{};
    int times_ = 0;  ///< in a row
    TimePoint heard_at_{};
};

}  // namespace panelgate::arbiter
