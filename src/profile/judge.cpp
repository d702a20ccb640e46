#include "panelgate/profile/judge.hpp"

#include <algorithm>

namespace panelgate::profile {
namespace {

/// 17h: AP 6.17 lets a request write 121 registers, so that it fits a PDU, but read 125.
unsigned write_limit(const PanelProfile& profile, std::uint8_t function) {
    constexpr unsigned kMostBesidesARead = 121;
    const unsigned most = profile.max_count(function);
    return function == modbus::kReadWriteMultipleRegisters ? std::min(most, kMostBesidesARead)
                                                           : most;
}

bool within(const std::optional<modbus::Span>& span, unsigned most) {
    return !span || (span->count >= 1 && span->count <= most);
}

bool is_coil_value(ByteView pdu) {
    return (pdu[3] == 0xFF || pdu[3] == 0) && pdu[4] == 0;  // AP 6.5
}

}  // namespace

const Area* find_readable(const PanelProfile& profile, const modbus::Span& span) {
    const Area* area = profile.find_area(span.table, span.first);
    return area != nullptr && area->readable.contains(span.first, span.count) ? area : nullptr;
}

Judgement judge(const PanelProfile& profile, ByteView pdu) {
    if (pdu.empty() || profile.find_function(pdu[0]) == nullptr) return Judgement::illegal_function;
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    return request ? judge(profile, *request) : Judgement::illegal_value;
}

Judgement judge(const PanelProfile& profile, const modbus::Request& request) {
    const std::uint8_t function = request.function();
    if (profile.find_function(function) == nullptr) return Judgement::illegal_function;
    if (function == modbus::kReadFifoQueue) return Judgement::fine;
    const modbus::Access access = request.access();
    if (!within(access.read, profile.max_count(function)) ||
        !within(access.write, write_limit(profile, function))) {
        return Judgement::illegal_value;
    }
    if (function == modbus::kWriteSingleCoil && !is_coil_value(request.pdu()))
        return Judgement::illegal_value;
    if (access.read && find_readable(profile, *access.read) == nullptr)
        return Judgement::illegal_address;
    if (!access.write) return Judgement::fine;
    const Area* area = find_readable(profile, *access.write);
    if (area == nullptr) return Judgement::illegal_address;
    const bool may =
        area->writable && area->writable->contains(access.write->first, access.write->count);
    return may ? Judgement::fine : Judgement::write_protected;
}

}  // namespace panelgate::profile
