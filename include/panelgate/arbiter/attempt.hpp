#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "panelgate/arbiter/echo.hpp"
#include "panelgate/arbiter/group.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

/// How an attempt ended that was not answered.
enum class Verdict : std::uint8_t {
    open,     ///< the attempt has not ended
    silent,   ///< no frame of the station until the timeout
    damaged,  ///< what came began like the reply, or like our own frame, and was neither (T3)
    wrong,    ///< a good frame of the station that does not answer the request (T13)
};

TransactionEnd end_of(Verdict verdict);
/// What its jobs are told if nothing better comes.
Fault fault_of(Verdict verdict);

/// When the bytes of one attempt are worth a look (P5): where bytes come one by one at the line's
/// rate, none decides before a header, an echo or the whole reply can be there. Pure.
class InputPace {
  public:
    /// `byte`: the time of one byte. `steady`: bytes arrive one by one, at the line's rate.
    InputPace(Duration byte, bool steady) : byte_(byte), steady_(steady) {}

    /// These bytes were read now.
    void on_read(TimePoint now, std::size_t bytes) {
        count_ += bytes;
        looked_ = now;
        const TimePoint began = now - count_ * byte_;
        // Bytes that came together, or after a pause, are no measure of the ones to come.
        steady_ = steady_ && (!began_ || began >= *began_ - slack());
        if (!began_ || began > *began_ + slack()) {
            began_ = now - bytes * byte_;
            count_ = bytes;
        }
    }
    /// All but the last `rest` bytes were our echo.
    void restart(TimePoint now, std::size_t rest) {
        count_ = rest;
        began_.reset();
        if (rest > 0) began_ = now - rest * byte_;
    }
    /// Bytes before this time decide nothing, if `missing` more are needed; empty: each may decide.
    /// A reply that was cut short is noticed before twice the time that it has taken.
    std::optional<TimePoint> busy_until(std::size_t missing) const {
        if (!steady_ || !began_ || missing == 0) return std::nullopt;
        const TimePoint whole = *began_ + (count_ + missing) * byte_;
        return std::min(whole, looked_ + std::max(timing::kLongestLook, looked_ - *began_));
    }

  private:
    Duration slack() const { return std::max(2 * byte_, timing::kReadingSlack); }

    Duration byte_;
    bool steady_;
    std::optional<TimePoint> began_;  ///< when the bytes that were counted began
    std::size_t count_ = 0;
    TimePoint looked_{};
};

/// One request on the wire: what is heard meanwhile, in frames, and the times. Who a frame is from
/// and what is done with it is decided elsewhere (judge.hpp). Damage does not end an attempt while
/// the reply may come (FRM-04); a silence inside a reply of known length is a hole (T4). Pure.
class Attempt {
  public:
    struct Timing {
        TimePoint started;    ///< handed over; the request leaves at once or after the line's lead
        TimePoint sent;       ///< last bit out, computed
        Duration patience{};  ///< from `sent`: without a sign of a reply until then, a timeout
        Duration end_of_frame{};  ///< silence that ends a frame of unknown length
        Duration hole{};          ///< longest silence inside a reply of known length
        Duration longest_reply{};
        Duration pause{};    ///< silence before this attempt
        Duration leaving{};  ///< from the first bit of the request to the last
        SerialFormat serial;
        bool paced = false;        ///< a real UART: the request has left at `sent` and not before
        bool steady = false;       ///< bytes arrive one by one, at the line's rate
        bool confirm_end = false;  ///< the driver will report when the last bit has left
    };
    /// Timing of a request of `size` bytes that is handed over now and starts after `lead`. The
    /// caller sets `patience`, `pause`, `confirm_end`, and `hole` where the station needs longer.
    static Timing timing_of(const Settings& line, TimePoint now, std::size_t size, Duration lead);

    Attempt(Group group, const Timing& timing, EchoFilter echo, const modbus::CrcOrders& orders);

    /// A frame that was heard, or the bytes between two frames.
    struct Heard {
        modbus::Unused part;
        bool answers = false;  ///< the frame answers the open request
    };

    // Input; what has come is then in take_heard().

    void on_rx(TimePoint now, ByteView bytes);
    /// What was heard since the last end is one frame, if `good`, or none (ASCII).
    void on_frame_end(bool good);
    /// What was heard since the last end breaks off (ASCII).
    void on_frame_cut();
    /// A character came that completes no byte (ASCII): what has begun goes on.
    void on_character(TimePoint now) {
        if (is_hearing()) last_byte_ = std::max(last_byte_, now);
    }
    /// A silence ends what has begun, where it has lasted long enough.
    void on_silence(TimePoint now);
    PoolVector<Heard> take_heard() { return std::exchange(heard_, {}); }

    // What was made of the frames

    /// The frame was our own, which the filter did not find.
    void on_echo() { echo_.on_whole_frame(); }
    /// The station has said something else, `refused`: an exception. `ends`: the attempt is over.
    void on_wrong(bool ends, bool refused) {
        refused_other_ = refused_other_ || (refused && !ends);
        instead_ = std::max(instead_, ends ? Instead::reply : Instead::unrelated);
    }
    /// The reply may be another master's: as if it had come damaged (T9).
    void on_contested() { instead_ = std::max(instead_, Instead::contested); }
    /// How it has ended by now, unless it was answered. Harmless if nothing is due.
    Verdict verdict(TimePoint now) const;
    TimePoint deadline() const;
    /// A broadcast is over when its last bit has left.
    bool is_broadcast() const { return group_.station == kBroadcast; }

    /// Bytes before this time decide nothing: until then, at the line's rate, comes the rest of a
    /// header, an echo or a reply that has begun. Empty: each byte may decide.
    std::optional<TimePoint> busy_until() const;

    bool wants_end(TimePoint now) const { return !end_confirmed_ && now >= timing_.sent; }
    TimePoint end_wanted_at() const { return end_confirmed_ ? TimePoint::max() : timing_.sent; }
    /// `left`: the time that the wire still needs for the request. Drivers and adapters start later
    /// than asked: the computed end is the earliest. Moves all times by a second at most.
    void on_end(TimePoint now, Duration left);

    /// True if a read that arrives while the request is still leaving can share it (P6). Not a
    /// retry: a reply to the first attempt may still come, and would be too old.
    bool can_join(TimePoint now, const Job& job) const;

    Group& group() { return group_; }
    const Group& group() const { return group_; }
    const Timing& timing() const { return timing_; }
    TimePoint give_up() const { return timing_.sent + timing_.patience; }
    const EchoFilter& echo() const { return echo_; }
    /// True if this reply PDU may be the echo of the request, of which nothing has come yet.
    bool is_own_echo(ByteView reply) const {
        return echo_.possible() && !echo_.complete() && echo_.is_own(reply) && !fragment_;
    }
    /// True if what came is the reply, with a few glitches around it at most: no echo.
    bool is_clean() const {
        return !disturbed_ && !fragment_ && !echo_.complete() && !echo_.mismatch() &&
               2 * damaged_bytes_.size() < echo_.frame().size();
    }
    /// From the end of the request to the start of a reply of `size` bytes whose last byte came
    /// now; 0 for a reply that began before.
    Duration waited(std::size_t size) const {
        return std::max(last_byte_ - timing_.sent - frame_time(timing_.serial, size), Duration{});
    }
    /// True if any byte was heard that is not the echo.
    bool heard() const { return has_heard_; }
    /// True if frames or bytes were heard that are no part of a reply.
    bool disturbed() const { return disturbed_; }
    TimePoint first_byte() const { return first_byte_; }
    TimePoint last_byte() const { return last_byte_; }
    /// The longest silence between two bytes of what was heard.
    Duration longest_pause() const { return longest_pause_; }
    /// True if what may have been the reply broke off before its full length.
    bool was_cut_off() const { return framer_.was_damaged() && !framer_.was_damaged_whole(); }
    /// True if the reply came without its first one to three bytes.
    bool lost_beginning() const { return framer_.ends_beheaded(damaged_bytes_); }
    /// True if the station sent an exception with another function's number.
    bool refused_other() const { return refused_other_; }
    /// Damaged bytes since the beginning (bounded).
    const Bytes& damaged_bytes() const { return damaged_bytes_; }
    /// Takes the bytes that the echo filter still buffers, and what has begun behind the reply.
    Bytes release_pending();

  private:
    void feed(ByteView bytes);
    void collect(std::optional<Bytes> reply);
    void add(modbus::Unused part, bool answers, bool in_front);
    bool has_delimiters() const { return timing_.serial.mode == SerialMode::ascii; }
    bool is_hearing() const { return framer_.has_pending() || echo_.pending(); }
    bool is_own_beginning() const;

    Group group_;
    Timing timing_;
    modbus::CrcOrders orders_;
    EchoFilter echo_;
    modbus::ReplyFramer framer_;
    InputPace pace_;
    PoolVector<Heard> heard_;
    Bytes damaged_bytes_;
    TimePoint computed_end_;
    TimePoint first_byte_;
    TimePoint last_byte_;
    Duration longest_pause_{};
    bool has_heard_ = false;
    bool disturbed_ = false;
    bool fragment_ = false;  ///< a part of the echo came in front
    bool refused_other_ = false;
    bool end_confirmed_ = true;
    /// What came instead of the reply.
    enum class Instead : std::uint8_t {
        nothing,
        contested,
        unrelated,  ///< of another function: the reply may still come
        reply       ///< of the function that was asked
    } instead_{};
};

}  // namespace panelgate::arbiter
