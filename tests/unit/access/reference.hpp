// The rules of `access`, judged item by item as the contract describes them, without an index, a
// cache or intervals: what LineRules is held against.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/access/settings.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/who.hpp"

namespace panelgate::access::reference {

using modbus::Table;

/// An IPv4 address as a number.
inline std::optional<std::uint32_t> number_of(const std::string& address) {
    std::uint32_t number = 0;
    std::uint32_t part = 0;
    int dots = 0;
    for (const char c : address) {
        if (c == '.') {
            number = number << 8U | part;
            part = 0;
            ++dots;
        } else {
            part = part * 10 + static_cast<std::uint32_t>(c - '0');
        }
    }
    return dots == 3 ? std::optional(number << 8U | part) : std::nullopt;
}

inline bool in_network(const std::string& address, const Network& network) {
    const auto one = number_of(address);
    const auto base = number_of(network.address);
    if (!one || !base) return false;
    const std::uint32_t mask = network.prefix == 0 ? 0 : ~0U << (32 - network.prefix);
    return (*one & mask) == (*base & mask);
}

template <class T>
bool lists(const std::vector<T>& all, const T& one) {
    return std::find(all.begin(), all.end(), one) != all.end();
}

inline bool speaks_of(const Rule& rule, const Who& who, const Place& place) {
    bool near = rule.from.empty();
    for (const Network& network : rule.from) near = near || in_network(who.address, network);
    const std::string role(label(who.standing.role));
    const bool role_fits = rule.roles.empty() || lists(rule.roles, role) ||
                           (who.token.empty() && lists(rule.roles, who.certificate_role));
    const Face face = who.face == Face::udp ? Face::modbus_tcp : who.face;
    return near && role_fits && (rule.tokens.empty() || lists(rule.tokens, who.token)) &&
           (rule.faces.empty() || lists(rule.faces, face)) &&
           (rule.listeners.empty() || lists(rule.listeners, who.listener)) &&
           (rule.stations.empty() || lists(rule.stations, place));
}

/// What is done to an item.
struct Touch {
    Act act = Act::read;
    std::optional<Table> table;  ///< none: the function names no item
    std::uint32_t item = 0;
};

inline unsigned word(const Bytes& pdu, std::size_t at) {
    return static_cast<unsigned>(pdu[at] << 8 | pdu[at + 1]);
}

/// Items that a function addresses: its table, and where in the PDU address and count are.
struct Addressed {
    std::uint8_t function;
    Act act;
    Table table;
    std::size_t address;
    std::size_t count;  ///< 0: one item
};
constexpr Addressed kAddressed[] = {{1, Act::read, Table::coils, 1, 3},
                                    {2, Act::read, Table::discrete_inputs, 1, 3},
                                    {3, Act::read, Table::holding_registers, 1, 3},
                                    {4, Act::read, Table::input_registers, 1, 3},
                                    {5, Act::write, Table::coils, 1, 0},
                                    {6, Act::write, Table::holding_registers, 1, 0},
                                    {15, Act::write, Table::coils, 1, 3},
                                    {16, Act::write, Table::holding_registers, 1, 3},
                                    {22, Act::write, Table::holding_registers, 1, 0},
                                    {23, Act::read, Table::holding_registers, 1, 3},
                                    {23, Act::write, Table::holding_registers, 5, 7}};

inline std::vector<Touch> touches(const Bytes& pdu) {
    std::vector<Touch> all;
    for (const Addressed& one : kAddressed) {
        if (one.function != pdu[0]) continue;
        const unsigned count = one.count == 0 ? 1 : word(pdu, one.count);
        for (unsigned i = 0; i < std::max(count, 1U); ++i)
            all.push_back({one.act, one.table, word(pdu, one.address) + i});
    }
    if (!all.empty()) return all;
    const bool reads =
        lists<int>({7, 11, 12, 17, 20, 24}, pdu[0]) || (pdu[0] == 43 && pdu[1] == 14);
    if (reads) return {{Act::read, {}, 0}};
    if (lists<int>({8, 21}, pdu[0])) return {{Act::write, {}, 0}};
    return {{Act::read, {}, 0}, {Act::write, {}, 0}};
}

inline bool has_item(const Rule& rule, const Place& place, const Touch& one) {
    std::vector<modbus::Span> items;
    if (const auto listed = rule.items.find(place); listed != rule.items.end()) {
        items = listed->second;
    } else if (rule.unlisted_items) {
        items.push_back(*rule.unlisted_items);
    }
    for (const modbus::Span& span : items) {
        if (span.table == one.table && span.first <= one.item && one.item < span.end()) return true;
    }
    return false;
}

inline bool allowed(const Settings& settings, const Who& who, const Place& place, Act act,
                    std::uint8_t function, const Touch& one) {
    for (const Rule& rule : settings.rules) {
        if (!rule.acts.has(act) || !speaks_of(rule, who, place)) continue;
        const bool named = lists(rule.functions, function);
        if (!rule.functions.empty() && !named) continue;
        if (!rule.range.empty() && !one.table && !named) continue;
        if (!rule.range.empty() && one.table && !has_item(rule, place, one)) continue;
        return rule.allow;
    }
    return settings.allow_by_default;
}

struct Case {
    std::vector<Place> places;  ///< more than one for a broadcast
    bool broadcast = false;
    bool raw = false;
    Bytes asked;
    Bytes sent;  ///< what the gateway makes of it for this panel; empty: the same
};

inline bool allows(const Settings& settings, const Who& who, const Case& of) {
    for (const Place& place : of.places) {
        for (const Bytes& pdu : {of.asked, of.sent}) {
            if (pdu.empty()) continue;
            for (const Touch& one : touches(pdu)) {
                std::vector<Act> acts{one.act};
                if (of.raw) acts.push_back(Act::raw);
                if (of.broadcast) acts.push_back(Act::broadcast);
                for (const Act act : acts) {
                    if (!allowed(settings, who, place, act, pdu[0], one)) return false;
                }
            }
        }
    }
    return true;
}

}  // namespace panelgate::access::reference
