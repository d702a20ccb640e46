#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate {

using namespace std::chrono_literals;

/// Monotonic time. Pure code is passed a TimePoint; other code reads an rt::Clock, and only
/// rt/asio_clock.cpp reads the system clock.
using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::nanoseconds;

inline double to_seconds(Duration d) { return std::chrono::duration<double>(d).count(); }
inline double to_milliseconds(Duration d) {
    return std::chrono::duration<double, std::milli>(d).count();
}

/// Wall-clock time: for users and logs, never for timing.
using WallTime = std::chrono::sys_time<std::chrono::microseconds>;

/// Formats RFC 3339 in UTC: "2026-11-22T07:15:19.000250Z".
std::string rfc3339(WallTime time);
/// Parses a day and a time as in RFC 3339: "2026-11-22T07:15:19.25+01:00"; seconds and zone may
/// lack, a blank may stand for the T. Digits behind microseconds do not count.
std::optional<WallTime> parse_rfc3339(std::string_view text);
/// Takes a number of `width` digits off the front of the text; nothing if it does not begin so.
std::optional<int> take_number(std::string_view& text, std::size_t width);
/// Takes a day, "2026-11-22", off; nothing if the text begins with none.
std::optional<std::chrono::sys_days> take_day(std::string_view& text);

/// Converts `then` to wall-clock time, where `wall` is the wall-clock time at `now`.
inline WallTime wall_time_of(TimePoint then, TimePoint now, WallTime wall) {
    return wall - std::chrono::floor<std::chrono::microseconds>(now - then);
}

/// Seconds since 1970.
inline double wall_seconds_of(WallTime time) {
    return std::chrono::duration<double>(time.time_since_epoch()).count();
}

}  // namespace panelgate
