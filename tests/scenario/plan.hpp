#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/settings.hpp"

namespace panelgate::scenario {

/// How one simulated panel behaves: chances of each fault, by request.
struct PanelPlan {
    std::uint8_t id = 1;
    Duration think = 1ms;
    double late = 0;  ///< answers after 0.5 to `late_limit` response timeouts
    double late_limit = 3;
    double drop = 0;       ///< neither executed nor answered
    double mute = 0;       ///< executed, not answered
    double flip = 0;       ///< 1 to 3 bits of the reply: the CRC detects all of these
    double truncate = 0;   ///< only a part of the reply
    double noise = 0;      ///< bytes in front of the reply
    double wrong_id = 0;   ///< the reply carries another address
    double foreign = 0;    ///< a good frame of another address goes first
    double duplicate = 0;  ///< the reply comes twice
    double exception = 0;
    unsigned max_registers = 125;  ///< more are refused with exception 3
    bool dead = false;
    Duration flapping{};  ///< dead and alive in turns of this length; 0 = no
};

struct ClientPlan {
    unsigned in_flight = 1;  ///< requests that it keeps open
    double writes = 0.1;
    double broadcasts = 0;
    bool polls = false;    ///< its reads are of the poll class
    double vanish = 0;     ///< chance, by answer, that it goes away and comes back as another
    Duration pause = 1ms;  ///< between an answer and the next request, at most
    std::vector<std::uint8_t> stations;
};

enum class Kind : std::uint8_t { faults, station, echo, dead, crowd, adaptive };
inline constexpr Kind kKinds[] = {Kind::faults, Kind::station, Kind::echo,
                                  Kind::dead,   Kind::crowd,   Kind::adaptive};
std::string_view label(Kind kind);

/// One run: a line, its panels, its clients. The same seed gives the same run.
struct Plan {
    std::uint64_t seed = 0;
    arbiter::Settings settings;
    std::vector<PanelPlan> panels;
    std::vector<ClientPlan> clients;
    bool echo = false;
    double damaged_echo = 0;          ///< by request
    double idle_noise = 0;            ///< bursts of noise a second
    double line_losses = 0;           ///< the device goes away, by second
    std::size_t transactions = 1000;  ///< frames that the gateway sends before the run ends
};
Plan draw(Kind kind, std::uint64_t seed);

}  // namespace panelgate::scenario
