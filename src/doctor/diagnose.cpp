#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "rules.hpp"

namespace panelgate::doctor {

namespace {

using S = arbiter::Symptoms;

using Count = std::uint64_t S::*;
using Counts = std::array<Count, 4>;
using Causes = std::uint32_t;  // a set

constexpr Causes bit(Cause cause) { return Causes{1} << static_cast<unsigned>(cause); }
template <class... Cause>
constexpr Causes causes(Cause... some) {
    return (Causes{0} | ... | bit(some));
}

struct Row {
    Cause cause;
    Counts needs;     ///< one of these counters is not 0; empty: no counter shows the cause
    Causes excludes;  ///< it is not named beside these, of the line or of the same station
    void (*of_line)(Case&);
    void (*of_station)(Case&, std::uint8_t, const S&);
    Causes anywhere = 0;  ///< ... nor beside these, of any station
};

constexpr Row line(Cause cause, Counts needs, Causes excludes, void (*find)(Case&),
                   Causes anywhere = 0) {
    return {cause, needs, excludes, find, nullptr, anywhere};
}
constexpr Row station(Cause cause, Counts needs, Causes excludes,
                      void (*find)(Case&, std::uint8_t, const S&)) {
    return {cause, needs, excludes, nullptr, find};
}

using enum Cause;

constexpr Counts kDamage{&S::damaged_exact, &S::damaged_short, &S::damaged_long};
constexpr Counts kUnanswered{&S::silent, &S::disturbed};
/// The bytes of all are wrong.
constexpr Causes kFormat = causes(wrong_baud, wrong_parity);
/// The frames are right, in another encoding.
constexpr Causes kEncoding = causes(wrong_crc_order, ascii_lower_case, ascii_delimiters);
/// Others send.
constexpr Causes kSenders = causes(echo, other_master, collision);

/// The causes, the counters that each cause needs, and the causes that exclude the cause. A row
/// sees the findings of the rows above; the row's function has the thresholds of its counters.
constexpr Row kRows[] = {
    station(repeats_requests, {&S::echoes}, {}, find_repeated_requests),
    line(echo, {&S::echoes, &S::collided}, {}, find_echo, causes(repeats_requests)),
    line(telnet, {}, {}, find_telnet),
    line(no_answer_at_all, kUnanswered, {}, find_no_answer),
    line(other_master, {&S::requests, &S::unasked}, {}, find_other_master),
    line(collision, {&S::collided}, causes(echo), find_collision, causes(repeats_requests)),
    line(overrun, {}, {}, find_overrun),
    station(wrong_crc_order, {&S::crc_swapped}, {}, find_crc_order),
    station(ascii_lower_case, {&S::lower_case}, {}, find_lower_case),
    station(ascii_delimiters, {&S::delimited}, {}, find_delimiters),
    line(wrong_baud, kDamage, causes(echo, telnet), find_all_damaged),
    line(trailing_bytes, {&S::trailed}, causes(echo, telnet, other_master), find_trailing_bytes),
    station(wrong_exception, {&S::wrong_exceptions}, {}, find_wrong_exception),
    station(wrong_reply, {&S::wrong, &S::misaddressed}, causes(wrong_exception), find_wrong_reply),
    station(answers_broadcasts, {&S::broadcast_replies}, {}, find_broadcast_replies),
    station(duplicate_address, {&S::doubled, &S::unasked}, causes(echo) | kFormat | kEncoding,
            find_duplicate_address),
    station(damaged_replies, kDamage, causes(echo, telnet, duplicate_address) | kFormat | kEncoding,
            find_damage),
    station(timeout_too_short, {&S::late}, causes(other_master), find_short_timeout),
    station(gap_too_short, kUnanswered, causes(timeout_too_short), find_short_gap),
    station(unasked_frames, {&S::unasked}, kSenders | causes(duplicate_address),
            find_unasked_frames),
    station(station_silent, kUnanswered,
            causes(no_answer_at_all, wrong_reply, wrong_exception, timeout_too_short),
            find_silent_station),
    line(tcp_framing, kDamage, kSenders | kFormat | causes(telnet), find_tcp_framing),
    line(noise, {&S::damaged_exact, &S::damaged_short, &S::damaged_long, &S::strays},
         kSenders | kFormat | causes(telnet, tcp_framing), find_noise),
    station(misses_requests, {&S::silences},
            kSenders | kFormat | kEncoding |
                causes(no_answer_at_all, noise, tcp_framing, damaged_replies, duplicate_address,
                       timeout_too_short, gap_too_short, station_silent, wrong_reply),
            find_missed_requests),
};

bool is_counted(const Counts& needs, const S& counted) {
    return !needs.front() || std::ranges::any_of(needs, [&](Count count) {
        return count != nullptr && counted.*count > 0;
    });
}

bool is_excluded(const Case& c, const Row& row, std::uint8_t station) {
    return std::ranges::any_of(c.findings, [&](const Finding& f) {
        const bool here = !f.station || f.station == named(station);
        return ((here ? row.excludes | row.anywhere : row.anywhere) & bit(f.cause)) != 0;
    });
}

void look(Case& c, const Row& row) {
    if (row.of_line != nullptr) {
        if (is_counted(row.needs, c.all) && !is_excluded(c, row, 0)) row.of_line(c);
        return;
    }
    for (const auto& [id, counted] : c.window.stations) {
        if (is_counted(row.needs, counted) && !is_excluded(c, row, id))
            row.of_station(c, id, counted);
    }
}

}  // namespace

std::vector<Finding> diagnose(const LineFacts& facts, const Sample& window,
                              const std::vector<Finding>& standing) {
    Case c{facts, window, window.total(), standing, {}};
    for (const Row& row : kRows) look(c, row);
    std::ranges::sort(c.findings, {},
                      [](const Finding& f) { return std::tuple(f.cause, f.station); });
    return std::move(c.findings);
}

}  // namespace panelgate::doctor
