#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "random.hpp"

namespace panelgate::scenario {

/// Kind of a panel in a plant without a fault. Panels of each kind answer rightly and within
/// `response_timeout`; only a dead panel never answers.
enum class Sound : std::uint8_t {
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
inline constexpr std::array kSounds{
    Sound::equal,   Sound::constant,  Sound::moving,    Sound::quick,    Sound::slow,
    Sound::pausing, Sound::libmodbus, Sound::resetting, Sound::refusing, Sound::dead};
std::string_view label(Sound kind);

struct SoundPanel {
    std::uint8_t id = 1;
    Sound kind = Sound::constant;
    Sound values = Sound::constant;  ///< equal, constant or moving
    Duration least_think{};
    Duration most_think{};
    Duration deaf{};  ///< of a pausing panel, from the end of its reply
};

struct SoundClient {
    std::vector<std::uint8_t> stations;  ///< that the client asks in turn
    Duration least_pause{};              ///< from an answer to the next request
    Duration most_pause{};
    double writes = 0;  ///< share of the client's requests
};

struct SoundPlant {
    std::uint64_t seed = 0;
    arbiter::Settings settings;
    /// The line is a device server or a native TCP device: frames take `latency` alone, whatever
    /// the configured baud, and every panel hears them.
    bool instant = false;
    Duration latency{};
    std::vector<SoundPanel> panels;
    std::vector<SoundClient> clients;
};
SoundPlant draw_sound(std::uint64_t seed);

/// Counts of the requests to all panels of one kind.
struct SoundCount {
    std::uint64_t requests = 0;
    std::uint64_t answered = 0;  ///< by the panel; an exception of the panel is an answer
    std::uint64_t alone = 0;     ///< requests that went to the wire and shared no transaction
    std::uint64_t frames = 0;    ///< that the gateway sent to these panels
    std::uint64_t wrong = 0;     ///< answers that the panel has not given since the request came
    std::uint64_t offline = 0;   ///< times that a panel was taken offline

    void add(const SoundCount& more);
    double share() const;  ///< of the requests that were answered
    double asked() const;  ///< frames for each request that shared no transaction
};
using SoundTally = std::array<SoundCount, kSounds.size()>;

enum class SoundGateway : std::uint8_t { panelgate, plain };
struct SoundOutcome {
    SoundTally tally{};
    std::string history;
};
/// Plays the plant with this gateway for `length` of virtual time. Clients draw the same requests
/// and the same pauses for each gateway.
SoundOutcome play_sound(const SoundPlant& plant, SoundGateway gateway, Duration length,
                        bool with_history = false);

}  // namespace panelgate::scenario
