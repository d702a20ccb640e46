#include "panelgate/modbus/request.hpp"

#include <cstdlib>

using namespace panelgate;
using namespace panelgate::modbus;

/// Any PDU is judged without harm, and what passes keeps to the limits.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteView pdu(data, size);
    const bool fits = check_request(pdu, QuantityCheck::fit).has_value();
    const bool wide = check_request(pdu, QuantityCheck::wide).has_value();
    const std::optional<std::size_t> reply = reply_length_from_request(pdu);
    if (fits && (!wide || size > kMaxPdu || reply.value_or(0) > kMaxRtuAdu)) std::abort();
    if (wide && (size > kMaxLongRequestPdu || reply.value_or(0) > kMaxLongRtuAdu)) std::abort();
    const Access access = access_of(pdu);
    if (wide && is_pure_read(pdu) && access.write) std::abort();
    if (is_never_answered(pdu) && reply != 0u) std::abort();
    return 0;
}
