#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <boost/system/result.hpp>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::points {

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
/// 22 or the panel's bit view for a bit of a word. Never read-modify-write: changes in between
/// would be lost.
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
