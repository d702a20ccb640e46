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

/// How much of what a device says is read: replies to what was sent, and besides them no more than
/// a rate, but for a burst of kBurst at that rate. What is beyond stays with the kernel, and over
/// TCP with the sender. Pure.
class InputBudget {
  public:
    static constexpr Duration kBurst = 1s;
    static constexpr std::size_t kReply = 1024;  ///< bytes, more than any is

    /// `rate`: bytes a second, more than 0.
    explicit InputBudget(std::size_t rate) : rate_(rate) {}

    bool allows(TimePoint now) const { return paid_ <= now + kBurst; }
    void spend(TimePoint now, std::size_t bytes) {
        paid_ = std::max(paid_, now) + Duration(1s) * bytes / rate_;
    }
    void on_sent() { paid_ -= Duration(1s) * kReply / rate_; }
    /// Behind a burst half of it is waited for, so that reading goes in few large pieces.
    TimePoint next() const { return paid_ - kBurst / 2; }

  private:
    std::size_t rate_;
    TimePoint paid_{};
};

/// Says when a descriptor can be read or written, and can be told not to: an event loop's own watch
/// would wake for each byte, wanted or not. It stands between the two, as an epoll set of one.
/// Loss of the device is always said. One thread; the descriptor is its owner's.
class Readiness {
  public:
    /// `ready` is called from the loop: what it may read and write is then there, or was.
    Readiness(const boost::asio::any_io_executor& executor, std::function<void()> ready);
    ~Readiness();
    Readiness(const Readiness&) = delete;
    Readiness& operator=(const Readiness&) = delete;

    /// Watches for input from now on. An error text when it cannot; a plain file, which is always
    /// ready, is not watched.
    std::string watch(int fd);
    /// No longer: before the descriptor is closed.
    void forget();
    /// Does nothing while nothing is watched.
    void want_input(bool wanted);
    void want_output(bool wanted);

  private:
    void want(std::uint32_t events);
    void wait();

    boost::asio::posix::stream_descriptor epoll_;
    std::function<void()> ready_;
    int fd_ = -1;
    std::uint32_t events_ = 0;
    bool waiting_ = false;  ///< the loop watches the set
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

/// What lines on a non-blocking descriptor have in common: one read loop, writes in one piece,
/// never more than one frame that has not left, closing at the first sign of loss and opening again
/// with back-off. An opening counts as a success when it has brought a byte. How to open is the
/// derived class's: begin_open() ends, at once or later, in opened() or open_failed().
class DescriptorLine : public Line {
  public:
    DescriptorLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
                   Settings settings);

    void start(Events& events) final;
    void stop() final;
    void poll_input() final;
    void hold_input(bool hold) final {
        held_ = hold;
        want_input();
    }
    /// Resets the line when what was written before has not left (undelivered()).
    void write(ByteView bytes) override;
    bool undelivered() override { return !unsent_.empty(); }
    void reset(const std::string& why) final;
    const Counters& counters() final {
        counters_.uart = uart_errors();
        return counters_;
    }

  protected:
    virtual void begin_open() = 0;
    /// A pause before the next attempt begins.
    virtual void waiting() {}
    /// As ::read and ::write.
    virtual ssize_t get(std::span<std::uint8_t> room);
    virtual ssize_t put(ByteView bytes);
    /// stop() and a loss cancel an attempt that is under way.
    virtual void cancel_open() {}

    /// Closes the open device. `discard`: what has not left is never to leave.
    virtual void close_device(bool discard);
    /// Why write() resets the line.
    virtual std::string takes_nothing() const { return "the device takes nothing"; }
    /// A loss may go unseen until the device is there again: one look at once, whatever the opening
    /// has brought.
    virtual bool may_be_back() const { return false; }
    /// What the driver has counted, also while the device is closed.
    virtual std::optional<UartErrors> uart_errors() { return {}; }
    /// Something may be there now: tries, unless it is open or was tried a moment ago.
    void open_soon();

    /// Takes the descriptor over. An error text when it cannot be watched; it is closed then.
    std::string adopt(int fd);
    void opened();
    void open_failed(const std::string& why);
    /// The open device cannot be used any more.
    void lost(const std::string& why);
    /// For every opening from now on.
    void remember(const SerialFormat& format) { settings_.serial = format; }

    const Settings& settings() const { return settings_; }
    int fd() const { return fd_; }  ///< -1 while it is closed
    bool is_open() const { return fd_ >= 0; }
    /// Completions outlive the line: they ask here first.
    std::shared_ptr<bool> alive() const { return alive_; }
    rt::Clock& clock() const { return clock_; }

  private:
    void go_down(const std::string& why, bool look_at_once);
    void retry_later();
    void open_at(TimePoint when);
    void close(bool discard = false);
    void on_ready();
    void read_all();
    void let_rest(TimePoint until);
    void want_input() { readiness_.want_input(!held_ && !floods_); }
    void flush();

    Settings settings_;
    int fd_ = -1;
    Readiness readiness_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> next_opening_;
    std::unique_ptr<rt::Alarm> next_reading_;
    InputBudget budget_;
    bool held_ = false;
    bool floods_ = false;  ///< nothing is read until the budget allows it
    Reopen reopen_;
    Events* events_ = nullptr;
    std::shared_ptr<bool> alive_;
    Counters counters_;  ///< the driver's part is fetched when somebody asks
    Bytes unsent_;       ///< what the driver did not take at once; at most one frame
    std::uint64_t openings_ = 0;
    bool has_brought_ = false;  ///< this opening, a byte
    std::string last_error_;
    TimePoint next_try_{};  ///< open_soon() before this has to wait
};

}  // namespace panelgate::line
