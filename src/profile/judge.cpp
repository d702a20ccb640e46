#include "panelgate/profile/judge.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::profile {

namespace {

using modbus::Table;

/// True if one area contains all these items and is shown in both tables.
bool is_same_memory(const PanelProfile& profile, const modbus::Span& items, Table other) {
    return std::ranges::any_of(profile.areas, [&](const Area& area) {
        return area.reaches(items.table) && area.reaches(other) &&
               area.readable.contains(items.first, items.count);
    });
}

bool share_memory(const PanelProfile& profile, Table a, Table b) {
    return std::ranges::any_of(
        profile.areas, [&](const Area& area) { return area.reaches(a) && area.reaches(b); });
}

}  // namespace

std::vector<Translation> translations(const PanelProfile& profile) {
    using namespace modbus;
    constexpr std::array<Translation, 4> kAll{{{kReadDiscreteInputs, kReadCoils},
                                               {kReadInputRegisters, kReadHoldingRegisters},
                                               {kWriteSingleCoil, kWriteMultipleCoils},
                                               {kWriteSingleRegister, kWriteMultipleRegisters}}};
    const bool bits = share_memory(profile, Table::discrete_inputs, Table::coils);
    const bool words = share_memory(profile, Table::input_registers, Table::holding_registers);
    std::vector<Translation> possible;
    for (const Translation& one : kAll) {
        if (profile.has_function(one.asked) || !profile.has_function(one.sent)) continue;
        const bool read = modbus::is_read(one.asked);
        const bool shared = one.asked == kReadDiscreteInputs ? bits : words;
        if (!read || shared) possible.push_back(one);
    }
    return possible;
}

std::optional<modbus::Request> translate(const PanelProfile& profile,
                                         const modbus::Request& request) {
    if (profile.has_function(request.function())) return std::nullopt;
    auto other = modbus::translated(request);
    if (!other || !profile.has_function(other->function())) return std::nullopt;
    const auto& asked = request.span();
    const auto& sent = other->span();
    if (request.is_read() && !(asked && sent && is_same_memory(profile, *asked, sent->table)))
        return std::nullopt;
    return other;
}

namespace {

/// Returns the items that lie in the area, through any of its tables.
std::optional<modbus::Span> intersection(const Area& area, const modbus::Span& items) {
    if (!area.reaches(items.table)) return std::nullopt;
    const std::uint32_t first = std::max(items.first, area.readable.first);
    const std::uint32_t end = std::min(items.end(), area.readable.last + 1);
    if (first >= end) return std::nullopt;
    return modbus::Span{area.table, first, end - first};
}

void add_in_all_tables(const Area& area, modbus::Span items, std::vector<modbus::Span>& shown) {
    shown.push_back(items);
    for (const modbus::Table table : area.also) {
        items.table = table;
        shown.push_back(items);
    }
}

void add_bits_of(const PanelProfile& profile, const Area& words, const modbus::Span& items,
                 std::vector<modbus::Span>& shown) {
    for (const Area& bits : profile.areas) {
        if (bits.view_of != words.name) continue;
        add_in_all_tables(
            bits, {bits.table, items.first * kBitsPerWord, items.count * kBitsPerWord}, shown);
    }
}

}  // namespace

std::vector<modbus::Span> shown_as(const PanelProfile& profile, const modbus::Span& written) {
    std::vector<modbus::Span> shown{written};
    for (const Area& area : profile.areas) {
        const auto items = intersection(area, written);
        if (!items) continue;
        add_in_all_tables(area, *items, shown);
        add_bits_of(profile, area, *items, shown);
        if (area.view_of.empty()) continue;
        const Area& words = *profile.find_area(std::string_view(area.view_of));
        const std::uint32_t first = items->first / kBitsPerWord;
        const std::uint32_t last = (items->end() - 1) / kBitsPerWord;
        const modbus::Span viewed{words.table, first, last - first + 1};
        add_in_all_tables(words, viewed, shown);
        add_bits_of(profile, words, viewed, shown);
    }
    return shown;
}

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
