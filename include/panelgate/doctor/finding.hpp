#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::doctor {

/// What is probably wrong, what concerns the whole line first.
enum class Cause : std::uint8_t {
    echo,                ///< the adapter's echo is not what the configuration says
    no_answer_at_all,    ///< wiring, power, baud, parity or addresses
    wrong_baud,          ///< bytes come, at another pace
    wrong_parity,        ///< bytes come at the right pace and are taken for wrong
    other_master,        ///< somebody else asks on this line
    collision,           ///< somebody speaks while the gateway does
    overrun,             ///< bytes came faster than they were fetched
    noise,               ///< some replies of everybody are damaged
    tcp_framing,         ///< the same over TCP, where no wire of ours can be the reason
    trailing_bytes,      ///< something follows the replies
    wrong_crc_order,     ///< a panel sends the CRC's bytes in the other order than configured
    ascii_lower_case,    ///< a panel writes ASCII in lower-case digits, which are refused
    wrong_exception,     ///< a panel refuses with the number of a function that was not asked
    wrong_reply,         ///< a panel's good frames do not answer what was asked
    answers_broadcasts,  ///< a panel answers what nobody may answer
    damaged_replies,     ///< only one panel's replies are damaged: its cable or transceiver
    duplicate_address,   ///< two panels answer to one address
    timeout_too_short,   ///< a panel answers after its response timeout
    gap_too_short,       ///< a panel does not hear what follows another frame closely
    unasked_frames,      ///< a panel speaks when nobody has asked it
    station_silent,      ///< one panel is off or has another address: not a fault of the line
};
/// "wrong-baud": the word in REST and in the log. It never changes.
std::string_view code(Cause cause);

/// "late" -> 5, "timeout_ms" -> 300: counts, and durations in whole milliseconds, rounded up.
using Figures = std::map<std::string, std::uint64_t>;

/// One likely cause, in words for people.
struct Finding {
    Cause cause = Cause::noise;
    std::optional<std::uint8_t> station;  ///< nothing: the whole line
    std::string text;                     ///< what is wrong
    std::string advice;                   ///< what to do
    std::string evidence;                 ///< the numbers behind it
    Figures figures{};                    ///< ... for whoever says it in another language

    bool is_about_the_same(const Finding& other) const {
        return cause == other.cause && station == other.station;
    }
};

}  // namespace panelgate::doctor
