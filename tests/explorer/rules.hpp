#pragma once

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::explorer {

/// What can happen next. Those from `lost` on are faults, of which a script has few.
enum class Verb : std::uint8_t {
    submit,         ///< a client asks
    leave,          ///< a client goes, for good
    reply,          ///< the reply that is due arrives whole
    rest,           ///< the rest of one of which a part has come
    deadline,       ///< time runs to the arbiter's next deadline
    half,           ///< half-way there, at most half a timeout
    lost,           ///< a reply never comes
    damaged,        ///< it comes with one bit changed
    cut,            ///< its first bytes come, and nothing more
    hole,           ///< its first bytes come, the rest may follow
    behind_header,  ///< it comes behind two bytes that look like its own first ones
    behind_glitch,  ///< it comes behind a byte 00
    partial_echo,   ///< the first bytes of the request come back
    header,         ///< two bytes that look like the start of a reply
    glitch,         ///< a byte 00
    line_blinks,    ///< the line goes and is back at once; replies under way still come
    line_lost,      ///< the same, and they don't
};
inline constexpr std::size_t kVerbs = 17;
constexpr bool is_fault(Verb verb) { return verb >= Verb::lost; }
constexpr std::uint32_t bit(Verb verb) { return 1u << static_cast<unsigned>(verb); }

/// `which`: the wish, the client or the station.
struct Move {
    Verb verb = Verb::deadline;
    std::uint8_t which = 0;
};

/// A request that a client may make, as often as it likes.
struct Wish {
    std::uint8_t client = 1;
    std::uint8_t station = 1;
    std::uint16_t address = 10;  ///< below 256
    std::uint8_t count = 1;
    bool write = false;  ///< of one register, each time of another value
};

/// One small world: who is there and what may happen.
struct Rules {
    std::string name;
    arbiter::Settings settings;
    std::vector<Wish> wishes;
    std::size_t open_per_client = 1;
    std::uint32_t verbs = 0;  ///< bits of what may happen
    int faults = 2;           ///< in one script, at most 3
    /// The way to the wire may hold back what it was given, in order and however long, until it is
    /// closed (Settings::may_stall). What is behind it is as quick as ever.
    bool stalls = false;
    /// ... and it does so over the next connection, too.
    bool hangs = false;
    /// Bytes can come while a request is leaving: the line is no pair of wires.
    bool full_duplex = false;

    friend void PrintTo(const Rules& rules, std::ostream* out) { *out << rules.name; }
};

inline constexpr Duration kTimeout = 100ms;
inline constexpr Duration kLateWindow = 100ms;
inline constexpr Duration kDeadline = 1s;

/// The settings of all small worlds: few steps to everything that can happen.
inline arbiter::Settings small_settings() {
    arbiter::Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.unlisted.response_timeout = kTimeout;
    settings.unlisted.late_window = kLateWindow;
    settings.unlisted.retries = 1;
    settings.stations = {settings.unlisted, settings.unlisted};
    settings.stations[0].id = 1;
    settings.stations[1].id = 2;
    settings.queue.deadline = kDeadline;
    settings.offline.after = 2;
    settings.offline.probe_min = 200ms;
    settings.offline.probe_max = 400ms;
    return settings;
}

}  // namespace panelgate::explorer
