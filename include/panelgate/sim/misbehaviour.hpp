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

/// Bytes that a receiver hears on a line.
struct HeardBytes {
    Bytes bytes;
    /// Bit times from the first start bit to the end of each byte.
    std::vector<std::uint32_t> ends;
};

/// Two senders on one wire, the second starting `later` bit times after the first: a 0 of either
/// wins, and the receiver decodes the result. Without overlap both arrive intact.
HeardBytes collide(ByteView first, ByteView second, std::size_t later, const SerialFormat& format);

/// The faults as numbers by name, times in milliseconds: {"dead": 1, "slow_ms": 20, "drop": 0.1}.
using FaultNumbers = std::map<std::string, double>;
FaultNumbers to_numbers(const Misbehaviour& faults);
/// Faults not named are off. Returns an error text with what would be right, or std::nullopt.
std::optional<std::string> from_numbers(const FaultNumbers& numbers, Misbehaviour& faults);

/// Applies the faults to a valid reply ADU, in the format's mode. Pure, apart from `chance`.
struct Spoken {
    Bytes adu;         ///< as sent on the wire; empty: silence
    Duration delay{};  ///< in addition to the think time
    /// Bit times from the first start bit to the end of each byte; empty: without pauses.
    std::vector<std::uint32_t> ends;
};
Spoken misbehave(const Misbehaviour& faults, Bytes adu, std::mt19937& chance,
                 const SerialFormat& format = {});

}  // namespace panelgate::sim
