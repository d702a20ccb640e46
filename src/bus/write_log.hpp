#pragma once

#include <optional>
#include <string>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"

namespace panelgate::bus {

/// One line in the log, with what to do about it.
void log_event(const Settings& settings, const arbiter::StationEvent& event);

/// What the log is to say of a client's write when it has ended.
struct Deed {
    std::string client;
    std::string place;  ///< "holding-registers/100", or empty
    std::string pdu;    ///< hex
    /// The line's last one that was made for it, as in the trace; 0: none was.
    arbiter::Transaction transaction = 0;
};

/// Nothing for what changes nothing and for what no client wants (polls, relays).
std::optional<Deed> deed_of(const Request& request, const arbiter::ClientNames& names);
/// The same of a PDU that nobody was asked; its place is not told when it is no request.
std::optional<Deed> deed_of(ByteView pdu, ClientId client, const arbiter::ClientNames& names);
/// At info. What was transmitted is in the log each time, with its whole PDU (rt::log_each); what
/// was refused or given up before is told at a pace.
void log_deed(const Settings& settings, std::uint8_t station, const Deed& deed, Outcome outcome);

}  // namespace panelgate::bus
