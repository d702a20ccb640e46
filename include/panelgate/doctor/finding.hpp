#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::doctor {

/// The probable fault; causes of the whole line come first.
enum class Cause : std::uint8_t {
    echo,                ///< the adapter's echo differs from the configuration
    telnet,              ///< a device server mixes telnet's bytes in
    no_answer_at_all,    ///< wiring, power, baud, parity or addresses
    wrong_baud,          ///< bytes come at another rate
    wrong_parity,        ///< bytes come at the right rate but with parity errors
    other_master,        ///< another master sends on this line
    collision,           ///< another sender transmits while the gateway does
    overrun,             ///< bytes came faster than they were read
    noise,               ///< some replies of all stations are damaged
    tcp_framing,         ///< damage on a TCP connection, where no own wire can be the cause
    trailing_bytes,      ///< bytes follow the replies
    wrong_crc_order,     ///< a panel's CRC byte order is not the configured one
    ascii_lower_case,    ///< a panel sends ASCII with lower-case digits, which are refused
    ascii_delimiters,    ///< a panel's ASCII begins or ends with other characters
    wrong_exception,     ///< a panel's exceptions carry a function that was not asked
    wrong_reply,         ///< a panel's good frames do not answer what was asked
    answers_broadcasts,  ///< a panel answers broadcasts, which have no reply
    damaged_replies,     ///< only one panel's replies are damaged: its cable or transceiver
    duplicate_address,   ///< two panels answer to one address
    timeout_too_short,   ///< a panel answers after its response timeout
    gap_too_short,       ///< a panel misses requests that closely follow another frame
    unasked_frames,      ///< a panel sends without being asked
    station_silent,      ///< one panel is off or has another address: not a fault of the line
    repeats_requests,    ///< a panel sends requests back, before its reply or in its place
    misses_requests,     ///< a panel leaves requests unanswered that it answers at other times
};
/// Returns the code, such as "wrong-baud", used in REST and in the log. Stable.
std::string_view code(Cause cause);

/// "late" -> 5, "timeout_ms" -> 300: counts, and durations in whole milliseconds, rounded up.
using Figures = std::map<std::string, std::uint64_t>;

/// One likely cause, as text for the user.
struct Finding {
    Cause cause = Cause::noise;
    std::optional<std::uint8_t> station;  ///< empty: the whole line
    std::string text;                     ///< what is wrong
    std::string advice;                   ///< what to do
    std::string evidence;                 ///< the numbers behind it
    Figures figures{};                    ///< ... for translations

    bool is_about_the_same(const Finding& other) const {
        return cause == other.cause && station == other.station;
    }
};

}  // namespace panelgate::doctor
