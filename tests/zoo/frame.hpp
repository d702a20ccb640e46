// Bytes, checksums and lengths of Modbus RTU, and the clock of the zoo. On purpose nothing of the
// gateway's own code is used here: an error there must not be confirmed by the same error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace zoo {

using Bytes = std::vector<std::uint8_t>;
using Time = std::int64_t;  // nanoseconds of CLOCK_MONOTONIC, or a span of them

constexpr Time kMicrosecond = 1'000;
constexpr Time kMillisecond = 1'000'000;
constexpr Time kSecond = 1'000'000'000;

Time now();
constexpr Time milliseconds(double count) {
    return static_cast<Time>(count * static_cast<double>(kMillisecond));
}

std::uint16_t crc16(const std::uint8_t* data, std::size_t size);

// Address + PDU + checksum; `swapped`: high byte first, as some panels have it.
Bytes sealed(int unit, const Bytes& pdu, bool swapped = false);

bool has_good_crc(const Bytes& frame, bool swapped = false);

// Bytes of the request that starts here; 0 while nothing can be said, and for unknown functions.
std::size_t request_length(const Bytes& data);

// xorshift: the same seed gives the same zoo.
class Dice {
  public:
    explicit Dice(std::uint32_t seed) : state_(seed * 2654435761U | 1U) {}
    std::uint32_t next();
    Time between(Time low, Time high);  // both included
    std::uint8_t byte() { return static_cast<std::uint8_t>(next() >> 11); }

  private:
    std::uint32_t state_;
};

}  // namespace zoo
