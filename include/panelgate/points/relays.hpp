#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::points {

enum class RelayState : std::uint8_t { waiting, ok, source_failing, target_failing };
std::string_view label(RelayState state);

struct RelayStatus {
    std::string name;
    RelayState state = RelayState::waiting;  ///< `waiting` before the first transfer
    std::string why;                         ///< cause of a failure: an outcome, or "exception 2"
    std::uint64_t reads = 0;
    std::uint64_t writes = 0;
    std::uint64_t repairs = 0;  ///< of these: after another client had written there
    std::uint64_t read_failures = 0;
    std::uint64_t write_failures = 0;
    std::optional<TimePoint> last_write;
};
/// Returns "ok", "source failing: timeout" and the like.
std::string text_of(const RelayStatus& relay);

/// A relay with its endpoints resolved.
struct RelayRoute {
    Relay relay;
    bus::BusClient* from = nullptr;  ///< both buses outlive the relays
    bus::BusClient* to = nullptr;
    std::string to_line{};  ///< name of the target's line
    SharedMemory to_memory{};
    std::uint8_t from_station = 0;
    std::uint8_t to_station = 0;
    bool to_has_multiple = true;  ///< the target supports functions 15 and 16
};

/// Copies blocks between stations, also across lines. Each relay has one open request of class
/// `poll`, so a silent panel delays only its own relays. Writes only what was just read; with
/// on_change only changes, and everything after `refresh` and whenever the target may have
/// restarted. Writes by other clients to the target are overwritten, at most once a second.
/// Single-threaded; the clock outlives it.
class Relays {
  public:
    using Changed = std::function<void(const RelayStatus&)>;

    Relays(rt::Clock& clock, std::vector<RelayRoute> routes);
    ~Relays();
    Relays(const Relays&) = delete;
    Relays& operator=(const Relays&) = delete;

    /// Replaces the relays. Unchanged relays continue.
    void apply(std::vector<RelayRoute> routes);

    /// Sets the function called when a relay's state changes.
    void on_state(Changed changed);
    void start();
    void stop();
    std::vector<RelayStatus> status() const;
    /// Returns the function to call from inside a bus with each write on a line (by its name); it
    /// may outlive the relays.
    std::function<void(const std::string&, const bus::WriteEvent&)> write_listener() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::points
