#include "panelgate/rt/clock.hpp"

#include <chrono>
#include <ctime>

namespace panelgate::rt {

WallTime wall_now() {
    return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

double wall_seconds() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

std::int64_t local_wall_seconds() {
    const std::time_t utc = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm local{};
    localtime_r(&utc, &local);
    return static_cast<std::int64_t>(utc) + local.tm_gmtoff;
}

}  // namespace panelgate::rt
