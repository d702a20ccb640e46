#include "panelgate/rt/descriptors.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace panelgate::rt {

std::size_t raise_descriptor_limit() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return std::numeric_limits<std::size_t>::max();
    const rlimit raised{limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    return limit.rlim_cur;
}

std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked) {
    const std::size_t sum = std::accumulate(asked.begin(), asked.end(), std::size_t{0});
    if (sum <= available) return asked;
    const double part = static_cast<double>(available) / static_cast<double>(sum);
    std::vector<std::size_t> granted;
    for (const std::size_t wish : asked) {
        const auto share = static_cast<std::size_t>(static_cast<double>(wish) * part);
        granted.push_back(std::max(share, std::size_t{1}));
    }
    return granted;
}

}  // namespace panelgate::rt
