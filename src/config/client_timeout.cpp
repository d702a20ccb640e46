#include "panelgate/config/client_timeout.hpp"

#include <algorithm>

#include "longest_read.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::config {
namespace {

constexpr Duration kDeadline = kQuickClient - 50ms;  // the rest is for the network and the client
constexpr Duration kLeast = 50ms;  // less is too short for many panels and adapters
constexpr Duration kStep = 10ms;

int most_retries(const arbiter::Settings& line) {
    int most = line.unlisted.retries;
    for (const arbiter::StationSettings& station : line.stations)
        most = std::max(most, station.retries);
    return most;
}

Duration longest_gap(const Line& line) {
    Duration gap = line.arbiter.unlisted.frame_gap.value_or(silent_interval(line.device.serial));
    for (const arbiter::StationSettings& station : line.arbiter.stations)
        gap = std::max(gap, station.frame_gap.value_or(Duration::zero()));
    return gap;
}

/// How long each attempt may wait, so that the last of them still has its reply in time: all send
/// a request and keep a gap, and one brings `values` bytes.
Duration wait_of(const Line& line, int retries, std::size_t values) {
    const SerialFormat& serial = line.device.serial;
    const Duration request = frame_time(serial, modbus::kReadRequestAdu) + longest_gap(line);
    const Duration reply = frame_time(serial, modbus::kReadReplyOverhead + values);
    const Duration each = (kDeadline - reply) / (retries + 1) - request;
    return std::max(each / kStep * kStep, Duration::zero());
}

}  // namespace

ClientTimeout client_timeout(const Line& line) {
    ClientTimeout client{line.arbiter.queue.deadline, std::nullopt};
    if (client.worst <= kDeadline) return client;
    QuickSettings quick{kDeadline, {}, most_retries(line.arbiter), std::nullopt};
    const auto longest = longest_read(line);
    std::size_t values = longest ? longest->bytes() : 0;
    const auto wait = [&] { return wait_of(line, quick.retries, values); };
    if (wait() < kLeast) quick.retries = 0;
    if (wait() < kLeast) {
        quick.most_registers = most_items(line.device.serial, false, kDeadline / 2);
        values = 2 * *quick.most_registers;
    }
    quick.response_timeout = wait();
    if (quick.response_timeout >= kLeast && quick.most_registers != std::size_t{0})
        client.quick = quick;
    return client;
}

}  // namespace panelgate::config
