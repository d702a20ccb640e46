#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::rt {

/// What systemd tells a program that it starts, as it stands in the environment; empty: not told.
struct ServiceEnvironment {
    std::string notify_socket{};  ///< NOTIFY_SOCKET: a path, or an abstract name behind '@'
    std::string watchdog_usec{};  ///< WATCHDOG_USEC
    std::string watchdog_pid{};   ///< WATCHDOG_PID: for whom the watchdog is meant
};

ServiceEnvironment service_environment();

/// How often the watchdog is told: half of what it waits (sd_watchdog_enabled(3)). Nothing where
/// there is none, or where it is meant for another process.
std::optional<Duration> watchdog_interval(const ServiceEnvironment& environment,
                                          std::int64_t own_pid);

/// Tells systemd how the service does, by the datagrams of sd_notify(3): nobody waits for it, and
/// without NOTIFY_SOCKET nothing is told and no alarm is armed. The watchdog is told from the loop,
/// so that a loop that hangs ends the service. One thread; the clock outlives it.
class ServiceManager {
  public:
    static constexpr Duration kLook = 2s;       ///< how often the status is looked at
    static constexpr Duration kAgain = 100ms;   ///< when what it did not take is sent again
    static constexpr std::size_t kWaiting = 8;  ///< changes of state that wait for that, at most

    explicit ServiceManager(Clock& clock,
                            const ServiceEnvironment& environment = service_environment());
    ~ServiceManager();
    ServiceManager(const ServiceManager&) = delete;
    ServiceManager& operator=(const ServiceManager&) = delete;

    /// It serves, from the start on or after a reload, good or bad. `status` is asked for one line
    /// for people (`systemctl status`), now and from time to time, for as long as this lives.
    void ready(std::function<std::string()> status);
    void ready();  ///< the same with the status of before
    /// It takes another configuration; ready() follows, whatever comes of it.
    void reloading();
    /// It ends, and needs so long at most.
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
    std::optional<Duration> feed_every_;
    int socket_ = -1;      ///< -1: nobody is told
    std::string address_;  ///< its bytes
    std::deque<std::string> waiting_;
    std::function<std::string()> status_;
    std::string told_;  ///< the status that systemd knows
};

}  // namespace panelgate::rt
