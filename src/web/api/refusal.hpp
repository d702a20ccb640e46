#pragma once

#include <cstdint>
#include <string>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a client is told of a request that is refused here: 403 by access, 422 by a guard. The
/// member "rule" is label(Rule).
Problem problem_of(const bus::Refusal& refusal);
/// 422 of what the profile rules out before it is a request: nothing was sent.
Problem ruled_out(bus::Rule rule, std::string detail);
/// Would the bus take a write to this station, or (0) to everybody on its line? 403 when it would
/// not.
Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station);
/// What has become of a write to this station before it is asked: where nobody may write, that is
/// told before anything else that is wrong. One that nothing is wrong with is the bus's to refuse,
/// which counts and tells it.
template <class T>
Parsed<T> unless_refused(Parsed<T> planned, const bus::BusClient& bus, std::uint8_t station) {
    if (planned) return planned;
    if (const auto allowed = check_may_write(bus, station); !allowed) return allowed.error();
    return planned;
}

}  // namespace panelgate::web
