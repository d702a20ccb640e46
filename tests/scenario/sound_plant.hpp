#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "random.hpp"
#include "subject.hpp"

namespace panelgate::sound {

using scenario::Random;

/// Kind of a panel in a plant without a fault. Panels of each kind answer rightly and within
/// `response_timeout`; only a dead panel never answers.
enum class Kind : std::uint8_t {
    equal,      ///< every register and coil is 0
    constant,   ///< values that never change
    moving,     ///< values that change with each request
    quick,      ///< answers at once: T7
    slow,       ///< thinks for up to 80 % of response_timeout
    pausing,    ///< ignores a request within 30..100 ms after its own reply: T14
    libmodbus,  ///< waits up to 500 ms for the reply of a panel that it hears being asked: T1
    resetting,  ///< a command register reads 0 directly after each write
    refusing,   ///< refuses addresses from kRefused on with exception 02: T10
    dead,       ///< listed, and never answers
};
inline constexpr std::array kKinds{Kind::equal,    Kind::constant, Kind::moving,    Kind::quick,
                                   Kind::slow,     Kind::pausing,  Kind::libmodbus, Kind::resetting,
                                   Kind::refusing, Kind::dead};
std::string_view label(Kind kind);

struct PanelPlan {
    std::uint8_t id = 1;
    Kind kind = Kind::constant;
    Kind values = Kind::constant;  ///< equal, constant or moving
    Duration least_think{};
    Duration most_think{};
    Duration deaf{};  ///< of a pausing panel, from the end of its reply
};

struct ClientPlan {
    std::vector<std::uint8_t> stations;  ///< that the client asks in turn
    Duration least_pause{};              ///< from an answer to the next request
    Duration most_pause{};
    double writes = 0;  ///< share of the client's requests
};

struct Plant {
    std::uint64_t seed = 0;
    arbiter::Settings settings;
    /// The line is a device server or a native TCP device: frames take `latency` alone, whatever
    /// the configured baud, and every panel hears them.
    bool instant = false;
    Duration latency{};
    std::vector<PanelPlan> panels;
    std::vector<ClientPlan> clients;
};
Plant draw(std::uint64_t seed);

/// Counts of the requests to all panels of one kind.
struct Count {
    std::uint64_t requests = 0;
    std::uint64_t answered = 0;  ///< by the panel; an exception of the panel is an answer
    std::uint64_t alone = 0;     ///< requests that went to the wire and shared no transaction
    std::uint64_t frames = 0;    ///< that the gateway sent to these panels
    std::uint64_t wrong = 0;     ///< answers that the panel has not given since the request came
    std::uint64_t offline = 0;   ///< times that a panel was taken offline

    void add(const Count& more);
    double share() const;  ///< of the requests that were answered
    double asked() const;  ///< frames for each request that shared no transaction
};
using Tally = std::array<Count, kKinds.size()>;

struct Outcome {
    Tally tally{};
    std::string history;
};
/// Plays the plant with this gateway for `length` of virtual time. Clients draw the same requests
/// and the same pauses for each gateway.
Outcome play(const Plant& plant, scenario::Subject& gateway, Duration length,
             bool with_history = false);

}  // namespace panelgate::sound
