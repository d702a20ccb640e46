#include "panelgate/scan/read_request.hpp"

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

std::optional<ReadRequest> ReadRequest::make(std::uint8_t station, ByteView pdu) {
    if (station == 0 || station > modbus::kMaxStation) return std::nullopt;
    if (!modbus::is_pure_read(pdu)) return std::nullopt;
    if (!modbus::check_request(pdu, modbus::QuantityCheck::wide)) return std::nullopt;
    return ReadRequest(modbus::encode_adu(station, pdu));
}

}  // namespace panelgate::scan
