#include <algorithm>
#include <utility>

#include "changes.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::plan {
namespace {

/// The panel takes them in one request, and its memory has them in one piece.
bool can_read(const Line& line, const Relay::End& end) {
    const Station& station = line.stations[end.station];
    const profile::Area* area = station.profile->find_area(end.span.table, end.span.first);
    return area != nullptr && area->readable.contains(end.span.first, end.span.count) &&
           end.span.count <= limits_of(line, station).of(end.span.table).max_items;
}

bool can_write(const Line& line, const Relay::End& end) {
    const profile::PanelProfile& panel = *line.stations[end.station].profile;
    const profile::Area* area = panel.find_area(end.span.table, end.span.first);
    const auto function = modbus::is_bit_table(end.span.table) ? modbus::kWriteMultipleCoils
                                                               : modbus::kWriteMultipleRegisters;
    return area != nullptr && area->writable &&
           area->writable->contains(end.span.first, end.span.count) &&
           end.span.count <= panel.max_count(function);
}

/// What one relay writes another one may read: joined with its neighbour it could close a circle.
bool is_read_on(const Line& line, std::size_t station) {
    return std::ranges::any_of(line.relays, [&](const Relay& relay) {
        return relay.from && relay.from->station == station;
    });
}

/// One relay in the place of both.
std::optional<Relay> merged(const Line& line, const Relay& a, const Relay& b) {
    if (!a.continues_in(b) || is_read_on(line, a.to->station)) return std::nullopt;
    Relay both = a;
    both.from->span.count += b.from->span.count;
    both.to->span.count += b.to->span.count;
    if (!can_read(line, *both.from) || !can_write(line, *both.to)) return std::nullopt;
    return both;
}

/// Joins the first two that can be; false when there are none.
bool merge_two(Line& line, std::string& which) {
    for (Relay& first : line.relays) {
        for (auto next = line.relays.begin(); next != line.relays.end(); ++next) {
            const auto both = merged(line, first, *next);
            if (!both) continue;
            which += (which.empty() ? "" : ", ") + first.name + " and " + next->name;
            first = *both;
            line.relays.erase(next);
            return true;
        }
    }
    return false;
}

}  // namespace

std::optional<Change> fewer_relays(const Line& line) {
    Line made = line;
    std::string which;
    while (merge_two(made, which)) {
    }
    if (which.empty()) return std::nullopt;
    return Change{"one relay instead of " + which, std::move(made)};
}

}  // namespace panelgate::plan
