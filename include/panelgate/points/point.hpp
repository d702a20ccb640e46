#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::profile {
struct PanelProfile;
}

namespace panelgate::points {

/// Type of a point's value.
enum class Type : std::uint8_t {
    boolean,
    u16,
    i16,
    u32,
    i32,
    u64,
    i64,
    f32,
    f64,
    bcd16,
    bcd32,
    string,
};
inline constexpr Type kTypes[] = {Type::boolean, Type::u16,   Type::i16,   Type::u32,
                                  Type::i32,     Type::u64,   Type::i64,   Type::f32,
                                  Type::f64,     Type::bcd16, Type::bcd32, Type::string};
/// Returns "bool", "u16", … as in the configuration.
std::string_view label(Type type);
/// Returns the registers of one value; for a string this depends on its length.
unsigned registers_of(Type type);
inline bool is_integer(Type type) {
    return type >= Type::u16 && type != Type::f32 && type != Type::f64 && type != Type::string;
}

/// Byte order of a value, A the most significant byte of the first register: ABCD is the standard's
/// (AP 4.2), CDAB swaps the words, BADC the bytes in each word, DCBA both. For one register only
/// the byte order matters; strings keep their word order.
enum class WordOrder : std::uint8_t { abcd, badc, cdab, dcba };
inline constexpr WordOrder kOrders[] = {WordOrder::abcd, WordOrder::badc, WordOrder::cdab,
                                        WordOrder::dcba};
std::string_view label(WordOrder order);

/// A named value of a panel, as configured.
struct Point {
    std::string name;
    std::string at;  ///< the configured notation
    modbus::Table table = modbus::Table::holding_registers;
    std::uint16_t address = 0;    ///< 0-based, as on the wire
    std::optional<unsigned> bit;  ///< 0..15 of the register; the type is then boolean
    Type type = Type::u16;
    WordOrder word_order = WordOrder::abcd;
    unsigned length = 0;  ///< length of a string
    double scale = 1;     ///< value = raw * scale + offset; not 0
    double offset = 0;
    std::string unit;
    std::optional<Decimal> min;  ///< limit of the value, checked on writes
    std::optional<Decimal> max;
    bool writable = false;
    std::map<std::int64_t, std::string> labels;  ///< names of raw values
    std::vector<std::int64_t> no_value;          ///< raw values that mean "no value"
    Duration every = 1s;

    /// Returns the number of items in the table: bits or registers.
    unsigned count() const;
    friend bool operator==(const Point&, const Point&) = default;
};

/// Returns why no request to this panel can write the point, whatever the value: one sentence for
/// the user. nullopt if one can. Does not check whether the area is writable.
std::optional<std::string> why_unwritable(const profile::PanelProfile& profile, const Point& point);

}  // namespace panelgate::points
