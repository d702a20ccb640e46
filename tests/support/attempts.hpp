#pragma once

#include <cstdint>
#include <utility>

#include "panelgate/arbiter/attempt/attempt.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::test {

/// A pty with the default settings.
inline arbiter::Attempt::Wire default_wire() {
    return {
        .serial = {}, .end_of_frame = 20ms, .reply_hole = 60ms, .paced = false, .may_stall = false};
}

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
        arbiter::Attempt::timing_of(default_wire(), sent, 0, Duration::zero());
    timing.patience = timing.usual = 1min;
    const Bytes adu = modbus::encode_adu(group.station, reply);
    arbiter::Attempt attempt(std::move(group), timing, {});
    attempt.on_rx(now, adu, [](ByteView) { return false; });
    return attempt;
}

}  // namespace panelgate::test
