#pragma once

#include <boost/system/result.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::profile {
struct PanelProfile;
}

namespace panelgate::points {

/// Type of a point's value.
enum class Type : std::uint8_t {
    boolean,
    u8h,  ///< the high byte of a register
    u8l,  ///< the low byte
    i8h,
    i8l,
    u16,
    i16,
    u32,
    i32,
    u48,
    i48,
    u64,
    i64,
    f16,
    f32,
    f64,
    bcd16,
    bcd32,
    string,
};
inline constexpr Type kTypes[] = {Type::boolean, Type::u8h,   Type::u8l,   Type::i8h,   Type::i8l,
                                  Type::u16,     Type::i16,   Type::u32,   Type::i32,   Type::u48,
                                  Type::i48,     Type::u64,   Type::i64,   Type::f16,   Type::f32,
                                  Type::f64,     Type::bcd16, Type::bcd32, Type::string};
/// Returns "bool", "u16", … as in the configuration.
std::string_view label(Type type);
/// Returns the bits of one raw number; those of a register for a bit and for a string.
unsigned bits_of(Type type);
/// Returns the registers of one value; for a string this depends on its length.
unsigned registers_of(Type type);
/// True for half a register. A write of such a value leaves the other half as it is.
inline bool is_byte(Type type) { return type >= Type::u8h && type <= Type::i8l; }
/// True for an integer that may be below 0.
inline bool is_signed(Type type) { return label(type).starts_with('i'); }
inline bool is_float(Type type) { return type >= Type::f16 && type <= Type::f64; }
inline bool is_integer(Type type) {
    return type != Type::boolean && type != Type::string && !is_float(type);
}

/// Byte order of a value, A the most significant byte of the first register: ABCD is the standard's
/// (AP 4.2), CDAB swaps the words, BADC the bytes in each word, DCBA both. For one register only
/// the byte order matters; strings keep their word order.
enum class WordOrder : std::uint8_t { abcd, badc, cdab, dcba };
inline constexpr WordOrder kOrders[] = {WordOrder::abcd, WordOrder::badc, WordOrder::cdab,
                                        WordOrder::dcba};
std::string_view label(WordOrder order);

/// A named value of a panel, as configured.
/// When a reading of a point is told to subscribers (MQTT, Sparkplug, server-sent events).
struct ReportRule {
    std::optional<double> deadband{};    ///< smallest change of a number that is told
    std::optional<Duration> at_most{};   ///< shortest time between two changes that are told
    std::optional<Duration> at_least{};  ///< an unchanged value is told again that often

    bool empty() const { return !deadband && !at_most && !at_least; }
    friend bool operator==(const ReportRule&, const ReportRule&) = default;
};

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
    ReportRule report{};
    bool overview = false;  ///< shown on its station's tile

    /// Returns the number of items in the table: bits or registers.
    unsigned count() const;
    friend bool operator==(const Point&, const Point&) = default;
};

/// Returns why no request to this panel can write the point, whatever the value: one sentence for
/// the user. nullopt if one can. Does not check whether the area is writable.
std::optional<std::string> why_unwritable(const profile::PanelProfile& profile, const Point& point);

/// A Decimal has more digits than a double; a double stands for its shortest digits.
using Value = std::variant<bool, std::int64_t, std::uint64_t, double, std::string, Decimal>;

/// Why a value cannot be written: one sentence for the user.
struct WriteRefusal {
    std::string message;
    bool inexact = false;    ///< Rounding::nearest would succeed
    bool malformed = false;  ///< not a value of any point: NaN, an infinity
};
[[noreturn]] void throw_exception_from_error(const WriteRefusal& refusal,
                                             const boost::source_location& where);
template <class T>
using Encoded = boost::system::result<T, WriteRefusal>;

/// Returns the value of these items (registers, or bits as 0 and 1), point.count() of them. nullopt
/// for raw values that mean "no value", non-finite numbers and invalid BCD. Integers without scale
/// and offset are exact; 64-bit integers always are.
std::optional<Value> decode(const Point& point, std::span<const std::uint16_t> items);
/// Returns the label of this raw value, if the point has one.
std::optional<std::string> label_of(const Point& point, std::span<const std::uint16_t> items);

/// What to do with a value that no raw number represents.
enum class Rounding : std::uint8_t { exact, nearest };

/// Returns the items that represent this value: the inverse of decode. A value without an exact raw
/// number is refused, naming the nearest below and above, unless it may be rounded. A fraction
/// takes the nearest float if that is a normal one and floats of this size still have fractions.
/// Refused if the written value would be outside the type's range or the point's min and max; a
/// value within these is rounded to one within them. A label stands for its raw value.
Encoded<std::vector<std::uint16_t>> encode(const Point& point, const Value& value,
                                           Rounding rounding = Rounding::exact);

/// A request that writes a point, and the point's value once it is confirmed.
struct PointWrite {
    Bytes pdu;
    Value value;
    std::optional<std::string> label;
};
/// Returns the single request that writes the value: 05 or 15 for a coil, 06 or 16 for registers,
/// 22 or the panel's bit view for a bit of a word, 22 for a byte. Never read-modify-write: changes
/// in between would be lost.
Encoded<PointWrite> write_request(const profile::PanelProfile& profile, const Point& point,
                                  const Value& value, Rounding rounding = Rounding::exact);

std::string to_string(const Value& value);
/// Returns bits as 0 and 1; for a Decimal the nearest double; nullopt for a text.
std::optional<double> number_of(const Value& value);

/// A block of registers decoded in one way.
struct Interpretation {
    Type type = Type::u16;
    WordOrder order = WordOrder::abcd;
    std::vector<std::string> values;  ///< in order, "" for none
};
/// Returns every interpretation that fits, to find out how a panel stores its numbers.
std::vector<Interpretation> interpretations(std::span<const std::uint16_t> registers);

}  // namespace panelgate::points
