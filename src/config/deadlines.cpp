#include "panelgate/config/deadlines.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "tables.hpp"

namespace panelgate::config {

/// One read of a station, and the size of its reply's values.
struct Read {
    std::string what;
    std::size_t count = 0;
    bool bits = false;
    Duration response_timeout{};

    std::size_t bytes() const { return bits ? (count + 7) / 8 : 2 * count; }
    /// Time of the two frames alone, the lower bound of any read.
    Duration on_wire(const SerialFormat& serial) const;
};

/// The longest of the poll blocks.
std::optional<Read> longest_poll(const Line& line);
/// The longest read that a client may request of any station.
std::optional<Read> longest_read(const Line& line);
/// Returns how many items a read may have whose two frames take less than `within`; 0 if none.
std::size_t most_items(const SerialFormat& serial, bool bits, Duration within);

const Station* forbids_broadcasts(const Config& config, const tcp_server::Settings& listener) {
    if (listener.units.contains(0)) return nullptr;  // alias of one station, or of one line
    for (const Line& line : config.lines) {
        if (std::ranges::count(listener.lines, line.name) == 0) continue;
        const auto found = std::ranges::find_if(line.stations, &Station::read_only);
        if (found != line.stations.end()) return &*found;
    }
    return nullptr;
}

namespace {

/// A read and its reply, without the values.
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

namespace {

constexpr Duration kDeadline = kQuickClient - 50ms;  // the rest is for the network and the client
constexpr Duration kMinTimeout = 50ms;  // shorter is too short for many panels and adapters
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

/// Returns how long each attempt may wait so that the last one still gets its reply in time: each
/// sends a request and keeps a gap, and one brings `values` bytes.
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
    if (wait() < kMinTimeout) quick.retries = 0;
    if (wait() < kMinTimeout) {
        quick.most_registers = most_items(line.device.serial, false, kDeadline / 2);
        values = 2 * *quick.most_registers;
    }
    quick.response_timeout = wait();
    if (quick.response_timeout >= kMinTimeout && quick.most_registers != std::size_t{0})
        client.quick = quick;
    return client;
}

// What the queue's deadline makes impossible: legal, but always answered 0B or 06.

namespace {

using yaml::format_milliseconds;
using yaml::Mark;
using yaml::Node;

const Node* find(const Node* map, std::string_view key) {
    return map == nullptr ? nullptr : map->find(key);
}

/// Returns where the `timing` of a line or a station sets the longest wait, if it does.
std::optional<Mark> timeout_mark(const Node& body, const arbiter::StationSettings& settings) {
    const Node* timing = find(&body, "timing");
    const Node* ceiling = settings.adaptive_timeout ? find(timing, "adaptive_ceiling") : nullptr;
    const Node* value = ceiling == nullptr ? find(timing, "response_timeout") : ceiling;
    if (value == nullptr) return std::nullopt;
    return value->mark;
}

Mark deadline_mark(const Node& line) {
    const Node* deadline = find(find(&line, "queue"), "deadline");
    return deadline == nullptr ? line.mark : deadline->mark;
}

struct Wait {
    Duration timeout{};
    Mark mark;
};

/// Returns the longest wait of all stations and the key that sets it; the deadline's if none does.
Wait longest_wait(const Node& node, const Line& line) {
    const arbiter::StationSettings& unlisted = line.arbiter.unlisted;
    const Mark common = timeout_mark(node, unlisted).value_or(deadline_mark(node));
    Wait longest;
    if (!line.refuse_unlisted) longest = {unlisted.response_timeout, common};
    const Node* list = find(&node, "stations");
    for (std::size_t i = 0; i < line.arbiter.stations.size(); ++i) {
        const arbiter::StationSettings& own = line.arbiter.stations[i];
        if (own.response_timeout > longest.timeout)
            longest = {own.response_timeout, timeout_mark(list->items[i], own).value_or(common)};
    }
    return longest;
}

/// A rest of a station behind its reply, and the key that sets the rest.
struct Rest {
    std::string_view key;
    Duration time{};
    Mark mark;
};

/// Replaces `longest` by a longer rest of these settings.
void consider(const arbiter::StationSettings& settings, const Node& body, Mark otherwise,
              Rest& longest) {
    const auto take = [&](std::string_view key, Duration time) {
        if (time <= longest.time) return;
        const Node* value = find(find(&body, "timing"), key);
        longest = {key, time, value == nullptr ? otherwise : value->mark};
    };
    take("station_gap", settings.station_gap);
    take("after_write", settings.after_write);
}

/// Returns the longest rest of all stations.
Rest longest_rest(const Node& node, const Line& line) {
    Rest longest;
    consider(line.arbiter.unlisted, node, node.mark, longest);
    const Node* list = find(&node, "stations");
    for (std::size_t i = 0; i < line.arbiter.stations.size(); ++i)
        consider(line.arbiter.stations[i], list->items[i], node.mark, longest);
    return longest;
}

/// A request right behind a reply waits for all of the rest.
void warn_of_rest(Loading& loading, const Rest& rest, Duration deadline) {
    const std::string key(rest.key);
    const std::string time = format_milliseconds(rest.time);
    loading.warn(rest.mark,
                 key + ' ' + time + " is not below the queue's deadline of " +
                     format_milliseconds(deadline) +
                     ": a request that comes right behind the reply is answered 06; raise "
                     "queue.deadline above " +
                     time + ", or lower " + key);
}

bool fits(const std::optional<Read>& read, const Line& line) {
    return !read || read->on_wire(line.device.serial) < line.arbiter.queue.deadline;
}

void warn_of_read(Loading& loading, const Node& node, const Line& line, const Read& read) {
    const SerialFormat& serial = line.device.serial;
    const Duration wire = read.on_wire(serial);
    const Duration enough = std::chrono::ceil<std::chrono::seconds>(wire + read.response_timeout);
    const std::string noun = read.bits ? " bits" : " registers";
    const std::size_t most = most_items(serial, read.bits, line.arbiter.queue.deadline);
    loading.warn(deadline_mark(node),
                 read.what + " (" + std::to_string(read.count) + noun + ") takes " +
                     format_milliseconds(wire) + " on the wire at " + to_string(serial) +
                     " and can never be answered before the queue's deadline of " +
                     format_milliseconds(line.arbiter.queue.deadline) +
                     ": set queue: {deadline: " + format_milliseconds(enough) + "}" +
                     (most == 0 ? "" : ", or ask for at most " + std::to_string(most) + noun));
}

}  // namespace

void warn_of_deadline(Loading& loading, const Node& node, const Line& line) {
    const Duration deadline = line.arbiter.queue.deadline;
    const Wait wait = longest_wait(node, line);
    if (wait.timeout >= deadline) {
        loading.warn(wait.mark,
                     "response_timeout " + format_milliseconds(wait.timeout) +
                         " is not below the queue's deadline of " + format_milliseconds(deadline) +
                         ": no reply that late is ever waited for; raise "
                         "queue.deadline above " +
                         format_milliseconds(wait.timeout) + ", or lower response_timeout");
    }
    if (const Rest rest = longest_rest(node, line); rest.time >= deadline)
        warn_of_rest(loading, rest, deadline);
    const std::optional<Read> poll = longest_poll(line);
    const std::optional<Read> read = longest_read(line);
    if (!fits(poll, line)) {
        warn_of_read(loading, node, line, *poll);
    } else if (!fits(read, line)) {
        warn_of_read(loading, node, line, *read);
    }
}

}  // namespace panelgate::config
