#include "panelgate/base/number_text.hpp"

#include <charconv>
#include <cmath>
#include <system_error>

namespace panelgate {
namespace {

template <class Number>
std::string shortest(Number value) {
    if (!std::isfinite(value)) return {};
    if (value == 0) return "0";
    const Number size = std::abs(value);
    const bool plain = size >= Number(1e-4) && size < Number(1e16);
    char buffer[64];
    const auto format = plain ? std::chars_format::fixed : std::chars_format::scientific;
    const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value, format);
    return error == std::errc() ? std::string(buffer, end) : std::string();
}

}  // namespace

std::string number_text(double value) { return shortest(value); }
std::string number_text(float value) { return shortest(value); }

double as_printed(float value) {
    if (value == 0) return static_cast<double>(value);  // keeps its sign
    const std::string text = number_text(value);
    double printed = static_cast<double>(value);
    std::from_chars(text.data(), text.data() + text.size(), printed);
    return printed;
}

}  // namespace panelgate
