#pragma once

#include "panelgate/modbus/request.hpp"

namespace panelgate::test {

/// A PDU that the test knows to be one.
inline modbus::Request request_of(const Bytes& pdu) {
    return modbus::Request::make(pdu, modbus::QuantityCheck::wide).value();
}

}  // namespace panelgate::test
