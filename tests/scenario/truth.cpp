#include "truth.hpp"

#include <algorithm>

namespace panelgate::scenario {

std::uint16_t moving_value(std::uint8_t station, std::uint8_t function, std::uint16_t address,
                           std::uint64_t served) {
    return static_cast<std::uint16_t>(station * 257u + function * 4099u + address * 31u + served);
}

std::string key_of(std::uint8_t station, ByteView pdu) {
    return std::string(1, static_cast<char>(station)) + std::string(pdu.begin(), pdu.end());
}

void Truth::on_served(TimePoint now, std::uint8_t station) {
    constexpr std::size_t kKept = 4096;
    Station& s = stations_[station];
    s.history.emplace_back(now, ++s.served);
    if (s.history.size() > kKept) s.history.pop_front();
}

void Truth::on_executed(TimePoint now, std::uint8_t station, ByteView pdu) {
    executed_[key_of(station, pdu)] = now;
    if (pdu[0] == 5) return;
    Station& s = stations_[station];
    const std::uint16_t address = word(pdu, 1);
    if (pdu[0] == 6) s.cells[address].values.emplace_back(now, word(pdu, 3));
    for (std::uint16_t i = 0; pdu[0] == 16 && i < word(pdu, 3); ++i) {
        s.cells[static_cast<std::uint16_t>(address + i)].values.emplace_back(
            now, word(pdu, std::size_t{6} + 2 * i));
    }
}

void Truth::on_exception(TimePoint now, std::uint8_t station, ByteView pdu) {
    stations_[station].refused[{pdu.begin(), pdu.end()}] = now;
}

void Truth::on_write_sent(TimePoint now, std::uint8_t station, ByteView pdu) {
    if (pdu[0] == 5) return;
    const std::uint16_t address = word(pdu, 1);
    const unsigned count = pdu[0] == 16 ? word(pdu, 3) : 1;
    stations_.try_emplace(station);
    for (auto& [id, s] : stations_) {
        if (station != kBroadcast && id != station) continue;
        for (unsigned i = 0; i < count; ++i)
            s.cells[static_cast<std::uint16_t>(address + i)].asked = now;
    }
}

void Truth::on_said(TimePoint now, ByteView bytes) {
    constexpr Duration kLate = 30s;  // no reply and no stall is as long
    said_.emplace_back(now, Bytes(bytes.begin(), bytes.end()));
    while (said_.front().first + kLate < now) said_.pop_front();
}

bool Truth::is_chance(ByteView bytes) const {
    return std::ranges::none_of(said_, [&](const auto& entry) {
        return !std::ranges::search(entry.second, bytes).empty();
    });
}

std::uint64_t Truth::served(std::uint8_t station) const {
    const auto found = stations_.find(station);
    return found == stations_.end() ? 0 : found->second.served;
}

std::optional<TimePoint> Truth::executed(const std::string& write) const {
    const auto found = executed_.find(write);
    return found == executed_.end() ? std::nullopt : std::optional(found->second);
}

bool Truth::refused(std::uint8_t station, ByteView pdu, TimePoint since) const {
    const auto found = stations_.find(station);
    if (found == stations_.end()) return false;
    const auto refusal = found->second.refused.find(Bytes(pdu.begin(), pdu.end()));
    return refusal != found->second.refused.end() && refusal->second >= since;
}

const char* Truth::fault_of(const Read& read, std::uint16_t address, std::uint16_t value) const {
    static const Station kNothing;
    const auto found = stations_.find(read.station);
    const Station& station = found == stations_.end() ? kNothing : found->second;
    if (address < kMemory) {
        return moves_right(read, station, address, value)
                   ? nullptr
                   : "P1: a value that the station did not have between the question and the "
                     "answer";
    }
    return held(read, station, address, value)
               ? nullptr
               : "P6: a value older than a write that was known to be done";
}

/// The value must have been taken after the request came in: each request served changes it.
bool Truth::moves_right(const Read& read, const Station& station, std::uint16_t address,
                        std::uint16_t value) const {
    std::uint64_t before = read.served;
    if (read.age) {
        const TimePoint oldest = read.now - *read.age;
        before = 0;
        for (const auto& [at, served] : station.history) {
            if (at < oldest) before = served;
        }
    }
    const std::uint16_t low = moving_value(read.station, read.function, address, before + 1);
    const auto ahead = static_cast<std::uint16_t>(value - low);
    return before + 1 + ahead <= station.served;
}

bool Truth::held(const Read& read, const Station& station, std::uint16_t address,
                 std::uint16_t value) const {
    static const Cell kEmpty;
    const auto found = station.cells.find(address);
    const Cell& cell = found == station.cells.end() ? kEmpty : found->second;
    TimePoint since = read.since;
    if (read.age) since = std::max(since, std::max(read.now - *read.age, cell.asked));
    std::uint16_t held = 0;
    bool possible = false;
    for (const auto& [at, written] : cell.values) {
        if (at > since && held == value) possible = true;
        if (at > read.now) break;
        held = written;
    }
    return possible || held == value;
}

}  // namespace panelgate::scenario
