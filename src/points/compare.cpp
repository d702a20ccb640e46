#include "compare.hpp"

#include <charconv>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <string>
#include <system_error>
#include <variant>

#include "panelgate/base/number_text.hpp"

namespace panelgate::points {
namespace {

/// The bound is finite.
template <class Whole>
std::partial_ordering compare(Whole value, double bound) {
    // Both are powers of two, or 0: exact.
    constexpr auto kLow = static_cast<double>(std::numeric_limits<Whole>::min());
    constexpr double kBeyond = std::numeric_limits<Whole>::is_signed ? 0x1p63 : 0x1p64;
    if (bound < kLow) return std::partial_ordering::greater;
    if (bound >= kBeyond) return std::partial_ordering::less;
    const double floor = std::floor(bound);
    const auto whole = static_cast<Whole>(floor);
    if (value != whole) return value <=> whole;
    return floor < bound ? std::partial_ordering::less : std::partial_ordering::equivalent;
}

std::partial_ordering compare(const Value& value, double bound) {
    if (const auto* i = std::get_if<std::int64_t>(&value)) return compare(*i, bound);
    if (const auto* u = std::get_if<std::uint64_t>(&value)) return compare(*u, bound);
    return *number_of(value) <=> bound;
}

/// "9.223372036854776e+18" as 9223372036854776000, where it has as few digits.
std::string whole_digits(double number) {
    char buffer[32];
    const auto [end, error] =
        std::to_chars(buffer, buffer + sizeof buffer, number, std::chars_format::scientific);
    if (error != std::errc()) return {};
    const std::string text(buffer, end);
    const std::size_t mark = text.find('e');
    if (mark == text.npos) return {};
    std::string digits = text.substr(0, mark);
    std::erase(digits, '.');
    const std::size_t wanted = (number < 0 ? 2 : 1) + std::stoul(text.substr(mark + 2));
    if (text[mark + 1] == '-' || digits.size() > wanted || wanted > 32) return {};
    return digits.append(wanted - digits.size(), '0');
}

}  // namespace

bool is_below(const Value& value, double bound) { return compare(value, bound) < 0; }
bool is_above(const Value& value, double bound) { return compare(value, bound) > 0; }
bool is_same(const Value& value, double other) { return compare(value, other) == 0; }

bool is_printed_as(const Value& value, double number) {
    const bool is_whole =
        std::holds_alternative<std::int64_t>(value) || std::holds_alternative<std::uint64_t>(value);
    return is_whole ? to_string(value) == whole_digits(number) : *number_of(value) == number;
}

bool is_printed_as(const Value& value, float number) {
    return is_printed_as(value, as_printed(number));
}

}  // namespace panelgate::points
