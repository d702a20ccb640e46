#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor {

/// Returns the station that a finding names: unlisted stations share entry 0 and have none.
inline std::optional<std::uint8_t> named(std::uint8_t station) {
    if (station == 0) return std::nullopt;
    return station;
}

/// State of one diagnosis. Rules add to `findings`, and look at earlier ones: explained damage is
/// not reported as noise as well.
struct Case {
    const LineFacts& facts;
    const Sample& window;
    arbiter::Symptoms all;                 ///< of all stations
    const std::vector<Finding>& standing;  ///< findings of the previous look
    std::vector<Finding> findings;

    bool is_standing(Cause cause, std::optional<std::uint8_t> station = {}) const {
        return std::ranges::any_of(
            standing, [&](const Finding& f) { return f.cause == cause && f.station == station; });
    }
    bool has(Cause cause) const {
        return std::ranges::any_of(findings, [&](const Finding& f) { return f.cause == cause; });
    }
    bool has(Cause cause, std::uint8_t station) const {
        return std::ranges::any_of(findings, [&](const Finding& f) {
            return f.cause == cause && f.station == named(station);
        });
    }
    bool has_of_line(Cause cause) const { return has(cause, 0); }
    void add(Cause cause, std::optional<std::uint8_t> station, std::string text, std::string advice,
             std::string evidence, Figures figures) {
        findings.push_back({cause, station, std::move(text), std::move(advice), std::move(evidence),
                            std::move(figures)});
    }
};

/// How much evidence one finding needs: about half if it is already standing.
struct Bar {
    Bar(const Case& c, Cause cause, std::optional<std::uint8_t> station = {})
        : low(c.is_standing(cause, station)) {}

    /// Required number of observations.
    std::uint64_t enough(std::uint64_t to_appear) const {
        return low ? std::max<std::uint64_t>(1, to_appear / 2) : to_appear;
    }
    bool low = false;
};

/// True if its damage is explained: the frames are right, in another encoding.
inline bool explained_by_frames(const Case& c, std::uint8_t station) {
    return c.has(Cause::wrong_crc_order, station) || c.has(Cause::ascii_lower_case, station) ||
           c.has(Cause::ascii_delimiters, station);
}

/// True if most damaged replies have only lost their first bytes.
inline bool loses_beginnings(const arbiter::Symptoms& s) {
    return s.beheaded >= 3 && s.beheaded * 2 >= s.damaged();
}
inline constexpr const char* kLostBeginnings =
    "Replies lose their first bytes: see whether the adapter listens again soon enough after it "
    "has sent.";

/// Returns what of `count` is beyond `explained`.
inline std::uint64_t beyond(std::uint64_t count, std::uint64_t explained) {
    return count - std::min(count, explained);
}

/// Returns how many late replies of stations other than `except` were not heard as such: each may
/// have damaged another station's reply, or have come as stray bytes.
std::uint64_t unheard_late_replies(const Case& c, std::optional<std::uint8_t> except = {});

/// Returns how many attempts to stations other than `except` were answered by another address, as
/// far as that may have been `except`; as many again may have come too late to be noticed as such.
std::uint64_t misaddressed_elsewhere(const Case& c, std::uint8_t except);

/// Returns the cause of damage in all replies: Cause::wrong_parity, wrong_baud or noise.
Cause cause_of_damage(const Case& c, const arbiter::Symptoms& symptoms);

// Each adds at most one finding per line or station. When it is asked, and beside what it is not
// named, is the table in diagnose.cpp.
void find_echo(Case& c);
void find_telnet(Case& c);
void find_no_answer(Case& c);
void find_other_master(Case& c);
void find_collision(Case& c);
void find_overrun(Case& c);
void find_trailing_bytes(Case& c);
void find_crc_order(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_lower_case(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_delimiters(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_all_damaged(Case& c);
void find_noise(Case& c);
void find_tcp_framing(Case& c);
void find_wrong_exception(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_broadcast_replies(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_wrong_reply(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_duplicate_address(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_damage(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_short_timeout(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_short_gap(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_unasked_frames(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_silent_station(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_repeated_requests(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_missed_requests(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);

/// "12 of 345 replies (3.5 %)"
std::string share_text(std::uint64_t part, std::uint64_t whole, const char* what);
/// "32ms", as the configuration writes it; rounded up.
std::string duration_text(Duration duration);
/// Describes the damage: "10 of right length, 2 shorter, …"; with the driver's error counts.
std::string damage_text(const Case& c, const arbiter::Symptoms& symptoms);
/// Counts of damaged replies, of all replies, and of damaged ones by length.
Figures damage_figures(const arbiter::Symptoms& symptoms);
/// The number in duration_text().
std::uint64_t whole_ms(Duration duration);
/// Its name ("press"), else "station 7", or a phrase for unlisted stations; `first`: it begins a
/// sentence.
std::string station_text(const Case& c, std::uint8_t station, bool first = false);

}  // namespace panelgate::doctor
