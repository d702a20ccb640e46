#pragma once

#include <chrono>

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

}  // namespace panelgate
