#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// A line with another master (`mode: listen`): matches, counts and records what it hears and
/// reports it to the observer; sends nothing. Refuses every request (Rule::listening). Not
/// thread-safe: use it only on the executor's thread.
class ListeningBus final : public LineBus {
  public:
    /// Of `settings.arbiter` only the serial format, the reply hole and `offline.after` are used.
    /// The executor's loop and the clock outlive the bus.
    ListeningBus(boost::asio::any_io_executor executor, rt::Clock& clock, Settings settings,
                 std::unique_ptr<line::Line> line);
    ~ListeningBus() override;

    void start() override;
    void stop() override;
    void apply(Settings settings, std::unique_ptr<line::Line> line,
               std::shared_ptr<void> far_end) override;

    void transact(Request request, AnswerHandler handler) override;
    void count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) override;
    void count_denied(std::string_view rule) override;
    void cancel(ClientId client) override;
    LineStatus status() const override;
    StationStatus station_status(std::uint8_t station) const override;
    std::optional<Refusal> write_refusal(std::uint8_t station) const override;
    TracePart trace(std::size_t last) const override;
    TracePart trace_since(std::uint64_t sequence, std::size_t most) const override;
    std::vector<IncidentHead> incidents() const override;
    std::optional<Incident> incident(std::uint64_t id) override;
    bool tells(const WhoRef& who, std::uint8_t station) const override;
    void name_client(ClientId client, std::string name) override;
    LineReport report() const override;

  private:
    void close();

    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::bus
