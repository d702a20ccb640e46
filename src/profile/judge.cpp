#include "panelgate/profile/judge.hpp"

#include <algorithm>
#include <cstdlib>

#include "panelgate/profile/notation.hpp"

namespace panelgate::profile {
namespace {

/// 17h: AP 6.17 limits the written registers to 121 so that the request fits a PDU; reads to 125.
unsigned write_limit(const PanelProfile& profile, std::uint8_t function) {
    constexpr unsigned kMaxWithRead = 121;
    const unsigned most = profile.max_count(function);
    return function == modbus::kReadWriteMultipleRegisters ? std::min(most, kMaxWithRead) : most;
}

bool within(const std::optional<modbus::Span>& span, unsigned most) {
    return !span || (span->count >= 1 && span->count <= most);
}

bool is_coil_value(ByteView pdu) {
    return (pdu[3] == 0xFF || pdu[3] == 0) && pdu[4] == 0;  // AP 6.5
}

/// "holding-registers 65520 to 65524"
std::string name_of(const modbus::Span& span) {
    std::string text = std::string(label(span.table)) + ' ' + std::to_string(span.first);
    if (span.count > 1) text += " to " + std::to_string(span.end() - 1);
    return text;
}

/// "UW0 to UW999"
std::string name_of(const Area& area, const AddressRange& range) {
    return format_notation(area, static_cast<std::uint16_t>(range.first)) + " to " +
           format_notation(area, static_cast<std::uint16_t>(range.last));
}

std::string explain_quantity(const PanelProfile& profile, const modbus::Request& request) {
    const std::string function = "function " + std::to_string(request.function());
    const modbus::Access access = request.access();
    unsigned most = profile.max_count(request.function());
    if (access.write) most = write_limit(profile, request.function());
    const auto& span = access.write ? access.write : access.read;
    if (!span || within(span, most)) return function + " does not take these values";
    return function + " takes 1 to " + std::to_string(most) + " at once, not " +
           std::to_string(span->count);
}

std::string explain_range(const PanelProfile& profile, const modbus::Span& span) {
    std::string text = name_of(span) + (span.count > 1 ? " are not all memory" : " is no memory");
    text += " of " + profile.name;
    const Area* area = profile.find_area(span.table, span.first);
    if (area != nullptr) text += "; there is " + name_of(*area, area->readable);
    return text;
}

std::string explain_protection(const PanelProfile& profile, const modbus::Span& span) {
    const Area* area = find_readable(profile, span);
    const std::string text = name_of(span) + " cannot be written in " + profile.name;
    if (area == nullptr) return text;
    if (!area->writable) return text + ": " + area->name + " is read-only";
    return text + "; writable is " + name_of(*area, *area->writable);
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

std::string explain(const PanelProfile& profile, const modbus::Request& request) {
    const modbus::Access access = request.access();
    switch (judge(profile, request)) {
        case Judgement::fine:
            return {};
        case Judgement::illegal_function:
            return profile.name + " has no function " + std::to_string(request.function());
        case Judgement::illegal_value:
            return explain_quantity(profile, request);
        case Judgement::illegal_address: {
            const bool reads = access.read && find_readable(profile, *access.read) == nullptr;
            return explain_range(profile, reads ? *access.read : access.write.value());
        }
        case Judgement::write_protected:
            return explain_protection(profile, access.write.value());
    }
    std::abort();
}

}  // namespace panelgate::profile
