#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::sim {

/// Faults of one simulated panel. Shares are of its answers, 0 (never) to 1 (always).
struct Misbehaviour {
    bool dead = false;   ///< neither executes nor answers
    Duration slow{};     ///< more think time, always
    Duration late_by{};  ///< more think time, for the share `late`
    double late = 0;
    double drop = 0;        ///< executes and does not answer
    double damage = 0;      ///< one bit of the reply is wrong
    double truncate = 0;    ///< half of the reply
    double foreign_id = 0;  ///< the reply carries another address
    friend bool operator==(const Misbehaviour&, const Misbehaviour&) = default;
};

/// The faults as numbers by name, times in milliseconds: {"dead": 1, "slow_ms": 20, "drop": 0.1}.
using FaultNumbers = std::map<std::string, double>;
FaultNumbers to_numbers(const Misbehaviour& faults);
/// What is not named is off. Nothing, or what is wrong and would be right.
std::optional<std::string> from_numbers(const FaultNumbers& numbers, Misbehaviour& faults);

/// What a misbehaving panel makes of a good reply ADU. Pure, but for the chance it is given.
struct Spoken {
    Bytes adu;         ///< empty: silence
    Duration delay{};  ///< more than its think time
};
Spoken misbehave(const Misbehaviour& faults, Bytes adu, std::mt19937& chance);

}  // namespace panelgate::sim
