#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/settings.hpp"

namespace panelgate::rt {

/// A thread for long, pure computations that would block the loop, on values no other thread uses.
/// Jobs run one after the other. Owned by the loop's thread.
class Worker {
  public:
    explicit Worker(boost::asio::any_io_executor executor);
    /// Waits for the running job; drops queued ones.
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Runs `work` in the thread (it must not throw), then `done` from the loop, which keeps
    /// running until then. `done` may still be called after the worker's end.
    void run(std::function<void()> work, std::function<void()> done);

  private:
    struct Pool;
    boost::asio::any_io_executor executor_;
    std::unique_ptr<Pool> pool_;
};

/// Raises the soft limit of open files to the hard limit. Returns the resulting limit.
std::size_t raise_descriptor_limit();

/// Divides `available` descriptors: all get what they ask for, or all the same part of it, but
/// never less than one.
std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked);

/// Applies `settings` to the calling thread (and all memory), and asks for punctual sleeps, which
/// need no privilege. Returns a line per refused setting: which, why, and what would grant it.
std::vector<std::string> be_punctual(const RealtimeSettings& settings);

/// Measures loop lag: a periodic alarm records how late it fires. A blocked loop misses ticks and
/// records one late tick for them.
class LoopLag {
  public:
    static constexpr Duration kEvery = 1s;  ///< each is a wake-up, also of an idle gateway

    /// The clock outlives it.
    explicit LoopLag(Clock& clock) : clock_(clock), alarm_(clock.make_alarm()) {}
    LoopLag(const LoopLag&) = delete;
    LoopLag& operator=(const LoopLag&) = delete;

    void start();
    void stop() { alarm_->cancel(); }
    /// Lag in seconds, one sample a second.
    const Histogram& seconds() const { return seconds_; }

  private:
    void arm(TimePoint due);

    Clock& clock_;
    std::unique_ptr<Alarm> alarm_;
    Histogram seconds_;
};

/// Argument of sched_getattr(2) and sched_setattr(2), first version: glibc has no declaration, and
/// <linux/sched/types.h> clashes with <sched.h>.
struct SchedAttr {
    std::uint32_t size = sizeof(SchedAttr);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0;  ///< ns; for SCHED_OTHER the time slice
    std::uint64_t deadline = 0;
    std::uint64_t period = 0;
};

/// Environment that systemd passes to a service; empty: not set.
struct ServiceEnvironment {
    std::string notify_socket{};  ///< NOTIFY_SOCKET: a path, or an abstract name after '@'
    std::string watchdog_usec{};  ///< WATCHDOG_USEC
    std::string watchdog_pid{};   ///< WATCHDOG_PID: process that the watchdog is for
};

ServiceEnvironment service_environment();

/// Interval of watchdog notifications: half its timeout (sd_watchdog_enabled(3)). std::nullopt if
/// there is no watchdog, or it is for another process.
std::optional<Duration> watchdog_interval(const ServiceEnvironment& environment,
                                          std::int64_t own_pid);

/// Reports the service's state to systemd with sd_notify(3) datagrams, without ever blocking;
/// without NOTIFY_SOCKET it sends nothing and arms no alarm. The watchdog is fed from the loop, so
/// that a hung loop ends the service. Single-threaded; the clock outlives it.
class ServiceManager {
  public:
    static constexpr Duration kLook = 2s;       ///< how often the status is checked
    static constexpr Duration kAgain = 100ms;   ///< pause before an untaken message is sent again
    static constexpr std::size_t kWaiting = 8;  ///< state changes queued for that, at most

    explicit ServiceManager(Clock& clock,
                            const ServiceEnvironment& environment = service_environment());
    ~ServiceManager();
    ServiceManager(const ServiceManager&) = delete;
    ServiceManager& operator=(const ServiceManager&) = delete;

    /// Reports READY, after the start or after a reload, good or bad. `status` returns one line for
    /// users (`systemctl status`), now and periodically, for as long as this lives.
    void ready(std::function<std::string()> status);
    void ready();  ///< with the previous `status`
    /// Reports RELOADING; ready() must follow, whatever the result.
    void reloading();
    /// Reports STOPPING, which takes at most `patience`.
    void stopping(Duration patience);

  private:
    enum class Sent : std::uint8_t { taken, not_now, never };

    Sent send(std::string_view message);
    void say(std::string message);
    void hand_over();
    void look();
    void feed_watchdog();
    std::string status_line() const;

    Clock& clock_;
    std::unique_ptr<Alarm> again_;
    std::unique_ptr<Alarm> look_;
    std::unique_ptr<Alarm> watchdog_;
    std::optional<Duration> feed_interval_;
    int socket_ = -1;      ///< -1: no notifications
    std::string address_;  ///< bytes of its sockaddr_un
    std::deque<std::string> waiting_;
    std::function<std::string()> status_;
    std::string told_;  ///< the status last sent
};

}  // namespace panelgate::rt
