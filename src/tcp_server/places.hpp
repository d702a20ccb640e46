#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "panelgate/base/time.hpp"

namespace panelgate::tcp_server {

/// An open connection, as far as its place is concerned.
struct Guest {
    std::uint64_t host = 0;  ///< its address
    bool idle = false;       ///< nothing is outstanding, or only half a request that does not go on
    TimePoint heard{};       ///< its last input
};

struct PlaceLimits {
    std::size_t in_all = 0;
    std::size_t of_address = 0;
};

/// What a new connection finds.
struct Place {
    bool found = false;
    std::optional<std::size_t> taken_from;  ///< the guest that gives way
    bool share_used = false;                ///< its address has all the places it may have
    std::size_t own = 0;                    ///< guests of its address
};

/// Finds a place for a connection of the address `newcomer` (P9). Below the limits it is free;
/// beyond them:
/// - An address that has its share loses its own longest idle connection, never one with something
///   outstanding: then the newcomer is refused.
/// - In a full house the address with most connections loses one, its longest idle. If all of them
///   are busy, it loses the one that was heard longest ago, but only to an address without any
///   connection, or with two less: an address that leaks connections, or holds them with requests
///   or half of one, would lock the others out, and two equal ones would take each other's in
///   turns. Not the newest, because that is the one that a leaking client uses: the others have no
///   reader any more, or wait for a line that another connection will not make faster.
/// So an address without a connection always finds a place. Pure.
Place find_place(std::span<const Guest> guests, std::uint64_t newcomer, const PlaceLimits& limits);

}  // namespace panelgate::tcp_server
