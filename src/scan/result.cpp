#include "panelgate/scan/result.hpp"

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

std::optional<ReadRequest> ReadRequest::make(std::uint8_t station, ByteView pdu,
                                             modbus::CrcOrder order) {
    if (station == 0 || station > modbus::kMaxStation) return std::nullopt;
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    if (!request || !request->is_read()) return std::nullopt;
    return ReadRequest(modbus::encode_adu(station, pdu, order), order);
}

}  // namespace panelgate::scan
