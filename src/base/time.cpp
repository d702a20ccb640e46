#include "panelgate/base/time.hpp"

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

}  // namespace panelgate
