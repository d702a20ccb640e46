#include "registers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "panelgate/base/text.hpp"

namespace panelgate::points {

namespace {

constexpr std::int64_t kMaxExactInteger = std::int64_t{1}
                                          << 53;  ///< a double holds every integer up to this
constexpr int kRoundTripDigits = 17;              ///< digits that distinguish any two doubles

/// Returns n if the scale is 1/n and there is no offset: dividing by n gives the double nearest to
/// the number.
std::optional<double> divisor_of(double scale, double offset) {
    const double inverse = std::round(1 / scale);
    if (offset != 0 || std::abs(scale) >= 1 || 1 / inverse != scale) return std::nullopt;
    return inverse;
}

}  // namespace

Scaling::Scaling(double scale, double offset)
    : scale_(scale),
      offset_(offset),
      divisor_(divisor_of(scale, offset)),
      decimal_scale_(scale),
      decimal_offset_(offset) {}

double Scaling::value_of(double raw) const {
    if (divisor_) return raw / *divisor_;
    const bool is_whole =
        raw == std::floor(raw) && std::abs(raw) <= static_cast<double>(kMaxExactInteger);
    return is_whole ? value_of(Decimal(raw)).nearest() : raw * scale_ + offset_;
}

Decimal Scaling::value_of(const Decimal& raw) const {
    return raw * decimal_scale_ + decimal_offset_;
}

double Scaling::raw_of(double value) const {
    const double inverse = std::round(1 / scale_);
    if (std::abs(scale_) < 1 && 1 / inverse == scale_) return (value - offset_) * inverse;
    return (value - offset_) / scale_;
}

Decimal::Around Scaling::around(const Decimal& value) const {
    return (value + -decimal_offset_).divided_by(decimal_scale_);
}

/// nullopt if a neighbouring raw number is shown the same.
std::optional<Decimal> Scaling::raw_shown_as(double value) const {
    const auto whole = around(value);
    if (whole.below == whole.above) return whole.nearest;
    const double raw = whole.nearest.nearest();
    if (std::abs(raw) >= static_cast<double>(kMaxExactInteger) || value_of(raw) != value ||
        value_of(raw - 1) == value || value_of(raw + 1) == value)
        return std::nullopt;
    return whole.nearest;
}

std::optional<Decimal> Scaling::exact_raw_of(const Decimal& value) const {
    const auto whole = around(value);
    if (whole.below == whole.above) return whole.nearest;
    const double nearest = value.nearest();
    if (value == Decimal(nearest) || value == Decimal::exactly(nearest, kRoundTripDigits))
        return raw_shown_as(nearest);
    return std::nullopt;
}

namespace {

std::string to_utf8(std::string_view bytes) {
    std::string text;
    while (!bytes.empty()) {
        const std::size_t length = utf8_sequence(bytes);
        text += length == 0 ? std::string_view("\xEF\xBF\xBD") : bytes.substr(0, length);
        bytes.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return text;
}

}  // namespace

std::string text_of_words(const std::vector<std::uint16_t>& words, unsigned length) {
    std::string bytes;
    for (const std::uint16_t word : words) {
        bytes += static_cast<char>(word >> 8);
        bytes += static_cast<char>(word & 0xFF);
    }
    bytes.resize(std::min<std::size_t>({bytes.size(), length, bytes.find('\0')}));
    bytes.resize(bytes.find_last_not_of(' ') + 1);
    return to_utf8(bytes);
}

std::vector<std::uint16_t> text_to_words(std::string_view text, unsigned count) {
    std::vector<std::uint16_t> words(count);
    for (std::size_t i = 0; i < text.size(); ++i) {
        const unsigned byte = static_cast<unsigned char>(text[i]);
        words[i / 2] = static_cast<std::uint16_t>(words[i / 2] | (i % 2 == 0 ? byte << 8 : byte));
    }
    return words;
}

bool is_non_finite(std::string_view typed) {
    std::string text = to_lower(typed);
    if (text.starts_with('-') || text.starts_with('+')) text.erase(0, 1);
    return text == "nan" || text == "inf" || text == "infinity";
}

namespace {

bool swaps_bytes(WordOrder order) { return order == WordOrder::badc || order == WordOrder::dcba; }
bool swaps_words(WordOrder order) { return order == WordOrder::cdab || order == WordOrder::dcba; }

std::uint16_t swapped(std::uint16_t word) {
    return static_cast<std::uint16_t>(word << 8 | word >> 8);
}

}  // namespace

Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words) {
    Words words(items.begin(), items.end());
    if (swaps_bytes(order)) std::ranges::transform(words, words.begin(), swapped);
    if (swaps_words(order) && !keep_words) std::ranges::reverse(words);
    return words;
}

std::uint64_t join_words(const Words& words) {
    std::uint64_t raw = 0;
    for (const std::uint16_t word : words) raw = raw << 16 | word;
    return raw;
}

Words split_words(std::uint64_t raw, unsigned count) {
    Words words(count);
    for (unsigned i = count; i-- > 0; raw >>= 16) words[i] = static_cast<std::uint16_t>(raw);
    return words;
}

std::optional<std::int64_t> from_bcd(std::uint64_t raw, unsigned digits) {
    std::int64_t value = 0;
    for (unsigned i = digits; i-- > 0;) {
        const auto digit = static_cast<std::int64_t>(raw >> (4 * i) & 0xF);
        if (digit > 9) return std::nullopt;
        value = value * 10 + digit;
    }
    return value;
}

std::uint64_t to_bcd(std::uint64_t value) {
    std::uint64_t raw = 0;
    for (unsigned shift = 0; value > 0; shift += 4, value /= 10) raw |= value % 10 << shift;
    return raw;
}

namespace {

constexpr int kHalfDigits = 10;  // of the fraction
constexpr int kHalfBias = 25;    // of the exponent, with the fraction as a whole number
constexpr unsigned kHidden = 1u << kHalfDigits;
constexpr unsigned kHalfSign = 0x8000;

}  // namespace

float from_half(std::uint16_t bits) {
    const int exponent = bits >> kHalfDigits & 0x1F;
    const unsigned fraction = bits % kHidden;
    float size = std::ldexp(static_cast<float>(fraction), 1 - kHalfBias);
    if (exponent == 0x1F)
        size = fraction == 0 ? std::numeric_limits<float>::infinity()
                             : std::numeric_limits<float>::quiet_NaN();
    else if (exponent > 0)
        size = std::ldexp(static_cast<float>(kHidden + fraction), exponent - kHalfBias);
    return (bits & kHalfSign) != 0 ? -size : size;
}

/// A fraction that is rounded up to the next power of two carries into the exponent.
std::uint16_t to_half(double number) {
    int exponent = 0;
    std::frexp(number, &exponent);
    exponent = number == 0 ? 1 : std::max(exponent + kHalfBias - kHalfDigits - 1, 1);
    const double units = std::nearbyint(std::ldexp(std::abs(number), kHalfBias - exponent));
    const unsigned bits =
        static_cast<unsigned>(exponent - 1) * kHidden + static_cast<unsigned>(units);
    return static_cast<std::uint16_t>(std::signbit(number) ? kHalfSign | bits : bits);
}

double from_raw(const Point& point, double raw) {
    if (is_plain(point)) return raw;
    // What Scaling does, but cheaper.
    if (const auto divisor = divisor_of(point.scale, point.offset)) return raw / *divisor;
    return Scaling(point.scale, point.offset).value_of(raw);
}

bool is_no_value(const Point& point, std::uint64_t number) {
    const unsigned unused = 64 - bits_of(point.type);
    return std::ranges::any_of(point.no_value, [&](std::int64_t none) {
        return (static_cast<std::uint64_t>(none) ^ number) << unused == 0;
    });
}

bool is_no_value(const Point& point, double number) {
    return std::ranges::any_of(
        point.no_value, [&](std::int64_t none) { return static_cast<double>(none) == number; });
}

}  // namespace panelgate::points
