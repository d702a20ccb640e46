#pragma once

#include <chrono>
#include <string>

namespace panelgate {

using namespace std::chrono_literals;

/// Monotonic time. Pure code is given a TimePoint; shells ask an rt::Clock for one, and only
/// rt/asio_clock.cpp asks the machine.
using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::nanoseconds;

inline double to_seconds(Duration d) { return std::chrono::duration<double>(d).count(); }
inline double to_milliseconds(Duration d) {
    return std::chrono::duration<double, std::milli>(d).count();
}

/// Time by the clock on the wall: for people and logs, never for timing.
using WallTime = std::chrono::sys_time<std::chrono::microseconds>;

/// RFC 3339 in UTC: "2026-11-22T07:15:19.000250Z".
std::string rfc3339(WallTime time);

/// What the wall showed at `then`, when it shows `wall` at `now`.
inline WallTime wall_time_of(TimePoint then, TimePoint now, WallTime wall) {
    return wall - std::chrono::floor<std::chrono::microseconds>(now - then);
}

/// Since 1970.
inline double wall_seconds_of(WallTime time) {
    return std::chrono::duration<double>(time.time_since_epoch()).count();
}

}  // namespace panelgate
