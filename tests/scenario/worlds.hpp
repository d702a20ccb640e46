#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <vector>

/// What is played, and what for: one row for each world.
namespace panelgate::scenario {

/// What a whole line does.
enum class Kind : std::uint8_t {
    faults,
    station,
    echo,
    dead,
    crowd,
    adaptive,
    voices,    ///< sound panels, oddly spoken
    receiver,  ///< echoes of every sort
    company,   ///< others on the wire
    loss,      ///< line, process and clients come and go
    stall,     ///< RTU over TCP that holds frames back
    flood,     ///< one host against many
    mass,      ///< several panels die in one instant
    writers,   ///< endless writes
    wild,      ///< all of it
    beyond     ///< replies that are later than the automatic late window reaches
};

/// What exactly one panel of a line does, or the way to that panel.
enum class Oddity : std::uint8_t {
    none,
    wrong_function,
    padded_inside,
    padded_behind,
    doubled,
    tails,
    fragments,
    glitches,
    holes,
    naps,
    mute,
    drops,
    flips,
    reboots,
    babbles,
    answers_broadcasts,
    broadcasts_late,
    dies,
    refuses_long,
    ignores_long,
    outlives_connection,
    pauses,         ///< ignores what comes too soon behind its own reply
    quick,          ///< answers before the request can have left, as far as anybody computes
    neighbours,     ///< it dies; the others wait for its reply, as libmodbus's server does
    overtakes,      ///< its late replies overtake each other
    copies_seldom,  ///< a copy of few replies, which meets the next request
    unasked,        ///< a frame too many, and its answers may be one behind
    repeats_last,   ///< the same with a reply once more
    held_frames,    ///< the adapter hands over a reply once more behind the next request's begin
    confirms_last,  ///< the last confirmation of the function, in place of a write that is not done
    confirms_again,  ///< each confirmation once more, half a second later; deaf to some writes
    answers_twice,   ///< a second panel's values come behind its own
    writes_echoed,   ///< and it is deaf to some
    echoed_twice,    ///< the same of an echo of all requests
    repeats_requests,
    misnumbers,     ///< refuses late, with another function's number
    refuses_first,  ///< an exception, and the reply behind it
    damaged_first,
};

/// What cannot be promised: a row of docs/how/limits.md each.
enum class Limit : std::uint8_t {
    none,
    late_beyond_window,
    overtaking,
    copies_first,
    one_behind,
    early,
    confirmations,
    two_answers,
    echo_kinds,
    misnumbered,
    damaged_repeated
};
inline constexpr std::string_view kLimitNames[] = {
    "none",          "late_beyond_window", "overtaking", "copies_first", "one_behind",      "early",
    "confirmations", "two_answers",        "echo_kinds", "misnumbered",  "damaged_repeated"};
constexpr std::string_view label(Limit limit) {
    return kLimitNames[static_cast<std::size_t>(limit)];
}

/// T1 to T14 of docs/how/threats.md, a bit each.
using Threats = std::uint16_t;
constexpr Threats threats(std::same_as<int> auto... numbers) {
    return static_cast<Threats>(((1u << numbers) | ...));
}

/// A world is played for threats, and then no violation is tolerated, or for one limit, whose rate
/// is measured and may only fall.
template <class World>
struct Row {
    constexpr Row(World what, std::string_view word, Threats holds)
        : world(what), name(word), held(holds) {}
    constexpr Row(World what, std::string_view word, Limit reached)
        : world(what), name(word), limit(reached) {}
    World world;
    std::string_view name;
    Threats held = 0;
    Limit limit = Limit::none;
};

inline constexpr Row<Kind> kKindRows[] = {
    {Kind::faults, "faults", threats(1, 2, 3, 5, 10)},
    {Kind::station, "station", threats(1, 2, 3, 5, 10)},
    {Kind::echo, "echo", threats(1, 2, 3, 6)},
    {Kind::dead, "dead", threats(1)},
    {Kind::crowd, "crowd", threats(1, 2, 3)},
    {Kind::adaptive, "adaptive", threats(1, 2, 3)},
    {Kind::voices, "voices", threats(3, 4, 12, 14)},
    {Kind::receiver, "receiver", threats(3, 4, 6, 12)},
    {Kind::company, "company", threats(3, 5, 9, 12)},
    {Kind::loss, "loss", threats(1, 2, 8)},
    {Kind::stall, "stall", threats(2, 8)},
    {Kind::flood, "flood", threats(14)},
    {Kind::mass, "mass", threats(1)},
    {Kind::writers, "writers", threats(14)},
    {Kind::wild, "wild", threats(1, 2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 14)},
    {Kind::beyond, "beyond", Limit::late_beyond_window},
};

inline constexpr Row<Oddity> kOddityRows[] = {
    {Oddity::wrong_function, "wrong_function", threats(13)},
    {Oddity::padded_inside, "padded_inside", threats(13)},
    {Oddity::padded_behind, "padded_behind", threats(3)},
    {Oddity::doubled, "doubled", threats(12)},
    {Oddity::tails, "tails", threats(3)},
    {Oddity::fragments, "fragments", threats(3)},
    {Oddity::glitches, "glitches", threats(3)},
    {Oddity::holes, "holes", threats(4)},
    {Oddity::naps, "naps", threats(2, 14)},
    {Oddity::mute, "mute", threats(1)},
    {Oddity::drops, "drops", threats(1)},
    {Oddity::flips, "flips", threats(3)},
    {Oddity::reboots, "reboots", threats(1, 3)},
    {Oddity::babbles, "babbles", threats(5, 13)},
    {Oddity::answers_broadcasts, "answers_broadcasts", threats(11)},
    {Oddity::broadcasts_late, "broadcasts_late", threats(11, 14)},
    {Oddity::dies, "dies", threats(1)},
    {Oddity::refuses_long, "refuses_long", threats(10, 14)},
    {Oddity::ignores_long, "ignores_long", threats(14)},
    {Oddity::outlives_connection, "outlives_connection", threats(2, 8)},
    {Oddity::pauses, "pauses", threats(14)},
    {Oddity::quick, "quick", threats(7)},
    {Oddity::neighbours, "neighbours", threats(1)},
    {Oddity::overtakes, "overtakes", Limit::overtaking},
    {Oddity::copies_seldom, "copies_seldom", Limit::copies_first},
    {Oddity::unasked, "unasked", Limit::one_behind},
    {Oddity::repeats_last, "repeats_last", Limit::one_behind},
    {Oddity::held_frames, "held_frames", Limit::early},
    {Oddity::confirms_last, "confirms_last", Limit::confirmations},
    {Oddity::confirms_again, "confirms_again", Limit::confirmations},
    {Oddity::answers_twice, "answers_twice", Limit::two_answers},
    {Oddity::writes_echoed, "writes_echoed", Limit::echo_kinds},
    {Oddity::echoed_twice, "echoed_twice", Limit::echo_kinds},
    {Oddity::repeats_requests, "repeats_requests", Limit::echo_kinds},
    {Oddity::misnumbers, "misnumbers", Limit::misnumbered},
    {Oddity::refuses_first, "refuses_first", Limit::misnumbered},
    {Oddity::damaged_first, "damaged_first", Limit::damaged_repeated},
};

/// The rows are the only list of worlds: a test plays what has a row.
constexpr const Row<Kind>* row_of(Kind kind) {
    const auto* const row = std::ranges::find(kKindRows, kind, &Row<Kind>::world);
    return row == std::end(kKindRows) ? nullptr : row;
}
constexpr const Row<Oddity>* row_of(Oddity oddity) {
    const auto* const row = std::ranges::find(kOddityRows, oddity, &Row<Oddity>::world);
    return row == std::end(kOddityRows) ? nullptr : row;
}
template <class World>
std::string_view label(World world)
    requires std::same_as<World, Kind> || std::same_as<World, Oddity>
{
    if (row_of(world) == nullptr) std::abort();
    return row_of(world)->name;
}

/// The worlds of this limit, or, with Limit::none, those of threats.
inline std::vector<Kind> kinds_of(Limit limit) {
    std::vector<Kind> kinds;
    for (const Row<Kind>& row : kKindRows)
        if (row.limit == limit) kinds.push_back(row.world);
    return kinds;
}
inline std::vector<Oddity> oddities_of(Limit limit) {
    std::vector<Oddity> oddities;
    for (const Row<Oddity>& row : kOddityRows)
        if (row.limit == limit) oddities.push_back(row.world);
    return oddities;
}

namespace check {

constexpr Threats all_held() {
    Threats held = 0;
    for (const Row<Kind>& row : kKindRows) held |= row.held;
    for (const Row<Oddity>& row : kOddityRows) held |= row.held;
    return held;
}
static_assert(all_held() == threats(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14),
              "each threat has a world");

constexpr bool each_has_one_row(const auto& rows, std::size_t first) {
    for (std::size_t i = 0; i < std::size(rows); ++i) {
        if (static_cast<std::size_t>(rows[i].world) != first + i) return false;
        if ((rows[i].held != 0) == (rows[i].limit != Limit::none)) return false;
    }
    return true;
}
static_assert(each_has_one_row(kKindRows, 0));
static_assert(each_has_one_row(kOddityRows, 1), "all but Oddity::none");

}  // namespace check
}  // namespace panelgate::scenario
