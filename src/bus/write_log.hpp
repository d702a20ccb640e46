#pragma once

#include <optional>
#include <string>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"

namespace panelgate::bus {

/// Logs a station event in one line, with a hint.
void log_event(const Settings& settings, const arbiter::StationEvent& event);

/// What is logged of a client's write when it ends.
struct WriteRecord {
    std::string client;
    std::string place;  ///< "holding-registers/100", or empty
    std::string pdu;    ///< hex
    /// The last transaction made for it, as in the trace; 0: none.
    arbiter::Transaction transaction = 0;
};

/// Returns nullopt for reads and for requests without a client (polls, relays).
std::optional<WriteRecord> write_record_of(const Request& request,
                                           const arbiter::ClientNames& names);
/// The same for a PDU that was never submitted; without `place` if it is not a valid request.
std::optional<WriteRecord> write_record_of(ByteView pdu, ClientId client,
                                           const arbiter::ClientNames& names);
/// Logs at info. Every transmitted write is logged with its whole PDU (rt::log_each); writes that
/// were refused or abandoned before are rate-limited.
void log_write(const Settings& settings, std::uint8_t station, const WriteRecord& write,
               Outcome outcome);

}  // namespace panelgate::bus
