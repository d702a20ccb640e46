#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::points {

/// value = raw * scale + offset in decimal arithmetic: 3 * 0.1 is 0.3, and 21.5 is exactly 215
/// tenths though no binary fraction is a tenth.
class Scaling {
  public:
    /// Both finite; `scale` is not 0.
    Scaling(double scale, double offset);

    /// Returns the double nearest to the decimal value, up to 15 digits.
    double value_of(double raw) const;
    /// Returns the value with all its digits.
    Decimal value_of(const Decimal& raw) const;
    /// Not rounded.
    double raw_of(double value) const;
    /// Returns the integer raw numbers around this value.
    Decimal::Around around(const Decimal& value) const;
    /// Returns the integer raw number with exactly this value, or whose value is shown as this,
    /// also when shown with the 17 digits that some programs print for every double. nullopt if
    /// there is none or several.
    std::optional<Decimal> exact_raw_of(const Decimal& value) const;

  private:
    std::optional<Decimal> raw_shown_as(double value) const;

    double scale_;
    double offset_;
    std::optional<double> divisor_;  ///< n if the value is raw / n
    Decimal decimal_scale_;
    Decimal decimal_offset_;
};

/// Returns the text in these registers, high byte first, up to the first NUL, at most `length`
/// bytes, without trailing blanks. Invalid UTF-8 becomes U+FFFD, so that the text fits into JSON.
std::string text_of_words(const std::vector<std::uint16_t>& words, unsigned length);

/// Pads with NUL. The text must fit.
std::vector<std::uint16_t> text_to_words(std::string_view text, unsigned count);

/// True for "NaN", "-inf", "Infinity" in any case.
bool is_non_finite(std::string_view typed);

// Conversions between a point's registers and its raw number, shared by decode and encode.

using Words = std::vector<std::uint16_t>;

/// Converts to or from the standard's order: it is its own inverse.
Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words);
/// The first word is the most significant.
std::uint64_t join_words(const Words& words);
Words split_words(std::uint64_t raw, unsigned count);

/// nullopt for invalid BCD.
std::optional<std::int64_t> from_bcd(std::uint64_t raw, unsigned digits);
std::uint64_t to_bcd(std::uint64_t value);

/// IEEE 754 binary16. to_half() rounds to the nearest, ties to even; `number` is at most 65504 in
/// size.
float from_half(std::uint16_t bits);
std::uint16_t to_half(double number);

inline bool is_bcd(Type type) { return type == Type::bcd16 || type == Type::bcd32; }
/// True without scale and offset.
inline bool is_plain(const Point& point) { return point.scale == 1 && point.offset == 0; }
/// Returns the value of this raw number.
double from_raw(const Point& point, double raw);

/// True if this raw number means "no value". Compares as many low bits as the type has: -1 and
/// 65535 are the same u16.
bool is_no_value(const Point& point, std::uint64_t number);
bool is_no_value(const Point& point, double number);

}  // namespace panelgate::points
