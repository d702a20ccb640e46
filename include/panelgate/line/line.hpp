#pragma once

#include <optional>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/line/counters.hpp"

namespace panelgate::line {

/// A stream of bytes to a serial line: the byte seam. It opens by itself after start(), says when
/// it is up or down, and keeps trying to open while it is down. One thread. Events may come from
/// inside poll_input() and write(); after stop() none come.
class Line {
  public:
    /// Who listens; it outlives the line.
    class Events {
      public:
        virtual ~Events() = default;
        virtual void on_up() = 0;
        /// `why` is for people: "cannot open /dev/ttyUSB0: No such file or directory".
        virtual void on_down(const std::string& why) = 0;
        virtual void on_bytes(ByteView bytes) = 0;
    };

    virtual ~Line() = default;
    virtual void start(Events& events) = 0;
    virtual void stop() = 0;
    /// Hands all bytes that have arrived already to on_bytes, now.
    virtual void poll_input() = 0;
    /// Input waits for poll_input(), which somebody will call, until this is taken back: it need
    /// not wake anybody. A line that cannot keep it hands it over all the same.
    virtual void hold_input(bool hold) { static_cast<void>(hold); }
    /// Sends in one piece; nothing blocks. On failure the line goes down (on_down).
    virtual void write(ByteView bytes) = 0;
    virtual const Counters& counters() = 0;
    /// Other characters from now on, while it is up and nothing is being sent. False when this end
    /// does not decide that (RTU over TCP), or the device refuses (then it is down).
    virtual bool set_format(const SerialFormat& format) {
        static_cast<void>(format);
        return false;
    }
    /// Between write() and the first bit: what switching to sending takes.
    virtual Duration lead() const { return {}; }
    /// How long the wire still needs for what was written, as far as the driver tells. Nothing from
    /// a line that cannot tell at all: who writes has to go by its own arithmetic.
    virtual std::optional<Duration> unsent() { return std::nullopt; }
    /// The far end has not taken what was written, although its time is over: it is not to be left
    /// there, to be executed whenever the way is free again.
    virtual bool undelivered() { return false; }
    /// Throws away what has not left yet, closes, and opens again with back-off. The line goes down
    /// (on_down, from inside). `why` is for people.
    virtual void reset(const std::string& why) { static_cast<void>(why); }
    /// What the way to the wire and back adds to every answer, now: nothing for a device here.
    virtual Duration latency() { return {}; }
};

}  // namespace panelgate::line
