#include "panelgate/base/time.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <system_error>

namespace panelgate {

std::string rfc3339(WallTime time) {
    const auto day = std::chrono::floor<std::chrono::days>(time);
    const std::chrono::year_month_day date(day);
    const std::chrono::hh_mm_ss clock(time - day);
    std::array<char, 48> text{};
    const int size = std::snprintf(
        text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%06dZ",
        static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
        static_cast<unsigned>(date.day()), static_cast<int>(clock.hours().count()),
        static_cast<int>(clock.minutes().count()), static_cast<int>(clock.seconds().count()),
        static_cast<int>(clock.subseconds().count()));
    return {text.data(), static_cast<std::size_t>(size)};
}

std::optional<int> take_number(std::string_view& text, std::size_t width) {
    if (text.size() < width) return std::nullopt;
    int number = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + width, number);
    if (wrong != std::errc{} || end != text.data() + width || number < 0) return std::nullopt;
    text.remove_prefix(width);
    return number;
}

std::optional<std::chrono::sys_days> take_day(std::string_view& text) {
    std::array<int, 3> date{};
    for (std::size_t i = 0; i < date.size(); ++i) {
        if (i > 0 && !text.starts_with('-')) return std::nullopt;
        if (i > 0) text.remove_prefix(1);
        const auto number = take_number(text, i == 0 ? 4 : 2);
        if (!number) return std::nullopt;
        date[i] = *number;
    }
    const std::chrono::year_month_day day(std::chrono::year{date[0]},
                                          std::chrono::month(static_cast<unsigned>(date[1])),
                                          std::chrono::day(static_cast<unsigned>(date[2])));
    if (!day.ok()) return std::nullopt;
    return std::chrono::sys_days(day);
}

namespace {

/// Takes a number of two digits, up to `most`, behind `separator` off.
bool take_two(std::string_view& text, char separator, int most, int& value) {
    if (!text.starts_with(separator)) return false;
    text.remove_prefix(1);
    const auto number = take_number(text, 2);
    value = number.value_or(0);
    return number && value <= most;
}

/// "Z", "+01:00", or nothing for UTC; its minutes.
std::optional<int> zone_of(std::string_view text) {
    if (text.empty() || text == "Z" || text == "z") return 0;
    const bool before = text.front() == '-';
    int hours = 0;
    int minutes = 0;
    if (!take_two(text, before ? '-' : '+', 14, hours) || !take_two(text, ':', 59, minutes))
        return std::nullopt;
    if (!text.empty()) return std::nullopt;
    return (before ? -1 : 1) * (hours * 60 + minutes);
}

/// Takes ".25" off, up to a microsecond; nullopt if no digit follows the point.
std::optional<std::chrono::microseconds> take_fraction(std::string_view& text) {
    std::chrono::microseconds fraction{};
    if (!text.starts_with('.')) return fraction;
    const std::size_t end = std::min(text.find_first_not_of("0123456789", 1), text.size());
    if (end < 2) return std::nullopt;
    std::chrono::microseconds digit = std::chrono::milliseconds(100);
    for (const char c : text.substr(1, end - 1)) {
        fraction += (c - '0') * digit;
        digit /= 10;
    }
    text.remove_prefix(end);
    return fraction;
}

}  // namespace

std::optional<WallTime> parse_rfc3339(std::string_view text) {
    const auto day = take_day(text);
    int hour = 0;
    int minute = 0;
    int second = 0;
    if (!day || text.empty() || std::string_view("Tt ").find(text.front()) == text.npos)
        return std::nullopt;
    if (!take_two(text, text.front(), 23, hour) || !take_two(text, ':', 59, minute))
        return std::nullopt;
    if (text.starts_with(':') && !take_two(text, ':', 60, second)) return std::nullopt;
    const auto fraction = take_fraction(text);
    const auto zone = fraction ? zone_of(text) : std::nullopt;
    if (!zone) return std::nullopt;
    return WallTime(day->time_since_epoch()) + std::chrono::hours(hour) +
           std::chrono::minutes(minute - *zone) + std::chrono::seconds(second) + *fraction;
}

}  // namespace panelgate
