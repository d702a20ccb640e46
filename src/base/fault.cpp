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
    }
    std::abort();
}

std::string_view outcome_label(Fault fault) {
    switch (fault) {
        case Fault::denied:
        case Fault::malformed:
        case Fault::not_routed:
            return "refused";
        case Fault::line_down:
        case Fault::line_lost:
            return "line_down";
        case Fault::busy:
        case Fault::expired:
        case Fault::timeout:
        case Fault::damaged:
        case Fault::offline:
        case Fault::cancelled:
            return label(fault);
    }
    std::abort();
}

void throw_exception_from_error(Fault fault, const boost::source_location&) {
    throw std::logic_error("no value: " + std::string(label(fault)));
}

}  // namespace panelgate
