#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <string_view>

#include "panelgate/base/words.hpp"

namespace panelgate {

/// Why a request has no reply from its station. A station's own exception is not a fault: it is an
/// answer. The Modbus code of each is in modbus/exception.
enum class Fault : std::uint8_t {
    denied,     ///< policy, or a function that no request may carry; never transmitted
    malformed,  ///< the PDU contradicts its function, or its reply could not fit; never transmitted
    not_routed,  ///< nobody has this unit or station; never transmitted
    busy,        ///< a queue is full; never transmitted
    expired,     ///< the deadline passed (or could not be met) before transmission
    line_down,   ///< the serial line is not there; never transmitted
    line_lost,   ///< the line went away after the request was transmitted: outcome unknown
    timeout,     ///< transmitted, and nothing valid came back: outcome unknown
    damaged,     ///< transmitted, and only damaged bytes came back: outcome unknown
    offline,     ///< the station is known to be silent; never transmitted
    cancelled,   ///< the client went away, or the gateway is stopping
};
inline constexpr Fault kAllFaults[] = {Fault::denied,    Fault::malformed, Fault::not_routed,
                                       Fault::busy,      Fault::expired,   Fault::line_down,
                                       Fault::line_lost, Fault::timeout,   Fault::damaged,
                                       Fault::offline,   Fault::cancelled};

/// The word for logs and REST: "line_down".
std::string_view label(Fault fault);
/// How a request with this fault has ended: several faults are the same to a client.
Outcome outcome_of(Fault fault);

template <class T>
using Result = boost::system::result<T, Fault>;

/// Called by Result::value() on a fault: asking for a value that is not there is a broken
/// invariant.
[[noreturn]] void throw_exception_from_error(Fault fault, const boost::source_location& where);

}  // namespace panelgate
