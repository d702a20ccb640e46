#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate {

/// An exact decimal number: digits * 10^exponent. User input and scaled 64-bit values can have more
/// digits than a double holds.
class Decimal {
  public:
    Decimal() = default;  ///< 0
    // Implicit: every number type converts.
    Decimal(int number) : Decimal(static_cast<std::int64_t>(number)) {}
    Decimal(std::int64_t number);
    Decimal(std::uint64_t number);
    /// Uses the shortest digits that identify this double, which must be finite.
    Decimal(double number);
    /// Returns the first `digits` significant digits of the exact value of `number`, which must be
    /// finite. The default covers every whole number below 1e60.
    static Decimal exactly(double number, int digits = 60);
    /// Parses "-12.50e3". std::nullopt for other texts and for magnitudes beyond 1e400 or below
    /// 1e-400. Digits after the 60th count as "a little more": enough to order and to round.
    static std::optional<Decimal> parse(std::string_view text);

    bool is_whole() const { return exponent_ >= 0; }
    /// Power of ten of the last digit; 0 for 0.
    int exponent() const { return exponent_; }
    /// Number of significant digits; 0 for zero.
    std::size_t digits() const { return digits_.size(); }
    /// Formats like number_text(), but with all digits; a number with more digits than a double
    /// holds has no exponent below 1e21.
    std::string text() const;
    /// Returns the nearest double.
    double nearest() const;
    /// std::nullopt for a fraction and for a value that does not fit.
    std::optional<std::int64_t> as_int64() const;
    std::optional<std::uint64_t> as_uint64() const;

    friend bool operator==(const Decimal&, const Decimal&) = default;
    friend std::strong_ordering operator<=>(const Decimal& left, const Decimal& right);
    friend Decimal operator*(const Decimal& left, const Decimal& right);
    friend Decimal operator+(const Decimal& left, const Decimal& right);
    Decimal operator-() const;
    /// Returns the number * 10^by.
    Decimal shifted(int by) const;

    /// The whole numbers around a quotient; both equal the quotient if it is whole.
    struct Around;
    /// `divisor` must not be 0.
    Around divided_by(const Decimal& divisor) const;

  private:
    static Decimal made(bool negative, std::string digits, int exponent);
    /// Power of ten of the first digit.
    int magnitude() const { return static_cast<int>(digits_.size()) + exponent_ - 1; }
    std::string whole_text() const;

    bool negative_ = false;
    std::string digits_;  ///< without leading or trailing zeros; empty for 0
    int exponent_ = 0;
};

struct Decimal::Around {
    Decimal below;
    Decimal above;
    Decimal nearest;  ///< of the two; halves round away from 0
};

}  // namespace panelgate
