#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate {

/// A decimal number, exactly: digits * 10^exponent. What people write, and what 64 bits and a scale
/// make, has more digits than a double holds.
class Decimal {
  public:
    Decimal() = default;  ///< 0
    // Implicit, as a number is one in every form that it may have.
    Decimal(int number) : Decimal(static_cast<std::int64_t>(number)) {}
    Decimal(std::int64_t number);
    Decimal(std::uint64_t number);
    /// The shortest digits that mean this double, which must be finite.
    Decimal(double number);
    /// The first digits of what a double is, which must be finite: as many as a whole number has
    /// below 1e60, when none are named.
    static Decimal exactly(double number, int digits = 60);
    /// "-12.50e3". Nothing for other texts, and for numbers beyond 1e400 or below 1e-400. Of more
    /// digits than 60 the rest counts as "a little more": enough to order and to round.
    static std::optional<Decimal> parse(std::string_view text);

    bool is_whole() const { return exponent_ >= 0; }
    /// Of the last digit; 0 of 0.
    int exponent() const { return exponent_; }
    /// Significant ones; 0 has none.
    std::size_t digits() const { return digits_.size(); }
    /// As number_text() writes, but with all digits; up to 1e21 without an exponent where a double
    /// could not have as many.
    std::string text() const;
    /// The nearest double.
    double nearest() const;
    /// Nothing for a fraction and for what does not fit.
    std::optional<std::int64_t> as_int64() const;
    std::optional<std::uint64_t> as_uint64() const;

    friend bool operator==(const Decimal&, const Decimal&) = default;
    friend std::strong_ordering operator<=>(const Decimal& left, const Decimal& right);
    friend Decimal operator*(const Decimal& left, const Decimal& right);
    friend Decimal operator+(const Decimal& left, const Decimal& right);
    Decimal operator-() const;
    /// * 10^by
    Decimal shifted(int by) const;

    /// Whole numbers around a quotient; both are the quotient where it is whole.
    struct Around;
    /// Not by 0.
    Around divided_by(const Decimal& divisor) const;

  private:
    static Decimal made(bool negative, std::string digits, int exponent);
    /// Of the first digit.
    int magnitude() const { return static_cast<int>(digits_.size()) + exponent_ - 1; }
    std::string whole_text() const;

    bool negative_ = false;
    std::string digits_;  ///< no zeros in front or behind; of 0 none
    int exponent_ = 0;
};

struct Decimal::Around {
    Decimal below;
    Decimal above;
    Decimal nearest;  ///< of the two; a half goes away from 0
};

}  // namespace panelgate
