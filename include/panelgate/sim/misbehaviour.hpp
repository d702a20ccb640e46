#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/sim/settings.hpp"

namespace panelgate::sim {

/// What a receiver makes of a line.
struct HeardBytes {
    Bytes bytes;
    /// Bit times from the first start bit to the end of each byte.
    std::vector<std::uint32_t> ends;
};

/// Two senders on one wire, the second `later` bit times after the first: where both speak a 0 of
/// either wins, and the receiver takes its characters from what that gives. Apart they come clean.
HeardBytes collide(ByteView first, ByteView second, std::size_t later, const SerialFormat& format);

/// The faults as numbers by name, times in milliseconds: {"dead": 1, "slow_ms": 20, "drop": 0.1}.
using FaultNumbers = std::map<std::string, double>;
FaultNumbers to_numbers(const Misbehaviour& faults);
/// What is not named is off. Nothing, or what is wrong and would be right.
std::optional<std::string> from_numbers(const FaultNumbers& numbers, Misbehaviour& faults);

/// What a misbehaving panel makes of a good reply ADU, in the format's mode. Pure, but for the
/// chance it is given.
struct Spoken {
    Bytes adu;         ///< as it stands on the wire; empty: silence
    Duration delay{};  ///< more than its think time
    /// Bit times from the first start bit to the end of each byte; empty: without pauses.
    std::vector<std::uint32_t> ends;
};
Spoken misbehave(const Misbehaviour& faults, Bytes adu, std::mt19937& chance,
                 const SerialFormat& format = {});

}  // namespace panelgate::sim
