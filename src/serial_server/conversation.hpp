#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <variant>

#include "hearing.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/serial_server/settings.hpp"

namespace panelgate::serial_server {

/// A request to be answered by on_answer() with its ticket, unless withdrawn before.
struct Ask {
    std::uint64_t ticket = 0;
    modbus::SerialAdu adu;
};
/// A broadcast; it gets no answer.
struct ForwardBroadcast {
    modbus::SerialAdu adu;
};
/// Cancels the last Ask.
struct Withdraw {};
/// Bytes to send at once.
struct Send {
    Bytes bytes;
};
using Action = std::variant<Ask, ForwardBroadcast, Withdraw, Send>;

/// The slave side of a serial line: turns a master's frames into requests, one at a time, and
/// answers into correctly timed replies. A reply is sent after t3.5 of silence, and never once the
/// master has sent anything else: another frame, or enough bytes for a damaged one. An identical
/// frame is a retry and gets the first one's answer; so does a write that equals its answer and
/// comes again just behind that, which may be the answer's echo (P2). Frames of units not served
/// are parsed but not answered. Pure; a line::Drive machine.
class Conversation {
  public:
    Conversation(const Settings& settings, const Units& served);

    /// The device was opened or lost; a loss discards the request in progress.
    void on_line_up();
    void on_line_down();
    void on_rx(TimePoint now, ByteView bytes);
    /// `pdu` has 1 to 253 bytes; nullopt: no reply is sent. An answer to an unknown ticket is
    /// dropped.
    void on_answer(TimePoint now, std::uint64_t ticket, const std::optional<Bytes>& pdu);
    void on_deadline(TimePoint now);
    /// Serves these units from now on; a request in progress gets its answer.
    void serve(const Units& served);
    /// Accepts no further requests.
    void finish() { finishing_ = true; }
    /// True while a request awaits its answer or its reply's transmission.
    bool busy() const { return open_.has_value(); }

    std::optional<Action> poll_action();
    std::optional<TimePoint> next_deadline() const;

    /// Returns its own counters; SerialMaster sets the rest.
    const Counters& counters() const { return counters_; }

  private:
    struct Open {
        std::uint64_t ticket = 0;
        modbus::SerialAdu request;
        TimePoint ended{};  ///< time of its last byte
        std::optional<Bytes> reply{};
        bool is_exception = false;
    };
    /// The last reply, whose echo is taken out of what is heard (P8).
    struct Sent {
        Bytes frame;
        bool is_distinct = false;  ///< no request is the same
        TimePoint sure_until;      ///< what has come whole before is no master's
        TimePoint until;           ///< the echo may come until then
        bool disturbed = false;    ///< damage was heard since, which may have been the echo
    };
    /// A write whose answer is the same.
    struct Confirmed {
        modbus::SerialAdu request;
        Bytes reply;
        TimePoint until;  ///< its echo may come
        int again = 0;    ///< so often answered without the panel
    };
    void hear(TimePoint now, ByteView bytes);
    void take_frames();
    void on_frame(modbus::SerialAdu adu);
    void ask(modbus::SerialAdu adu);
    bool answer_again(const modbus::SerialAdu& adu);
    void supersede();
    void check_silence(TimePoint now);
    void judge_noise();
    bool begins_echo() const;
    bool is_echo(TimePoint now);
    void release(TimePoint now);
    void end_echo(TimePoint now);
    void watch_echo(const Bytes& sent);
    void try_send(TimePoint now);
    Duration pause() const;
    TimePoint may_send_at() const;
    void reset();

    Settings settings_;
    Units served_;
    Duration silence_;  ///< t3.5
    std::unique_ptr<Hearing> hearing_;
    std::deque<Action> actions_;
    std::optional<Open> open_;
    std::uint64_t next_ticket_ = 1;
    TimePoint last_rx_at_{};          ///< last byte received, own echoes excluded
    bool was_silent_ = true;          ///< silence since then, already handled
    std::size_t unframed_bytes_ = 0;  ///< bytes since the last good frame
    TimePoint tx_done_at_{};          ///< end of the last transmission
    std::optional<Sent> sent_;        ///< an echo may come
    Bytes kept_;                      ///< heard, and the beginning of that echo
    EchoState echo_ = EchoState::unknown;
    std::optional<Confirmed> confirmed_;  ///< if the master has sent nothing else since
    bool finishing_ = false;
    Counters counters_;
};

}  // namespace panelgate::serial_server
