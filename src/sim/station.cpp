#include "panelgate/sim/station.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <optional>
#include <utility>

#include "memory.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/judge.hpp"

namespace panelgate::sim {
namespace {

using modbus::ExceptionCode;
using profile::Area;
using profile::Simulation;
using Motion = Simulation::Motion;

/// Value of clock register `index` (0..6): second, minute, hour, day, month, year, weekday.
std::uint16_t clock_field(std::int64_t wall, std::uint32_t index) {
    const auto seconds = static_cast<std::time_t>(wall);  // 32 bits on armhf, until 2038
    std::tm t{};
    gmtime_r(&seconds, &t);
    const int fields[] = {t.tm_sec,     t.tm_min,        t.tm_hour, t.tm_mday,
                          t.tm_mon + 1, t.tm_year % 100, t.tm_wday};
    return static_cast<std::uint16_t>(fields[index % 7]);
}

std::uint16_t moved(const Motion& motion, Duration running, std::int64_t wall,
                    std::uint32_t first) {
    const double turns = to_seconds(running) / to_seconds(motion.period);
    const double phase = turns - std::floor(turns);
    const double span = motion.high - motion.low;
    switch (motion.kind) {
        case Motion::Kind::ramp:
            return static_cast<std::uint16_t>(motion.low + span * phase);
        case Motion::Kind::sine: {
            const double wave = 0.5 + 0.5 * std::sin(2 * std::numbers::pi * phase);
            return static_cast<std::uint16_t>(motion.low + span * wave);
        }
        case Motion::Kind::toggle:
            return phase < 0.5 ? 0 : 1;
        case Motion::Kind::clock:
            return clock_field(wall, motion.address - first);
    }
    return 0;
}

}  // namespace

struct Station::State {
    State(const profile::PanelProfile& p, std::uint8_t station)
        : profile(&p), id(station), memory(p) {}

    Bytes refuse(std::uint8_t function, ExceptionCode code) const {
        return modbus::encode_exception(function, code);
    }
    void move(TimePoint now, std::int64_t wall);
    Bytes execute(ByteView pdu);
    Bytes transfer(ByteView pdu, const modbus::Access& access);
    Bytes read(std::uint8_t function, const modbus::Span& range) const;
    void write(ByteView pdu, const modbus::Span& range);
    std::uint16_t written(ByteView pdu, const Area& area, std::uint32_t address,
                          std::uint16_t index) const;

    const profile::PanelProfile* profile;
    std::uint8_t id;
    Memory memory;
    TimePoint started{};
    bool running = false;
    std::uint16_t events = 0;  ///< event counter of 0B (AP 6.9)
};

Station::Station(const profile::PanelProfile& profile, std::uint8_t id)
    : state_(std::make_unique<State>(profile, id)) {
    for (const Simulation::Cell& cell : profile.simulation.memory) {
        for (std::uint32_t i = 0; i < cell.values.size(); ++i)
            poke(cell.area, cell.address + i, cell.values[i]);
    }
}
Station::Station(Station&&) noexcept = default;
Station& Station::operator=(Station&&) noexcept = default;
Station::~Station() = default;

std::uint8_t Station::id() const { return state_->id; }

std::uint16_t Station::peek(const std::string& area, std::uint32_t address) const {
    return state_->memory.get(*state_->profile->find_area(std::string_view(area)), address);
}

void Station::poke(const std::string& area, std::uint32_t address, std::uint16_t value) {
    state_->memory.set(*state_->profile->find_area(std::string_view(area)), address, value);
}

Bytes Station::handle(TimePoint now, std::int64_t wall, ByteView pdu) {
    state_->move(now, wall);
    return state_->execute(pdu);
}

void Station::broadcast(TimePoint now, std::int64_t wall, ByteView pdu) {
    const profile::FunctionRule* rule =
        pdu.empty() ? nullptr : state_->profile->find_function(pdu[0]);
    if (rule == nullptr || !rule->broadcast) return;
    state_->move(now, wall);
    state_->execute(pdu);
}

bool Station::rejects_gap(Duration pause, const SerialFormat& format) const {
    const unsigned bits = state_->profile->timing.max_gap_bits;
    return bits > 0 && pause > std::chrono::nanoseconds(1s) * bits / format.baud;
}

void Station::State::move(TimePoint now, std::int64_t wall) {
    if (!std::exchange(running, true)) started = now;
    for (const Motion& motion : profile->simulation.motion) {
        const Area& area = *profile->find_area(std::string_view(motion.area));
        memory.set(area, motion.address, moved(motion, now - started, wall, area.readable.first));
    }
}

Bytes Station::State::execute(ByteView pdu) {
    if (pdu.empty()) return {};
    const std::uint8_t function = pdu[0];
    switch (profile::judge(*profile, pdu)) {
        case profile::Judgement::illegal_function:
            return refuse(function, ExceptionCode::illegal_function);
        case profile::Judgement::illegal_value:
            return refuse(function, ExceptionCode::illegal_data_value);
        case profile::Judgement::illegal_address:
            return refuse(function, ExceptionCode::illegal_data_address);
        case profile::Judgement::write_protected:
            return {static_cast<std::uint8_t>(function | modbus::kExceptionBit),
                    profile->simulation.protected_exception};
        case profile::Judgement::fine:
            break;
    }
    const modbus::Access access = modbus::access_of(pdu);
    const bool has_range = (access.read || access.write) && function != modbus::kReadFifoQueue;
    Bytes reply =
        has_range ? transfer(pdu, access) : identity_reply(profile->name, id, events, pdu);
    const bool counts = function != modbus::kGetCommEventCounter;
    if (counts && !modbus::exception_of(reply)) ++events;
    return reply;
}

Bytes Station::State::transfer(ByteView pdu, const modbus::Access& access) {
    if (access.write) write(pdu, *access.write);
    if (access.read) return read(pdu[0], *access.read);
    if (modbus::is_broadcastable(pdu[0])) return modbus::normal_write_reply(pdu);
    return {pdu.begin(), pdu.end()};  // 16h echoes its request
}

Bytes Station::State::read(std::uint8_t function, const modbus::Span& range) const {
    const Area& area = *profile::find_readable(*profile, range);
    if (modbus::is_bit_table(range.table)) {
        std::vector<bool> bits;
        bits.reserve(range.count);
        for (std::uint32_t i = 0; i < range.count; ++i)
            bits.push_back(memory.get(area, range.first + i) != 0);
        const Bytes packed = modbus::pack_bits(bits);
        return Writer().u8(function).u8(static_cast<unsigned>(packed.size())).raw(packed).take();
    }
    Writer reply;
    reply.u8(function).u8(2u * range.count);
    for (std::uint32_t i = 0; i < range.count; ++i) reply.u16(memory.get(area, range.first + i));
    return reply.take();
}

/// Returns the value that a write request carries for its `index`-th item.
std::uint16_t Station::State::written(ByteView pdu, const Area& area, std::uint32_t address,
                                      std::uint16_t index) const {
    const auto word = [&](std::size_t at) {
        return static_cast<std::uint16_t>(pdu[at] << 8 | pdu[at + 1]);
    };
    switch (pdu[0]) {
        case modbus::kWriteSingleCoil:
        case modbus::kWriteSingleRegister:
            return word(3);
        case modbus::kWriteMultipleCoils:
            return pdu[6u + index / 8] >> (index % 8) & 1;
        case modbus::kWriteMultipleRegisters:
            return word(6u + 2u * index);
        case modbus::kReadWriteMultipleRegisters:
            return word(10u + 2u * index);
        case modbus::kMaskWriteRegister: {
            const std::uint16_t old = memory.get(area, address);
            return static_cast<std::uint16_t>((old & word(3)) | (word(5) & ~word(3)));
        }
        default:
            return 0;
    }
}

void Station::State::write(ByteView pdu, const modbus::Span& range) {
    const Area& area = *profile::find_readable(*profile, range);
    for (std::uint16_t i = 0; i < range.count; ++i) {
        const std::uint32_t address = range.first + i;
        memory.set(area, address, written(pdu, area, address, i));
    }
}

}  // namespace panelgate::sim
