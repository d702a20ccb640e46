#include "registers.hpp"

#include <algorithm>
#include <cmath>

#include "scaling.hpp"

namespace panelgate::points {
namespace {

bool swaps_bytes(WordOrder order) { return order == WordOrder::badc || order == WordOrder::dcba; }
bool swaps_words(WordOrder order) { return order == WordOrder::cdab || order == WordOrder::dcba; }

std::uint16_t swapped(std::uint16_t word) {
    return static_cast<std::uint16_t>(word << 8 | word >> 8);
}

/// n when the scale is 1/n and all there is: dividing by n gives the double nearest to the decimal
/// number, as Scaling does, at less expense.
std::optional<double> divisor_of(const Point& point) {
    const double inverse = std::round(1 / point.scale);
    if (point.offset != 0 || std::abs(point.scale) >= 1 || 1 / inverse != point.scale)
        return std::nullopt;
    return inverse;
}

}  // namespace

Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words) {
    Words words(items.begin(), items.end());
    if (swaps_bytes(order)) std::ranges::transform(words, words.begin(), swapped);
    if (swaps_words(order) && !keep_words) std::ranges::reverse(words);
    return words;
}

std::uint64_t joined(const Words& words) {
    std::uint64_t raw = 0;
    for (const std::uint16_t word : words) raw = raw << 16 | word;
    return raw;
}

Words parted(std::uint64_t raw, unsigned count) {
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

double from_raw(const Point& point, double raw) {
    if (is_plain(point)) return raw;
    if (const auto divisor = divisor_of(point)) return raw / *divisor;
    return Scaling(point.scale, point.offset).value_of(raw);
}

bool means_none(const Point& point, std::uint64_t number) {
    const unsigned unused = 64 - 16 * registers_of(point.type);
    return std::ranges::any_of(point.no_value, [&](std::int64_t none) {
        return (static_cast<std::uint64_t>(none) ^ number) << unused == 0;
    });
}

bool means_none(const Point& point, double number) {
    return std::ranges::any_of(
        point.no_value, [&](std::int64_t none) { return static_cast<double>(none) == number; });
}

}  // namespace panelgate::points
