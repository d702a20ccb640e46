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
