#pragma once

#include <cstdint>
#include <string>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::test {

/// One call of a BusScript, as it was recorded: what it takes to play it again.
struct BusStep {
    enum class Verb : std::uint8_t { submit, cancel, hear, run_for, line_down, line_up };
    Verb verb = Verb::run_for;
    std::uint8_t station = 0;  ///< submit
    Bytes bytes{};             ///< submit: the PDU; hear: what arrives
    arbiter::Client client = 0;
    PriorityClass priority = PriorityClass::read;
    Duration span{};  ///< run_for
};

/// The step as a line of a test.
inline std::string to_code(const BusStep& step) {
    const std::string bytes = "\"" + to_hex(step.bytes) + "\"_hex";
    switch (step.verb) {
        case BusStep::Verb::submit:
            return "bus.submit(" + std::to_string(step.station) + ", " + bytes + ", " +
                   std::to_string(step.client) + ");";
        case BusStep::Verb::cancel:
            return "bus.cancel(" + std::to_string(step.client) + ");";
        case BusStep::Verb::hear:
            return "bus.hear(" + bytes + ");";
        case BusStep::Verb::run_for:
            return "bus.run_for(" + std::to_string(step.span.count()) + "ns);";
        case BusStep::Verb::line_down:
            return "bus.line_down();";
        case BusStep::Verb::line_up:
            return "bus.line_up();";
    }
    return {};
}

}  // namespace panelgate::test
