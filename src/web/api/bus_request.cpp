#include "bus_request.hpp"

#include <utility>

#include "answer.hpp"

namespace panelgate::web {

Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return problem_of(request.error(), false);
    return bus::Request{.station = station, .request = std::move(*request)};
}

}  // namespace panelgate::web
