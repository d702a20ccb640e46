#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/arbiter/client_names.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/outcome.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "request_counters.hpp"
#include "write_log.hpp"

namespace panelgate::bus {

/// Whoever watches is told.
void observe(const Settings& settings, const BusEvent& event);

/// Where a request's end goes, on lines that ask and on lines that listen: the metrics, the log of
/// writes, whoever watches. `settings` outlives it.
class Account {
  public:
    explicit Account(const Settings& settings);
    /// Those are others now.
    void apply() { counters_.apply(settings_.stations); }

    void add(std::uint8_t station, std::uint8_t function, const std::optional<Deed>& deed,
             Outcome outcome, Duration took);
    /// A face has refused it before it was a request. An empty PDU is nothing.
    void add_refused(std::uint8_t station, ByteView pdu, ClientId client,
                     const arbiter::ClientNames& names);

    RequestCounters& counters() { return counters_; }
    const RequestCounters& counters() const { return counters_; }

  private:
    const Settings& settings_;
    RequestCounters counters_;
};

}  // namespace panelgate::bus
