#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <variant>

#include "hearing.hpp"
#include "panelgate/arbiter/echo.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/serial_server/counters.hpp"
#include "panelgate/serial_server/settings.hpp"

namespace panelgate::serial_server {

/// A request that wants an answer: on_answer() with its ticket, unless it is withdrawn before.
struct Ask {
    std::uint64_t ticket = 0;
    modbus::SerialAdu adu;
};
/// A request to everybody, which nobody answers.
struct Spread {
    modbus::SerialAdu adu;
};
/// The request that was asked last is not wanted any more.
struct Withdraw {};
/// Bytes to be sent at once.
struct Send {
    Bytes bytes;
};
using Action = std::variant<Ask, Spread, Withdraw, Send>;

/// The slave's side of a serial line: what a master says becomes requests, one at a time, and the
/// answers replies at the right moment. A reply leaves when the line has been silent for t3.5, and
/// never once the master has said anything else: another frame, or bytes enough to be one that came
/// damaged. The same frame again is a retry, and gets the answer of the first. Units that are not
/// served are heard and not answered. Pure; a line::Drive machine.
class Conversation {
  public:
    Conversation(const Settings& settings, const Units& served);

    /// The device is open, or is no more: what was going on is over.
    void on_line_up();
    void on_line_down();
    void on_rx(TimePoint now, ByteView bytes);
    /// `pdu` of 1 to 253 bytes; nothing: it is told by silence. What nobody waits for is dropped.
    void on_answer(TimePoint now, std::uint64_t ticket, const std::optional<Bytes>& pdu);
    void on_deadline(TimePoint now);
    /// From now on nothing is asked.
    void finish() { finishing_ = true; }
    /// Somebody waits for an answer, or for it to be sent.
    bool busy() const { return open_.has_value(); }

    std::optional<Action> poll_action();
    std::optional<TimePoint> next_deadline() const;

    /// What it counts; the rest is its user's.
    const Counters& counters() const { return counters_; }

  private:
    struct Open {
        std::uint64_t ticket = 0;
        modbus::SerialAdu request;
        TimePoint ended{};  ///< its last byte
        std::optional<Bytes> reply{};
        bool is_exception = false;
    };
    void hear(TimePoint now, ByteView bytes);
    void take_frames();
    void on_frame(modbus::SerialAdu adu);
    void ask(modbus::SerialAdu adu);
    void supersede();
    void look_at_silence(TimePoint now);
    void judge_noise();
    void end_echo(TimePoint now);
    void watch_echo(TimePoint now, const Bytes& sent);
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
    TimePoint heard_at_{};         ///< last byte of anybody else
    bool was_silent_ = true;       ///< since, and that has been looked at
    std::size_t unexplained_ = 0;  ///< bytes since the last good frame
    TimePoint sent_by_{};          ///< what was sent last has left
    arbiter::EchoFilter echo_;     ///< of it
    std::optional<TimePoint> echo_until_;
    bool echo_teaches_ = false;  ///< its echo could be nothing else
    bool disturbed_ = false;     ///< there was noise since it was sent
    EchoState echo_state_ = EchoState::unknown;
    bool finishing_ = false;
    Counters counters_;
};

}  // namespace panelgate::serial_server
