#include "ration.hpp"

#include <algorithm>

namespace panelgate::web {

Duration Ration::take(TimePoint now, const std::string& address, std::size_t bytes) {
    if (used_until_.size() >= settings_.addresses)
        std::erase_if(used_until_, [&](const auto& entry) { return entry.second <= now; });
    TimePoint& used = used_until_[address];
    const Duration cost = settings_.request + Duration(1s) * bytes / settings_.bytes_a_second;
    used = std::min(std::max(used, now) + cost, now + settings_.burst + settings_.longest_wait);
    return std::max(used - now - settings_.burst, Duration::zero());
}

}  // namespace panelgate::web
