#pragma once

#include <cstdint>
#include <utility>

#include "panelgate/arbiter/attempt.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/time.hpp"
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

/// Times of a request of `size` bytes that is handed over at `now` and waited for 500 ms.
inline arbiter::Attempt::Timing timing_of(TimePoint now, std::size_t size,
                                          const arbiter::Settings& line = {}) {
    arbiter::Attempt::Timing timing =
        arbiter::Attempt::timing_of(line, now, size, Duration::zero());
    timing.patience = 500ms;
    return timing;
}

/// An attempt whose request had left at `sent`, and which has heard `reply` at `now`.
inline arbiter::Attempt answered(TimePoint sent, TimePoint now, arbiter::Group group,
                                 const Bytes& reply) {
    const Bytes adu = modbus::encode_adu(group.station, reply);
    arbiter::Attempt attempt(std::move(group), timing_of(sent, 0), {}, {});
    attempt.on_rx(now, adu);
    return attempt;
}

}  // namespace panelgate::test
