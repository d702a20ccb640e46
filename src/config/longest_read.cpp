#include "longest_read.hpp"

#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::config {
namespace {

/// A read and its reply, but for the values.
constexpr std::size_t kReadOverhead = modbus::kReadRequestAdu + modbus::kReadReplyOverhead;

void keep_longer(std::optional<Read>& longest, Read read) {
    if (!longest || read.bytes() > longest->bytes()) longest = std::move(read);
}

}  // namespace

Duration Read::on_wire(const SerialFormat& serial) const {
    return frame_time(serial, kReadOverhead + bytes(), 2);
}

std::optional<Read> longest_poll(const Line& line) {
    std::optional<Read> longest;
    for (std::size_t i = 0; i < line.stations.size(); ++i) {
        const Station& station = line.stations[i];
        for (const points::Poll& poll : station.polls) {
            keep_longer(
                longest,
                {"the poll of " + poll.read + " of station '" + station.name + '\'', poll.count,
                 modbus::is_bit_table(poll.table), line.arbiter.stations[i].response_timeout});
        }
    }
    return longest;
}

std::optional<Read> longest_read(const Line& line) {
    std::optional<Read> longest;
    const auto add = [&](const std::string& who, const arbiter::StationSettings& settings) {
        const std::string what = "the longest read of " + who;
        keep_longer(longest, {what, settings.max_registers, false, settings.response_timeout});
        keep_longer(longest, {what, settings.max_bits, true, settings.response_timeout});
    };
    for (std::size_t i = 0; i < line.stations.size(); ++i)
        add("station '" + line.stations[i].name + '\'', line.arbiter.stations[i]);
    if (!line.refuse_unlisted) add("an unlisted station", line.arbiter.unlisted);
    return longest;
}

std::size_t most_items(const SerialFormat& serial, bool bits, Duration within) {
    const auto characters = static_cast<std::size_t>((within - 1ns) / character_time(serial));
    const bool ascii = serial.mode == SerialMode::ascii;
    const std::size_t overhead = ascii ? 2 * kReadOverhead + 2 : kReadOverhead;
    if (characters <= overhead) return 0;
    const std::size_t bytes = (characters - overhead) / (ascii ? 2 : 1);
    return bits ? bytes * 8 : bytes / 2;
}

}  // namespace panelgate::config
