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
    RelayState state = RelayState::waiting;  ///< before the first transfer
    std::string why;                         ///< it fails: an outcome, or "exception 2"
    std::uint64_t reads = 0;
    std::uint64_t writes = 0;
    std::uint64_t repairs = 0;  ///< of these: after somebody else had written there
    std::uint64_t read_failures = 0;
    std::uint64_t write_failures = 0;
    std::optional<TimePoint> last_write;
};
/// "ok", "source failing: timeout"
std::string text_of(const RelayStatus& relay);

/// A relay with its ends found.
struct RelayRoute {
    Relay relay;
    bus::BusClient* from = nullptr;  ///< outlive the relays
    bus::BusClient* to = nullptr;
    std::string to_line{};  ///< the name of the target's line
    SharedMemory to_memory{};
    std::uint8_t from_station = 0;
    std::uint8_t to_station = 0;
    bool to_has_multiple = true;  ///< the target takes functions 15 and 16
};

/// Copies blocks between stations, over lines too. One request of each relay is open at a time, of
/// the class `poll`: a relay whose panel is silent keeps nobody waiting. It writes only what it has
/// read just before; with on_change what is new, and all again after a while and whenever the
/// target may have been restarted. What somebody else has written to the target is written over at
/// once, but once a second at most: nobody wins a fight. One thread; the clock outlives it.
class Relays {
  public:
    using Changed = std::function<void(const RelayStatus&)>;

    Relays(rt::Clock& clock, std::vector<RelayRoute> routes);
    ~Relays();
    Relays(const Relays&) = delete;
    Relays& operator=(const Relays&) = delete;

    /// From now on these; those that are the same go on as if nothing had happened.
    void apply(std::vector<RelayRoute> routes);

    /// Called when the state of a relay becomes another one.
    void on_state(Changed changed);
    void start();
    void stop();
    std::vector<RelayStatus> status() const;
    /// To be told what is written on a line (its name), from inside its bus; may outlive the
    /// relays.
    std::function<void(const std::string&, const bus::WriteEvent&)> write_listener() const;

  private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace panelgate::points
