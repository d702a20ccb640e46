#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/arbiter/settings.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/counters.hpp"
#include "panelgate/doctor/settings.hpp"
#include "panelgate/line/line.hpp"

namespace panelgate::bus {

/// The exception code that a request is answered with instead of being transmitted, or nothing.
using Guard = std::function<std::optional<std::uint8_t>(const modbus::Request&)>;

/// Something happened that others may want to know.
struct BusEvent {
    enum class Kind : std::uint8_t { line, station, transaction };
    Kind kind = Kind::line;
    std::string_view what;  ///< "up", "down"; "online", "late"…; the outcome of a transaction
    std::string why;        ///< of a line that is down, or that has a finding or lost one
    std::uint8_t station = 0;
    std::uint8_t function = 0;
    Duration took{};  ///< arrival to answer
};

struct Settings {
    std::string name;    ///< of the line
    std::string device;  ///< as configured
    arbiter::Settings arbiter;
    std::map<std::uint8_t, std::string> stations;  ///< names of those the configuration lists
    std::map<std::uint8_t, Guard> guards;          ///< of stations with `guard: true`
    std::function<void(const BusEvent&)> observe;  ///< may be empty; called from inside the bus
    std::size_t trace_frames = 2000;
    std::size_t trace_decisions = 500;
    doctor::Settings doctor;
};

/// Drives one line with one arbiter. Everything happens on the executor's one thread.
class Bus final : public BusClient {
  public:
    Bus(boost::asio::any_io_executor executor, Settings settings, std::unique_ptr<line::Line> line);
    /// Answers what is still open with Fault::cancelled.
    ~Bus() override;

    void start();
    /// Closes the line; what waits is answered at once (line_down, line_lost).
    void stop();

    void transact(Request request, AnswerHandler handler) override;
    void cancel(ClientId client) override;
    LineStatus status() const override;
    std::vector<ClientShare> clients() const override;
    StationStatus station_status(std::uint8_t station) const override;
    std::vector<TraceFrame> trace(std::size_t last) const override;
    std::vector<TraceDecision> decisions(std::size_t last) const override;
    void name_client(ClientId client, std::string name) override;

    LineReport report() const;
    /// Nothing waits, nothing is on the wire.
    bool idle() const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with completions that are still under way
};

}  // namespace panelgate::bus
