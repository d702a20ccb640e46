#include "panelgate/base/fault.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace panelgate {

std::string_view label(Fault fault) {
    switch (fault) {
        case Fault::denied:
            return "denied";
        case Fault::malformed:
            return "malformed";
        case Fault::not_routed:
            return "not_routed";
        case Fault::busy:
            return "busy";
        case Fault::expired:
            return "expired";
        case Fault::line_down:
            return "line_down";
        case Fault::line_lost:
            return "line_lost";
        case Fault::timeout:
            return "timeout";
        case Fault::damaged:
            return "damaged";
        case Fault::offline:
            return "offline";
        case Fault::cancelled:
            return "cancelled";
        case Fault::wrong:
            return "wrong";
    }
    std::abort();
}

Outcome outcome_of(Fault fault) {
    switch (fault) {
        case Fault::denied:
        case Fault::malformed:
        case Fault::not_routed:
            return Outcome::refused;
        case Fault::busy:
            return Outcome::busy;
        case Fault::expired:
            return Outcome::expired;
        case Fault::line_down:
        case Fault::line_lost:
            return Outcome::line_down;
        case Fault::timeout:
            return Outcome::timeout;
        case Fault::damaged:
        case Fault::wrong:
            return Outcome::damaged;
        case Fault::offline:
            return Outcome::offline;
        case Fault::cancelled:
            return Outcome::cancelled;
    }
    std::abort();
}

void throw_exception_from_error(Fault fault, const boost::source_location&) {
    throw std::logic_error("no value: " + std::string(label(fault)));
}

}  // namespace panelgate
