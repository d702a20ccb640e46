#include "pace.hpp"

#include <algorithm>

namespace panelgate::tls {
namespace {

constexpr std::size_t kRemembered = 256;
constexpr Duration kAtOnce = 250ms;  // the share of this time may begin at once

/// The generic cell rate algorithm (ITU-T I.371): `due` is when the next one is expected.
Duration take(TimePoint& due, TimePoint now, Duration between) {
    due = std::max(due, now) + between;
    return std::max(due - now - kAtOnce, Duration::zero());
}

}  // namespace

Pace::Pace(std::size_t of_address_per_second, std::size_t of_all_per_second)
    : of_address_(Duration(1s) / static_cast<Duration::rep>(of_address_per_second)),
      of_all_(Duration(1s) / static_cast<Duration::rep>(of_all_per_second)) {}

Duration Pace::wait(TimePoint now, const std::string& address) {
    if (addresses_.size() >= kRemembered)
        std::erase_if(addresses_, [now](const auto& one) { return one.second <= now; });
    const Duration own = take(addresses_[address], now, of_address_);
    return std::max(own, take(all_, now, of_all_));
}

void Pace::give_back(const std::string& address) {
    all_ -= of_all_;
    const auto found = addresses_.find(address);
    if (found != addresses_.end()) found->second -= of_address_;
}

}  // namespace panelgate::tls
