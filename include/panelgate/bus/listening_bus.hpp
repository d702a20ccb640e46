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
class ListeningBus final : public RecordedBus {
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
    void cancel(ClientId client) override;
    LineStatus status() const override;
    StationStatus station_status(std::uint8_t station) const override;
    std::optional<Refusal> write_refusal(std::uint8_t station) const override;
    LineReport report() const override;

  private:
    LineRecords& records() const override;
    void close();

    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::bus
