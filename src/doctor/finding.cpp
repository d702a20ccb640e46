#include "panelgate/doctor/finding.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>

#include "panelgate/doctor/settings.hpp"
#include "rules.hpp"

namespace panelgate::doctor {

namespace {

constexpr std::size_t place(Cause cause) { return static_cast<std::size_t>(cause); }
static_assert(place(Cause::misses_requests) + 1 == kCauses.size());
static_assert(kCauses[place(Cause::wrong_crc_order)] == "wrong-crc-order");
static_assert(kCauses[place(Cause::duplicate_address)] == "duplicate-address");

}  // namespace

std::string_view code(Cause cause) { return kCauses[place(cause)]; }

std::string share_text(std::uint64_t part, std::uint64_t whole, const char* what) {
    const double percent =
        whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), " (%.*f %%)", percent < 10 ? 1 : 0, percent);
    return std::to_string(part) + " of " + std::to_string(whole) + " " + what + text.data();
}

std::uint64_t whole_ms(Duration duration) {
    return static_cast<std::uint64_t>(
        std::chrono::ceil<std::chrono::milliseconds>(duration).count());
}

std::string duration_text(Duration duration) { return std::to_string(whole_ms(duration)) + "ms"; }

Figures damage_figures(const arbiter::Symptoms& s) {
    return {{"damaged", s.damaged()},
            {"replies", s.damaged() + s.answered},
            {"exact", s.damaged_exact},
            {"short", s.damaged_short},
            {"long", s.damaged_long}};
}

std::string damage_text(const Case& c, const arbiter::Symptoms& s) {
    std::string text = share_text(s.damaged(), s.damaged() + s.answered, "replies") +
                       " damaged: " + std::to_string(s.damaged_exact) + " of the right length, " +
                       std::to_string(s.damaged_short) + " shorter, " +
                       std::to_string(s.damaged_long) + " longer; " +
                       share_text(s.damaged_zeros, s.damaged_bytes, "of their bytes are zero");
    if (s.beheaded > 0)
        text += "; " + std::to_string(s.beheaded) + " are right but for their first bytes";
    if (s.crc_swapped > 0)
        text += "; " + std::to_string(s.crc_swapped) + " but for the order of the CRC's bytes";
    if (c.window.uart) {
        const line::UartErrors& uart = *c.window.uart;
        text += "; the driver counted " + std::to_string(uart.framing) + " framing, " +
                std::to_string(uart.parity) + " parity errors, " + std::to_string(uart.breaks) +
                " breaks, " + std::to_string(uart.overruns) + " overruns";
    }
    return text;
}

std::string station_text(const Case& c, std::uint8_t station, bool first) {
    const auto found = c.facts.names.find(station);
    if (found != c.facts.names.end()) return found->second;
    std::string text = station == 0 ? "a station that the configuration does not list"
                                    : "station " + std::to_string(station);
    if (first) text.front() = text.front() == 'a' ? 'A' : 'S';
    return text;
}

}  // namespace panelgate::doctor
