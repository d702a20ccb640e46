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

/// A decimal has more digits than a double; a double means its shortest digits.
using Value = std::variant<bool, std::int64_t, std::uint64_t, double, std::string, Decimal>;

/// Why something cannot be written: one sentence for the user.
struct WriteRefusal {
    std::string message;
    bool inexact = false;    ///< Rounding::nearest would do
    bool malformed = false;  ///< no value of any point: NaN, an infinity
};
[[noreturn]] void throw_exception_from_error(const WriteRefusal& refusal,
                                             const boost::source_location& where);
template <class T>
using Encoded = boost::system::result<T, WriteRefusal>;

/// The value in these items (registers, or bits as 0 and 1), as many as point.count(). Nothing for
/// a raw value that means none, a number that is not finite, and digits that are no BCD. Integers
/// without scale and offset stay exact, and those of 64 bits with them, too.
std::optional<Value> decode(const Point& point, std::span<const std::uint16_t> items);
/// The name of this raw value, where the point has one.
std::optional<std::string> label_of(const Point& point, std::span<const std::uint16_t> items);

/// What to do with a value that no raw number has.
enum class Rounding : std::uint8_t { exact, nearest };

/// The items that hold this value: the inverse of decode. One that no raw number has is refused,
/// with the nearest below and above, unless it may be rounded; but a fraction takes the nearest
/// float, for its digits are never meant to the last bit, where that is a normal one and floats
/// still have fractions. Refused where what would be written is outside the type's range or the
/// point's min and max; what lies within them itself is rounded to what does. A label stands for
/// its raw value.
Encoded<std::vector<std::uint16_t>> encode(const Point& point, const Value& value,
                                           Rounding rounding = Rounding::exact);

/// A request that writes a point, and what the point is when it is confirmed.
struct PointWrite {
    Bytes pdu;
    Value value;
    std::optional<std::string> label;
};
/// The one request that writes it: 05 or 15 a coil, 06 or 16 registers, 22 or the bit view of the
/// panel a bit of a word. Never a read and a write: what changed in between would be lost.
Encoded<PointWrite> write_request(const profile::PanelProfile& profile, const Point& point,
                                  const Value& value, Rounding rounding = Rounding::exact);

std::string to_string(const Value& value);
/// Bits as 0 and 1; nothing for a text. Of a decimal the nearest.
std::optional<double> number_of(const Value& value);

/// One block of registers understood in one way.
struct Interpretation {
    Type type = Type::u16;
    WordOrder order = WordOrder::abcd;
    std::vector<std::string> values;  ///< one after the other, "" where there is none
};
/// … in every way that fits: for finding out how a panel stores its numbers.
std::vector<Interpretation> interpretations(std::span<const std::uint16_t> registers);

}  // namespace panelgate::points
