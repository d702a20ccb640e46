#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/doctor/doctor.hpp"

namespace panelgate::doctor {

/// Whom a finding names: stations that the configuration does not list share entry 0 and have none.
inline std::optional<std::uint8_t> named(std::uint8_t station) {
    if (station == 0) return std::nullopt;
    return station;
}

/// What one diagnosis works on. Rules add to `findings`, and look at what earlier ones have found:
/// damage that is explained is not noise as well.
struct Case {
    const LineFacts& facts;
    const Sample& window;
    arbiter::Symptoms all;                 ///< of all stations
    const std::vector<Finding>& standing;  ///< what was found before
    std::vector<Finding> findings;

    bool stands(Cause cause, std::optional<std::uint8_t> station = {}) const {
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

/// How much evidence one finding needs: about half when it is there already.
struct Bar {
    Bar(const Case& c, Cause cause, std::optional<std::uint8_t> station = {})
        : low(c.stands(cause, station)) {}

    /// How often something must have been seen.
    std::uint64_t enough(std::uint64_t to_appear) const {
        return low ? std::max<std::uint64_t>(1, to_appear / 2) : to_appear;
    }
    bool low = false;
};

/// Its damage is explained: the frames are right, and written in another way.
inline bool is_told_by_its_frames(const Case& c, std::uint8_t station) {
    return c.has(Cause::wrong_crc_order, station) || c.has(Cause::ascii_lower_case, station);
}

/// What only bytes that are all damaged can tell: Cause::wrong_parity, wrong_baud or noise.
Cause cause_of_damage(const Case& c, const arbiter::Symptoms& symptoms);

// Each adds at most one finding a line or a station.
void find_echo(Case& c);
void find_no_answer(Case& c);
void find_other_master(Case& c);
void find_collision(Case& c);
void find_overrun(Case& c);
void find_trailing_bytes(Case& c);
void find_crc_order(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_lower_case(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_all_damaged(Case& c);
void find_noise(Case& c);
void find_tcp_framing(Case& c);
void find_wrong_exception(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_broadcast_replies(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_wrong_reply(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_duplicate_address(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_short_timeout(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_short_gap(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_unasked_frames(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);
void find_silent_station(Case& c, std::uint8_t station, const arbiter::Symptoms& symptoms);

/// "12 of 345 replies (3.5 %)"
std::string share_text(std::uint64_t part, std::uint64_t whole, const char* what);
/// "32ms", as the configuration writes it; rounded up.
std::string duration_text(Duration duration);
/// How the damage looked: "10 of right length, 2 shorter, …"; with the driver's error counts.
std::string damage_text(const Case& c, const arbiter::Symptoms& symptoms);
/// damaged, of replies, and as exact, short or long.
Figures damage_figures(const arbiter::Symptoms& symptoms);
/// As duration_text() has it.
std::uint64_t whole_ms(Duration duration);
/// Its name ("press"), "station 7" without one, or the ones without an entry; first in a sentence.
std::string station_text(const Case& c, std::uint8_t station, bool first = false);

}  // namespace panelgate::doctor
