#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "worlds.hpp"

namespace panelgate::scenario {

/// What one simulated panel does with a request: chances are by request.
struct PanelPlan {
    std::uint8_t id = 1;
    bool listed = true;  ///< the settings know it
    /// Of what it says and of what it takes for a good frame.
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
    // When it answers
    Duration think = 1ms;
    Duration slow_think{};  ///< what it needs in every other `swing`; 0 = always `think`
    Duration swing = 5s;
    bool eager = false;  ///< does not wait for the silence behind the request, as many don't
    bool ring = true;    ///< takes requests while it thinks and serves them in turn; else deaf then
    double late = 0;     ///< answers after 0.5 to `late_limit` response timeouts
    /// In response timeouts: what would be answered later than this is forgotten. Beyond the late
    /// window no gateway can tell an old reply from the new one: Kind::beyond alone goes there.
    double late_limit = 3;
    double nap = 0;       ///< thinks for 2 s
    double own_rate = 1;  ///< its characters take this much longer than the line's
    // Whether
    double drop = 0;       ///< neither executed nor answered
    double mute = 0;       ///< executed, not answered
    double exception = 0;  ///< refuses with 06
    unsigned max_registers = 125;
    unsigned refusal = 3;         ///< the exception for more than those; 0 = silence
    unsigned only_registers = 0;  ///< silent to reads of any other number; 0 = to none
    double wrong_function = 0;    ///< answers with an exception of another function
    double refuses_first = 0;     ///< says an exception, and the reply 20 ms behind that
    double confirms_last = 0;     ///< says the function's last confirmation; the write is not done
    Duration deaf_after{};        ///< ignores what begins this soon behind its own reply
    /// Takes what begins this soon behind another station's request for that one's reply, and
    /// ignores it, as libmodbus's server does (libmodbus#83 #799).
    Duration expects_replies{};
    bool answers_broadcasts = false;
    Duration broadcast_think{};  ///< before it does; 0 = up to 8 ms
    bool dead = false;
    Duration flapping{};  ///< dead and alive in turns of this length; 0 = no
    Duration reboots{};   ///< in each such time it is silent for 8 s and then says some text
    // How it sounds
    double flip = 0;           ///< 1 to 3 bits of the reply: the CRC detects all of these
    double truncate = 0;       ///< only a part of the reply
    double noise = 0;          ///< bytes in front of the reply
    double wrong_id = 0;       ///< the reply carries another address
    double foreign = 0;        ///< a good frame of another address goes first
    double fragment = 0;       ///< its address and function, some time before the reply
    double glitch_before = 0;  ///< one byte 00 or FF, right before or behind the reply
    double glitch_behind = 0;
    double hole = 0;  ///< a pause of up to `hole_limit` inside the reply
    Duration hole_limit{};
    double tail = 0;       ///< 1 to 3 bytes 0.5 to 5 ms behind the reply
    double duplicate = 0;  ///< the reply comes twice, the second up to this much later:
    Duration duplicate_delay{};
    bool duplicate_differs = false;  ///< it has other values: a second panel's
    double damaged_first = 0;        ///< a damaged reply, and the good one 60 ms later
    double padded_inside = 0;        ///< two bytes too many under the CRC
    double padded_behind = 0;
    // Habits
    bool overtakes = false;       ///< thinks about each request by itself, whatever waits
    double deaf_to_writes = 0;    ///< neither executed nor answered
    double repeats_request = 0;   ///< it says the request before the reply
    bool any_connection = false;  ///< replies are heard on whichever there is by then
    /// In each such time it says once, while it thinks about a read, what has the form of the
    /// awaited reply: its last reply, or values that nobody asked for.
    Duration imitates{};
    bool imitates_last = false;

    /// Its answers come in time and a gateway can find each of them: all but single bytes around
    /// them and pauses. `timeout`: of the line.
    bool is_sound(Duration timeout, Duration reply_hole) const;
    /// None of its answers is one.
    bool never_right() const { return wrong_function == 1 || padded_inside == 1; }
    /// Never silent, unless it is dead.
    bool only_dies() const;
};

struct ClientPlan {
    unsigned in_flight = 1;  ///< requests that it keeps open
    double writes = 0.1;
    double broadcasts = 0;
    bool polls = false;      ///< its reads are of the poll class
    bool same_read = false;  ///< it always asks for the same items
    bool scans = false;      ///< it asks all ids, one after another
    double vanish = 0;       ///< chance, by answer, that it goes away and comes back as another
    double leaves = 0;       ///< the same by second, at any moment
    Duration pause = 1ms;    ///< between an answer and the next request, at most
    std::uint64_t host = 0;  ///< 0: one of its own
    bool polite = false;     ///< few requests: none of them may be refused
    std::vector<std::uint8_t> stations;
};

/// What happens to the line as a whole.
struct LinePlan {
    double own_rate = 1;  ///< our characters take this much longer than computed
    bool echo = false;
    bool echo_writes = false;  ///< of writes alone
    bool echo_twice = false;   ///< the whole echo comes once more
    double damaged_echo = 0;   ///< by request
    double cut_echo = 0;       ///< the echo lacks its last byte
    double partial_echo = 0;   ///< the first 1 to 7 bytes come back
    double idle_noise = 0;     ///< bursts of noise a second
    double floating = 0;       ///< by second: it floats for 1 to 4 s, a byte each 1.5 ms of silence
    double losses = 0;         ///< the device goes away, by second
    double handover = 0;       ///< share of them: back at once, what is under way is heard
    double stalls = 0;         ///< by second: nothing gets through for 0.3 to 4 s, then all of it
    bool hangs = false;        ///< a stall is a device server that hangs: it takes connections all
                               ///< the while, and the newest is told what is said later
    double pauses = 0;         ///< by second: nobody calls the arbiter for 0.1 to 5 s
    Duration babble{};         ///< a good frame that nobody asked for, each such time
    /// In each such time the adapter hands over the last reply of the odd panel once more, while a
    /// request of that form leaves.
    Duration hands_over{};
    bool other_master = false;  ///< a polite one, with a panel of its own
};

/// One run: a line, its panels, its clients. The same seed gives the same run.
struct Plan {
    std::uint64_t seed = 0;
    arbiter::Settings settings;
    std::vector<PanelPlan> panels;
    std::vector<ClientPlan> clients;
    LinePlan line;
    std::size_t transactions = 1000;  ///< frames that the gateway sends before the run ends
    std::uint8_t odd = 0;             ///< the one panel that is
    Limit limit = Limit::none;        ///< that this run reaches: wrong values are counted

    bool is_sound(const PanelPlan& panel) const;
    /// Nothing but silence of panels keeps a line idle: replies are never late, nothing is held.
    bool is_calm() const;
};
Plan draw(Kind kind, std::uint64_t seed, SerialMode mode = SerialMode::rtu);
/// A line on which one panel is odd, and all others are as good as panels get.
Plan draw_odd(Oddity oddity, std::uint64_t seed);
/// The same with that panel as good as the others.
Plan without_oddity(Plan plan);

}  // namespace panelgate::scenario
