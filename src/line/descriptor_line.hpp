#pragma once

#include <sys/types.h>
#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/line/reopen.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::line {

/// Limits the input of a device: replies to what was sent, and besides them no more than a rate,
/// with bursts of kBurst. The excess stays in the kernel, and over TCP with the sender. Pure.
class InputBudget {
  public:
    static constexpr Duration kBurst = 1s;
    static constexpr std::size_t kReply = 1024;  ///< bytes, more than any reply has

    /// `rate`: bytes per second, above 0.
    explicit InputBudget(std::size_t rate) : rate_(rate) {}

    bool allows(TimePoint now) const { return paid_ <= now + kBurst; }
    void spend(TimePoint now, std::size_t bytes) {
        paid_ = std::max(paid_, now) + Duration(1s) * bytes / rate_;
    }
    void on_sent() { paid_ -= Duration(1s) * kReply / rate_; }
    /// When to read again: after half a burst, so that reads are few and large.
    TimePoint next() const { return paid_ - kBurst / 2; }

  private:
    std::size_t rate_;
    TimePoint paid_{};
};

/// Reports when a descriptor can be read or written, and can be paused: an event loop's own watch
/// would wake for each byte. It puts an epoll set of one descriptor in between. Loss of the device
/// is always reported. Single-threaded; the owner keeps the descriptor.
class Readiness {
  public:
    /// `ready` is called from the loop when the descriptor may be ready.
    Readiness(const boost::asio::any_io_executor& executor, std::function<void()> ready);
    ~Readiness();
    Readiness(const Readiness&) = delete;
    Readiness& operator=(const Readiness&) = delete;

    /// Starts watching for input. Returns an error text if it cannot; a plain file, which is always
    /// ready, is not watched.
    std::string watch(int fd);
    /// Stops watching; called before the descriptor is closed.
    void forget();
    /// The same, and gives back what watch() needs.
    void end();
    /// No effect while nothing is watched.
    void want_input(bool wanted);
    void want_output(bool wanted);

  private:
    void want(std::uint32_t events);
    void wait();

    boost::asio::posix::stream_descriptor epoll_;
    std::function<void()> ready_;
    int fd_ = -1;
    std::uint32_t events_ = 0;
    bool waiting_ = false;  ///< the loop waits for the set
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

/// Base of lines on a non-blocking descriptor: one read loop, writes in one piece, never more than
/// one unsent frame, closing at the first sign of loss and reopening with back-off. An opening
/// counts as a success once a byte was received. The derived class opens: begin_open() ends, at
/// once or later, in opened() or open_failed().
class DescriptorLine : public Line {
  public:
    DescriptorLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
                   Settings settings);

    void start(Events& events) final;
    void stop() final;
    void poll_input() final;
    void defer_input(bool hold) final {
        held_ = hold;
        want_input();
    }
    /// Resets the line if the previous frame has not left (undelivered()).
    void write(ByteView bytes) override;
    bool undelivered() override { return !unsent_.empty(); }
    void reset(const std::string& why) final;
    const Counters& counters() final {
        counters_.uart = uart_errors();
        return counters_;
    }

  protected:
    virtual void begin_open() = 0;
    /// Called when the pause before the next attempt begins.
    virtual void waiting() {}
    /// Like ::read and ::write.
    virtual ssize_t get(std::span<std::uint8_t> room);
    virtual ssize_t put(ByteView bytes);
    /// Cancels an attempt that is in progress.
    virtual void cancel_open() {}

    /// Closes the open device. `discard`: unsent bytes must never be sent.
    virtual void close_device(bool discard);
    /// Why write() resets the line, for its log.
    virtual std::string blocked_reason() const { return "the device takes nothing"; }
    /// True if the device may be back before its loss is noticed: then one attempt to reopen at
    /// once, even if this opening received nothing.
    virtual bool may_have_returned() const { return false; }
    /// Returns the driver's counters, also while the device is closed.
    virtual std::optional<UartErrors> uart_errors() { return {}; }
    /// The open device is lost; `unanswered`: bytes were sent, and none came back.
    virtual void was_lost(bool unanswered) { static_cast<void>(unanswered); }
    /// Whether this connection began with telnet's negotiation (Counters::telnet).
    void set_telnet(bool telnet) { counters_.telnet = telnet; }
    /// Tries to open the device soon, unless it is open.
    void open_soon();

    /// Takes ownership of the descriptor. Returns an error text if it cannot be watched; it is
    /// closed then.
    std::string adopt(int fd);
    void opened();
    void open_failed(const std::string& why);
    /// Reports that the open device cannot be used any more.
    void lost(const std::string& why);
    /// Sets the format of all later openings.
    void remember(const SerialFormat& format) { settings_.serial = format; }

    const Settings& settings() const { return settings_; }
    int fd() const { return fd_; }  ///< -1 while closed
    bool is_open() const { return fd_ >= 0; }
    /// False after stop(): completions may outlive the line and check this first.
    std::shared_ptr<bool> alive() const { return alive_; }
    rt::Clock& clock() const { return clock_; }

  private:
    void go_down(const std::string& why, bool retry_at_once);
    void retry_later();
    void open_at(TimePoint when);
    void close(bool discard = false);
    void on_ready();
    void read_all();
    void pause_reading(TimePoint until);
    void want_input() { readiness_.want_input(!held_ && !throttled_); }
    void flush();

    Settings settings_;
    int fd_ = -1;
    Readiness readiness_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> next_opening_;
    std::unique_ptr<rt::Alarm> next_reading_;
    InputBudget budget_;
    bool held_ = false;
    bool throttled_ = false;  ///< reading is paused until the budget allows it
    Reopen reopen_;
    Events* events_ = nullptr;
    std::shared_ptr<bool> alive_;
    Counters counters_;  ///< the driver's part is read on demand
    Bytes unsent_;       ///< not yet taken by the driver; at most one frame
    std::uint64_t openings_ = 0;
    /// This opening has received an answer: bytes behind what was sent, or, where nothing is, later
    /// than any greeting of a server that closes at once.
    bool has_received_ = false;
    bool has_sent_ = false;  ///< in this opening
    TimePoint opened_at_{};
    std::string last_error_;
    TimePoint next_try_{};  ///< open_soon() waits until then
};

}  // namespace panelgate::line
