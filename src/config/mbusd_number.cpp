#include "mbusd_number.hpp"

#include <charconv>
#include <limits>

namespace panelgate::config {
namespace {

bool is_hex_digit(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

int base_of(std::string_view digits) {
    if (digits.size() < 2 || digits[0] != '0') return 10;
    const bool is_hex =
        digits.size() > 2 && (digits[1] == 'x' || digits[1] == 'X') && is_hex_digit(digits[2]);
    return is_hex ? 16 : 8;
}

}  // namespace

std::optional<MbusdNumber> mbusd_number(std::string_view text) {
    std::string_view digits = text.substr(text.starts_with('+') ? 1 : 0);
    const int base = base_of(digits);
    if (base == 16) digits.remove_prefix(2);
    std::uint32_t value = 0;
    const char* end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, value, base);
    constexpr std::uint32_t kMost = std::numeric_limits<std::int32_t>::max();
    if (error != std::errc() || value > kMost) return std::nullopt;
    return MbusdNumber{value, base == 10 && stop == end};
}

}  // namespace panelgate::config
