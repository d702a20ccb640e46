#pragma once

#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/crc_order.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

/// A request that changes nothing. There is no other way to make one than make(), and a scan has
/// nothing else to send: it is read-only by construction, whatever a profile asks for.
class ReadRequest {
  public:
    /// Nothing unless the station is 1 to 247 and the PDU is well-formed and a pure read.
    static std::optional<ReadRequest> make(std::uint8_t station, ByteView pdu,
                                           modbus::CrcOrder order = modbus::CrcOrder::low_first);

    std::uint8_t station() const { return adu_.front(); }
    ByteView pdu() const { return modbus::pdu_of(adu_); }
    const Bytes& adu() const { return adu_; }
    modbus::CrcOrder crc_order() const { return order_; }

  private:
    ReadRequest(Bytes adu, modbus::CrcOrder order) : adu_(std::move(adu)), order_(order) {}
    Bytes adu_;
    modbus::CrcOrder order_;
};

}  // namespace panelgate::scan
