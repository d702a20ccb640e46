#include "refusal.hpp"

#include <cstdlib>
#include <string>

namespace panelgate::web {
namespace {

std::string detail_of(const bus::Refusal& refusal) {
    switch (refusal.rule) {
        case bus::Refusal::Rule::read_only:
            return "station '" + refusal.station + "' is read-only";
        case bus::Refusal::Rule::broadcast_over_read_only:
            return "a broadcast would write to station '" + refusal.station +
                   "', which is read-only";
        case bus::Refusal::Rule::guard:
            return "the profile of station '" + refusal.station + "' rules this request out";
    }
    std::abort();
}

}  // namespace

Problem problem_of(const bus::Refusal& refusal) { return problem(403, detail_of(refusal)); }

Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station) {
    if (const auto refusal = bus.refusal_of_write(station)) return problem_of(*refusal);
    return {};
}

}  // namespace panelgate::web
