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

/// How the registers of a point are to be understood.
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
/// "bool", "u16", … as in the configuration.
std::string_view label(Type type);
/// Registers of one value; a string's depends on its length.
unsigned registers_of(Type type);
inline bool is_integer(Type type) {
    return type >= Type::u16 && type != Type::f32 && type != Type::f64 && type != Type::string;
}

/// Where the bytes of a value lie, A the most significant of the first register: ABCD is the
/// standard's (AP 4.2), CDAB has the words turned round, BADC the bytes of each word, DCBA both.
/// Of one register only the byte order matters; strings keep the order of their words.
enum class WordOrder : std::uint8_t { abcd, badc, cdab, dcba };
inline constexpr WordOrder kOrders[] = {WordOrder::abcd, WordOrder::badc, WordOrder::cdab,
                                        WordOrder::dcba};
std::string_view label(WordOrder order);

/// A named value of a panel, as the configuration gives it.
struct Point {
    std::string name;
    std::string at;  ///< the notation it was configured with
    modbus::Table table = modbus::Table::holding_registers;
    std::uint16_t address = 0;    ///< 0-based, as on the wire
    std::optional<unsigned> bit;  ///< 0..15 of the register; then the type is boolean
    Type type = Type::u16;
    WordOrder word_order = WordOrder::abcd;
    unsigned length = 0;  ///< characters of a string
    double scale = 1;     ///< value = raw * scale + offset; not 0
    double offset = 0;
    std::string unit;
    std::optional<Decimal> min;  ///< of the value, checked on what is written
    std::optional<Decimal> max;
    bool writable = false;
    std::map<std::int64_t, std::string> labels;  ///< names of raw values
    std::vector<std::int64_t> no_value;          ///< raw values that say that there is none
    Duration every = 1s;

    /// Items of the table: bits or registers.
    unsigned count() const;
    friend bool operator==(const Point&, const Point&) = default;
};

/// Why no request of this panel could write the point, whatever the value: one sentence for the
/// user. Nothing when there is a way. Whether the area is writable is not asked.
std::optional<std::string> why_unwritable(const profile::PanelProfile& profile, const Point& point);

}  // namespace panelgate::points
