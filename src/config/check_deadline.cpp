// What the queue's deadline makes impossible: legal, and always answered 0B or 06.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "load_stations.hpp"
#include "longest_read.hpp"
#include "panelgate/base/serial_format.hpp"

namespace panelgate::config {
namespace {

using yaml::format_milliseconds;
using yaml::Mark;
using yaml::Node;

const Node* find(const Node* map, std::string_view key) {
    if (map == nullptr) return nullptr;
    for (const yaml::Entry& entry : map->entries) {
        if (entry.key == key) return &entry.value;
    }
    return nullptr;
}

/// Where the `timing` of a line or a station sets the longest wait, if it does.
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

/// The longest wait of all stations, and the key that sets it: the deadline's when none does.
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
    const std::optional<Read> poll = longest_poll(line);
    const std::optional<Read> read = longest_read(line);
    if (!fits(poll, line)) {
        warn_of_read(loading, node, line, *poll);
    } else if (!fits(read, line)) {
        warn_of_read(loading, node, line, *read);
    }
}

}  // namespace panelgate::config
