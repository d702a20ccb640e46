#include "panelgate/sim/misbehaviour.hpp"

#include <algorithm>
#include <bit>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::sim {

namespace {

std::size_t data_bits(const SerialFormat& format) {
    return static_cast<std::size_t>(format.data_bits);
}

/// The levels of one character: start bit 0, data from the least significant bit, parity, stop 1.
void append_character(std::vector<bool>& levels, std::uint8_t byte, const SerialFormat& format) {
    levels.push_back(false);
    for (std::size_t i = 0; i < data_bits(format); ++i) levels.push_back((byte >> i & 1) != 0);
    const bool odd_ones = std::popcount(byte) % 2 != 0;
    if (format.parity == Parity::even) levels.push_back(odd_ones);
    if (format.parity == Parity::odd) levels.push_back(!odd_ones);
    levels.insert(levels.end(), static_cast<std::size_t>(format.stop_bits), true);
}

std::vector<bool> levels_of(ByteView bytes, std::size_t idle, const SerialFormat& format) {
    std::vector<bool> levels(idle, true);
    for (const std::uint8_t byte : bytes) append_character(levels, byte, format);
    return levels;
}

}  // namespace

HeardBytes collide(ByteView first, ByteView second, std::size_t later, const SerialFormat& format) {
    std::vector<bool> line = levels_of(first, 0, format);
    const std::vector<bool> other = levels_of(second, later, format);
    line.resize(std::max(line.size(), other.size()), true);
    for (std::size_t i = 0; i < other.size(); ++i) line[i] = line[i] && other[i];
    const auto character = static_cast<std::size_t>(format.bits_per_character());
    line.resize(line.size() + character, true);  // the last character may begin late
    HeardBytes heard;
    for (std::size_t at = 0; at + character <= line.size();) {
        if (line[at]) {
            ++at;
            continue;
        }
        unsigned byte = 0;
        for (std::size_t i = 0; i < data_bits(format); ++i)
            byte |= (line[at + 1 + i] ? 1u : 0u) << i;
        heard.bytes.push_back(static_cast<std::uint8_t>(byte));
        heard.ends.push_back(static_cast<std::uint32_t>(at + character));
        // A stop bit of 0 is taken for a start bit.
        at += 1 + data_bits(format) + (format.parity == Parity::none ? 0 : 1);
    }
    return heard;
}

namespace {

constexpr double kLongest = 600'000;  // ms

struct Fault {
    const char* name;
    double most;
    double (*get)(const Misbehaviour&);
    void (*set)(Misbehaviour&, double);
};

Duration from_ms(double ms) {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(ms));
}

template <double Misbehaviour::* Share>
constexpr Fault share(const char* name) {
    return {name, 1, [](const Misbehaviour& m) { return m.*Share; },
            [](Misbehaviour& m, double v) { m.*Share = v; }};
}
template <Duration Misbehaviour::* Time>
constexpr Fault time(const char* name) {
    return {name, kLongest, [](const Misbehaviour& m) { return to_milliseconds(m.*Time); },
            [](Misbehaviour& m, double v) { m.*Time = from_ms(v); }};
}

constexpr Fault kFaults[] = {
    {"dead", 1, [](const Misbehaviour& m) { return m.dead ? 1.0 : 0.0; },
     [](Misbehaviour& m, double v) { m.dead = v != 0; }},
    time<&Misbehaviour::slow>("slow_ms"),
    time<&Misbehaviour::late_by>("late_by_ms"),
    share<&Misbehaviour::late>("late"),
    share<&Misbehaviour::drop>("drop"),
    share<&Misbehaviour::damage>("damage"),
    share<&Misbehaviour::truncate>("truncate"),
    share<&Misbehaviour::foreign_id>("foreign_id"),
    share<&Misbehaviour::duplicate>("duplicate"),
};

std::string unknown_fault(const std::string& name) {
    std::vector<std::string_view> names;
    std::string all;
    for (const Fault& fault : kFaults) {
        names.emplace_back(fault.name);
        all += (all.empty() ? "" : ", ") + std::string(fault.name);
    }
    const std::string near = nearest(name, names);
    const std::string text = "there is no fault '" + name + '\'';
    return near.empty() ? text + "; faults are " + all : text + "; did you mean '" + near + "'?";
}

}  // namespace

FaultNumbers to_numbers(const Misbehaviour& faults) {
    FaultNumbers numbers;
    for (const Fault& fault : kFaults) numbers[fault.name] = fault.get(faults);
    return numbers;
}

std::optional<std::string> from_numbers(const FaultNumbers& numbers, Misbehaviour& faults) {
    Misbehaviour made;
    for (const auto& [name, value] : numbers) {
        const auto known =
            std::ranges::find_if(kFaults, [&](const Fault& fault) { return fault.name == name; });
        if (known == std::end(kFaults)) {
            return unknown_fault(name);
        }
        if (!(value >= 0 && value <= known->most)) {
            return name + " must be from 0 to " + number_text(known->most) + ", not " +
                   number_text(value);
        }
        known->set(made, value);
    }
    faults = made;
    return std::nullopt;
}

namespace {

/// A second panel with the same address sends the same reply, up to one and a half replies later.
void send_twice(Spoken& spoken, std::mt19937& chance, const SerialFormat& format) {
    const auto bits = spoken.adu.size() * static_cast<std::size_t>(format.bits_per_character());
    std::uniform_int_distribution<std::size_t> later(0, bits * 3 / 2);
    HeardBytes heard = collide(spoken.adu, spoken.adu, later(chance), format);
    spoken.adu = std::move(heard.bytes);
    spoken.ends = std::move(heard.ends);
}

}  // namespace

Spoken misbehave(const Misbehaviour& faults, Bytes adu, std::mt19937& chance,
                 const SerialFormat& format) {
    const auto happens = [&](double share) {
        return share > 0 && std::uniform_real_distribution<>(0, 1)(chance) < share;
    };
    if (adu.empty() || faults.dead || happens(faults.drop)) return {};
    Spoken spoken{std::move(adu), faults.slow, {}};
    if (happens(faults.late)) spoken.delay += faults.late_by;
    if (happens(faults.foreign_id)) {
        const auto other =
            static_cast<std::uint8_t>(spoken.adu[0] >= modbus::kMaxStation ? 1 : spoken.adu[0] + 1);
        spoken.adu = modbus::encode_adu(other, modbus::pdu_of(spoken.adu));
    }
    const bool ascii = format.mode == SerialMode::ascii;
    if (ascii) spoken.adu = modbus::to_ascii(spoken.adu);
    if (happens(faults.damage)) {
        std::uniform_int_distribution<std::size_t> place(0, spoken.adu.size() - 1);
        spoken.adu[place(chance)] ^= ascii ? 0x01 : 0x10;  // mostly another digit
    }
    if (happens(faults.truncate)) spoken.adu.resize((spoken.adu.size() + 1) / 2);
    if (happens(faults.duplicate)) send_twice(spoken, chance, format);
    return spoken;
}

}  // namespace panelgate::sim
