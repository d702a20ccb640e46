#pragma once

#include <cstdint>
#include <utility>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::test {

/// One job alone, sent `attempts` times with this one.
inline arbiter::Group group_of(std::uint8_t station, const Bytes& pdu, int attempts = 1) {
    const modbus::Request request = request_of(pdu);
    return {.jobs = {{.ticket = 1, .station = station, .request = request, .client = 1}},
            .station = station,
            .request = request,
            .span = request.span(),
            .attempts = attempts};
}

/// An attempt that began in time to have left at `sent`, and was answered at `now`.
inline arbiter::Attempt answered(TimePoint sent, TimePoint now, arbiter::Group group,
                                 const Bytes& reply) {
    arbiter::Attempt::Timing timing =
        arbiter::Attempt::timing_of(arbiter::Settings{}, sent, 0, Duration::zero());
    timing.patience = timing.usual = 1min;
    const Bytes adu = modbus::encode_adu(group.station, reply);
    arbiter::Attempt attempt(std::move(group), timing, {});
    attempt.on_rx(now, adu, [](ByteView) { return false; });
    return attempt;
}

}  // namespace panelgate::test
