#include "refusal.hpp"

#include <cstdlib>
#include <string>
#include <utility>

namespace panelgate::web {
namespace {

std::string detail_of(const bus::Refusal& refusal) {
    const std::string station = "station '" + refusal.station + "'";
    switch (refusal.rule) {
        case bus::Rule::read_only:
            return station + " is read-only";
        case bus::Rule::broadcast_over_read_only:
            return "a broadcast would write to " + station + ", which is read-only";
        case bus::Rule::listening:
            return "line '" + refusal.why +
                   "' has another master: it is only listened to (mode: listen); its points tell "
                   "what passed by";
        case bus::Rule::function:
        case bus::Rule::quantity:
        case bus::Rule::range:
        case bus::Rule::write_protected:
            return "the guard of " + station + " refuses it" +
                   (refusal.why.empty() ? "" : ": " + refusal.why);
    }
    std::abort();
}

Problem refused(unsigned status, bus::Rule rule, std::string detail) {
    Problem made = problem(status, std::move(detail), "refused");
    made.extensions["rule"] = label(rule);
    made.extensions["transmitted"] = false;
    return made;
}

unsigned status_of(bus::Rule rule) {
    if (rule == bus::Rule::listening) return 409;
    return bus::is_access(rule) ? 403 : 422;
}

}  // namespace

Problem problem_of(const bus::Refusal& refusal) {
    Problem made = refused(status_of(refusal.rule), refusal.rule,
                           "refused here, nothing was sent: " + detail_of(refusal));
    made.extensions["modbus_exception"] = static_cast<std::uint8_t>(refusal.code);
    return made;
}

Problem ruled_out(bus::Rule rule, std::string detail) {
    return refused(422, rule, std::move(detail));
}

Parsed<void> check_may_write(const bus::BusClient& bus, std::uint8_t station) {
    if (const auto refusal = bus.refusal_of_write(station)) return problem_of(*refusal);
    return {};
}

}  // namespace panelgate::web
