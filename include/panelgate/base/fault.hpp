#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <string_view>

#include "panelgate/base/words.hpp"

namespace panelgate {

/// Why a request got no reply from its station. An exception from the station is a reply, not a
/// fault. to_exception() in modbus/function.hpp gives the Modbus code of each.
enum class Fault : std::uint8_t {
    denied,     ///< policy, or a function code no request may have; never transmitted
    malformed,  ///< the PDU contradicts its function, or its reply could not fit; never transmitted
    not_routed,  ///< no line has this unit or station; never transmitted
    busy,        ///< a queue is full; never transmitted
    expired,     ///< the deadline passed (or could not be met) before transmission
    line_down,   ///< the serial line is down; never transmitted
    line_lost,   ///< the line was lost after transmission: outcome unknown
    timeout,     ///< transmitted, no valid reply: outcome unknown
    damaged,     ///< transmitted, only damaged bytes received: outcome unknown
    offline,     ///< the station is known to be offline; never transmitted
    cancelled,   ///< the client disconnected, or the gateway is stopping
    wrong,       ///< transmitted, only good frames that do not answer it: outcome
                 ///< unknown
};
inline constexpr Fault kAllFaults[] = {Fault::denied,    Fault::malformed, Fault::not_routed,
                                       Fault::busy,      Fault::expired,   Fault::line_down,
                                       Fault::line_lost, Fault::timeout,   Fault::damaged,
                                       Fault::offline,   Fault::cancelled, Fault::wrong};

/// True if the station was heard, though its answer was not.
constexpr bool was_heard(Fault fault) { return fault == Fault::damaged || fault == Fault::wrong; }

/// Returns the label for logs and REST: "line_down".
std::string_view label(Fault fault);
/// Maps a fault to the outcome its client sees: several faults share one.
Outcome outcome_of(Fault fault);

template <class T>
using Result = boost::system::result<T, Fault>;

/// Called by Result::value() on a fault: reading an absent value is a broken invariant.
[[noreturn]] void throw_exception_from_error(Fault fault, const boost::source_location& where);

}  // namespace panelgate
