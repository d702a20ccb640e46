#include "panelgate/base/decimal.hpp"

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <charconv>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace panelgate {
namespace {

using boost::multiprecision::cpp_int;

constexpr std::size_t kMostDigits = 60;
constexpr int kMostMagnitude = 400;

/// cpp_int rejects an empty text and reads a leading 0 as octal.
cpp_int number_of(const std::string& digits) { return cpp_int(digits.empty() ? "0" : digits); }

cpp_int tens(int count) {
    return boost::multiprecision::pow(cpp_int(10), static_cast<unsigned>(count));
}

template <class Whole>
std::optional<Whole> whole_of(const std::string& text) {
    Whole number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

bool are_digits(std::string_view text) {
    return std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

template <class... Format>
Decimal printed(double number, Format... format) {
    std::array<char, 96> text{};
    const auto [end, error] =
        std::to_chars(text.data(), text.data() + text.size(), number, format...);
    if (error != std::errc()) std::abort();
    return Decimal::parse({text.data(), end}).value_or(Decimal());
}

}  // namespace

Decimal::Decimal(std::int64_t number) {
    std::string text = std::to_string(number);
    if (number < 0) text.erase(0, 1);
    *this = made(number < 0, std::move(text), 0);
}

Decimal::Decimal(std::uint64_t number) : Decimal(made(false, std::to_string(number), 0)) {}

Decimal::Decimal(double number) : Decimal(printed(number, std::chars_format::scientific)) {}

Decimal Decimal::exactly(double number, int digits) {
    return printed(number, std::chars_format::scientific, digits - 1);
}

Decimal Decimal::made(bool negative, std::string digits, int exponent) {
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
    const std::size_t last = digits.find_last_not_of('0');
    const std::size_t kept = last == digits.npos ? 0 : last + 1;
    exponent += static_cast<int>(digits.size() - kept);
    digits.resize(kept);
    Decimal result;
    if (digits.empty()) return result;
    result.negative_ = negative;
    result.digits_ = std::move(digits);
    result.exponent_ = exponent;
    return result;
}

std::optional<Decimal> Decimal::parse(std::string_view text) {
    const bool negative = text.starts_with('-');
    if (negative || text.starts_with('+')) text.remove_prefix(1);
    const std::size_t mark = std::min(text.find_first_of("eE"), text.size());
    const std::size_t point = std::min(text.find('.'), mark);
    std::int64_t exponent = 0;
    if (mark < text.size()) {
        std::string power(text.substr(mark + 1));
        if (power.starts_with('+')) power.erase(0, 1);
        const auto given = whole_of<std::int32_t>(power);
        if (!given) return std::nullopt;
        exponent = *given;
    }
    std::string digits(text.substr(0, point));
    if (point < mark) digits += text.substr(point + 1, mark - point - 1);
    if (point < mark) exponent -= static_cast<std::int64_t>(mark - point - 1);
    if (digits.empty() || !are_digits(digits)) return std::nullopt;
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
    if (digits.empty()) return Decimal();
    const std::int64_t magnitude = static_cast<std::int64_t>(digits.size()) + exponent - 1;
    if (std::abs(magnitude) > kMostMagnitude) return std::nullopt;
    if (digits.size() > kMostDigits) {
        const bool more = digits.find_first_not_of('0', kMostDigits) != digits.npos;
        exponent += static_cast<std::int64_t>(digits.size() - kMostDigits - 1);
        digits.resize(kMostDigits);
        digits += more ? '1' : '0';
    }
    return made(negative, std::move(digits), static_cast<int>(exponent));
}

std::string Decimal::whole_text() const {
    std::string text = digits_;
    if (exponent_ > 0) text.append(static_cast<std::size_t>(exponent_), '0');
    if (text.empty()) return "0";
    return (negative_ ? "-" : "") + text;
}

std::string Decimal::text() const {
    constexpr int kPlain = 16;
    constexpr int kPlainManyDigits = 21;
    constexpr std::size_t kMany = 15;
    const int size = magnitude();
    const bool many = digits_.size() > kMany && size < kPlainManyDigits;
    if (is_whole() && (size < kPlain || many)) return whole_text();
    std::string text = digits_;
    if (size < -4 || (size >= kPlain && !many)) {
        if (text.size() > 1) text.insert(1, ".");
        const std::string power = std::to_string(std::abs(size));
        text += (size < 0 ? "e-" : "e+") + (power.size() < 2 ? "0" + power : power);
    } else if (size < 0) {
        text = "0." + std::string(static_cast<std::size_t>(-size - 1), '0') + text;
    } else {
        text.insert(static_cast<std::size_t>(size) + 1, ".");
    }
    return (negative_ ? "-" : "") + text;
}

double Decimal::nearest() const {
    const std::string digits = (negative_ ? "-0" : "0") + digits_ + 'e' + std::to_string(exponent_);
    double number = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return number;
}

std::optional<std::int64_t> Decimal::as_int64() const {
    if (!is_whole() || magnitude() > 20) return std::nullopt;
    return whole_of<std::int64_t>(whole_text());
}

std::optional<std::uint64_t> Decimal::as_uint64() const {
    if (!is_whole() || negative_ || magnitude() > 20) return std::nullopt;
    return whole_of<std::uint64_t>(whole_text());
}

Decimal Decimal::shifted(int by) const { return made(negative_, digits_, exponent_ + by); }

Decimal Decimal::operator-() const {
    Decimal result = *this;
    result.negative_ = !negative_ && !digits_.empty();
    return result;
}

std::strong_ordering operator<=>(const Decimal& left, const Decimal& right) {
    const auto sign = [](const Decimal& one) {
        return one.digits_.empty() ? 0 : one.negative_ ? -1 : 1;
    };
    if (sign(left) != sign(right)) return sign(left) <=> sign(right);
    const Decimal& small = left.negative_ ? right : left;
    const Decimal& large = left.negative_ ? left : right;
    if (small.magnitude() != large.magnitude()) return small.magnitude() <=> large.magnitude();
    return small.digits_ <=> large.digits_;
}

Decimal operator*(const Decimal& left, const Decimal& right) {
    const cpp_int product = number_of(left.digits_) * number_of(right.digits_);
    return Decimal::made(left.negative_ != right.negative_, product.str(),
                         left.exponent_ + right.exponent_);
}

Decimal operator+(const Decimal& left, const Decimal& right) {
    const int exponent = std::min(left.exponent_, right.exponent_);
    const auto whole = [&](const Decimal& one) {
        const cpp_int size = number_of(one.digits_) * tens(one.exponent_ - exponent);
        return one.negative_ ? cpp_int(-size) : size;
    };
    const cpp_int sum = whole(left) + whole(right);
    return Decimal::made(sum < 0, cpp_int(abs(sum)).str(), exponent);
}

Decimal::Around Decimal::divided_by(const Decimal& divisor) const {
    const int shift = exponent_ - divisor.exponent_;
    cpp_int number = number_of(digits_);
    cpp_int by = number_of(divisor.digits_);
    (shift > 0 ? number : by) *= tens(std::abs(shift));
    const cpp_int least = number / by;
    const cpp_int rest = number % by;
    // Computed on magnitudes: below and above swap for a negative quotient.
    const bool negative = negative_ != divisor.negative_;
    const Decimal inner = made(negative, least.str(), 0);
    const Decimal outer = rest == 0 ? inner : made(negative, cpp_int(least + 1).str(), 0);
    const Decimal& nearest = rest * 2 >= by ? outer : inner;
    return {negative ? outer : inner, negative ? inner : outer, rest == 0 ? inner : nearest};
}

}  // namespace panelgate
