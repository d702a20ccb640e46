#include "places.hpp"

#include <algorithm>
#include <map>

namespace panelgate::tcp_server {
namespace {

/// Idle ones first, then the one heard longest ago.
bool gives_way_before(const Guest& one, const Guest& other) {
    if (one.idle != other.idle) return one.idle;
    return one.heard < other.heard;
}

/// Returns the first to give way of those that may.
template <class May>
std::optional<std::size_t> first_to_give_way(std::span<const Guest> guests, May may) {
    std::optional<std::size_t> first;
    for (std::size_t i = 0; i < guests.size(); ++i) {
        if (!may(guests[i])) continue;
        if (!first || gives_way_before(guests[i], guests[*first])) first = i;
    }
    return first;
}

std::optional<std::size_t> longest_idle_of(std::span<const Guest> guests, std::uint64_t host) {
    return first_to_give_way(guests,
                             [host](const Guest& one) { return one.idle && one.host == host; });
}

/// Chooses for an address that has `own` of the places. Of several with as many, the first to give
/// way loses its place.
std::optional<std::size_t> one_of_the_most(std::span<const Guest> guests, std::uint64_t newcomer,
                                           std::size_t own) {
    std::map<std::uint64_t, std::size_t> counts;
    std::size_t most = 0;
    for (const Guest& guest : guests) most = std::max(most, ++counts[guest.host]);
    if (most <= own) return longest_idle_of(guests, newcomer);
    const bool also_busy = own == 0 || most > own + 1;
    return first_to_give_way(guests, [&counts, most, also_busy](const Guest& one) {
        return counts.at(one.host) == most && (one.idle || also_busy);
    });
}

}  // namespace

Place find_place(std::span<const Guest> guests, std::uint64_t newcomer, const PlaceLimits& limits) {
    Place place;
    place.own = static_cast<std::size_t>(std::ranges::count(guests, newcomer, &Guest::host));
    place.share_used = place.own >= limits.of_address;
    if (place.share_used) {
        place.taken_from = longest_idle_of(guests, newcomer);
    } else if (guests.size() >= limits.in_all) {
        place.taken_from = one_of_the_most(guests, newcomer, place.own);
    } else {
        place.found = true;
    }
    place.found = place.found || place.taken_from;
    return place;
}

}  // namespace panelgate::tcp_server
