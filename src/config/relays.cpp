// Relays: their rows, and what may not be copied.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using points::Relay;
using yaml::Node;

/// Where items really are, in bits: a panel may show the same memory as words and as bits.
struct Memory {
    const Station* station = nullptr;
    modbus::Span bits;

    bool overlaps(const Memory& other) const {
        return station == other.station && bits.overlaps(other.bits);
    }
};

/// What a relay copies: item for item, in the same order; both have the same length.
struct Copy {
    Memory from;
    Memory to;
};

/// One bit of one panel.
struct Item {
    const Station* station = nullptr;
    modbus::Table table = modbus::Table::holding_registers;
    std::uint32_t bit = 0;

    friend bool operator==(const Item&, const Item&) = default;
};

/// Follows items back to their sources. One relay at most writes an item, so an item has one path.
class SourceTrace {
  public:
    explicit SourceTrace(const std::vector<Copy>& copies) : copies_(copies) {
        for (std::size_t i = 0; i < copies.size(); ++i) {
            const Memory& to = copies[i].to;
            by_target_.emplace(std::tuple(to.station, to.bits.table, to.bits.first), i);
        }
    }

    /// Returns the copy that writes the item.
    std::optional<std::size_t> writer(const Item& item) const {
        auto next = by_target_.upper_bound(std::tuple(item.station, item.table, item.bit));
        if (next == by_target_.begin()) return std::nullopt;
        const std::size_t copy = std::prev(next)->second;
        const Memory& to = copies_[copy].to;
        if (to.station != item.station || !to.bits.contains({item.table, item.bit, 1}))
            return std::nullopt;
        return copy;
    }
    Item source(const Item& item, std::size_t copy) const {
        const auto& [from, to] = copies_[copy];
        return {from.station, from.bits.table, from.bits.first + item.bit - to.bits.first};
    }

  private:
    const std::vector<Copy>& copies_;
    std::map<std::tuple<const Station*, modbus::Table, std::uint32_t>, std::size_t> by_target_;
};

/// Returns how many bits share a path: a word if all copies are of whole words.
std::uint32_t stride(const std::vector<Copy>& copies) {
    constexpr std::uint32_t kWord = 16;
    const auto whole = [](const Memory& memory) {
        return memory.bits.first % kWord == 0 && memory.bits.count % kWord == 0;
    };
    const bool words = std::ranges::all_of(
        copies, [&](const Copy& copy) { return whole(copy.from) && whole(copy.to); });
    return words ? kWord : 1;
}

/// Orders copies as the values flow, starting with `last`, each once.
std::vector<std::size_t> in_order(std::vector<std::size_t> back, std::size_t last) {
    std::ranges::reverse(back);
    std::ranges::rotate(back, std::ranges::find(back, last));
    std::vector<std::size_t> once;
    for (const std::size_t copy : back) {
        if (std::ranges::find(once, copy) == once.end()) once.push_back(copy);
    }
    return once;
}

/// Returns the last of `copies` and those that bring an item of its source back to where it was, in
/// that order; empty if there is no cycle. The others must have no cycle; no two targets overlap.
std::vector<std::size_t> find_cycle(const std::vector<Copy>& copies) {
    const SourceTrace way(copies);
    const std::size_t last = copies.size() - 1;
    const Memory& from = copies[last].from;
    const std::uint32_t step = stride(copies);
    std::vector<bool> passed(from.bits.count);  // every cycle goes through `last`
    for (std::uint32_t i = 0; i < from.bits.count; i += step) {
        const Item begin{from.station, from.bits.table, from.bits.first + i};
        std::vector<std::size_t> back;
        Item item = begin;
        while (const auto copy = way.writer(item)) {
            back.push_back(*copy);
            item = way.source(item, *copy);
            if (item == begin) return in_order(std::move(back), last);
            if (*copy != last) continue;
            const std::uint32_t offset = item.bit - from.bits.first;
            if (passed[offset]) break;
            passed[offset] = true;
        }
    }
    return {};
}

struct End {
    points::RelayEnd end;
    const Station* station = nullptr;
    const profile::Area* area = nullptr;
};

struct Route {
    Relay relay;
    Memory from;
    Memory to;
};

/// STATION/NOTATION
bool read_end(Reader& in, std::string_view key, points::RelayEnd& end) {
    const auto text = in.text(key);
    if (!text) return false;
    const std::size_t slash = text->find('/');
    if (slash == text->npos || slash == 0 || slash + 1 == text->size()) {
        in.problem(key, std::string(key) + " must be STATION/NOTATION such as press/UW100, not " +
                            yaml::quote(*text));
        return false;
    }
    end.station = text->substr(0, slash);
    end.at = text->substr(slash + 1);
    return true;
}

/// What an end names.
std::optional<End> find_end(Reader& in, std::string_view key, const points::RelayEnd& named) {
    End end{named, find_station(in, key, named.station)};
    if (end.station == nullptr) return std::nullopt;
    if (end.station->listens) {
        in.problem(key, "station '" + named.station +
                            "' is on a line that is only listened to (mode: listen): a relay can "
                            "neither read nor write there");
        return std::nullopt;
    }
    const auto item = find_item(in, key, named.at, *end.station->profile);
    if (!item) return std::nullopt;
    end.area = item->area;
    end.end.table = item->area->table;
    end.end.address = item->address;
    return end;
}

void check_source(Reader& in, const End& from, std::uint32_t count) {
    if (!from.area->readable.contains(from.end.address, count)) {
        in.problem("from", std::to_string(count) + " from " + from.end.at +
                               " reach beyond the end of " + from.area->name);
        return;
    }
    check_read_count(in, "count", *from.station->profile, from.end.table, count);
}

void check_target(Reader& in, const End& to, std::uint32_t count) {
    const bool bits = modbus::is_bit_table(to.end.table);
    if (!to.area->writable || !to.area->writable->contains(to.end.address, count)) {
        in.problem("to", std::to_string(count) + " from " + to.end.at + " cannot be written (" +
                             to.area->source + ')');
        return;
    }
    if (to.station->read_only)
        in.problem("to", "station '" + to.station->name +
                             "' is read_only; give it access: read_write, or leave the relay out");
    const profile::PanelProfile& profile = *to.station->profile;
    const auto one = bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister;
    const auto several = bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters;
    const unsigned most = profile.has_function(several) ? profile.max_count(several)
                          : profile.has_function(one)   ? 1
                                                        : 0;
    if (most == 0) {
        in.problem("to", profile.name + " has no function that writes " + to.area->name);
    } else if (count > most) {
        in.problem("count", profile.name + " takes at most " + std::to_string(most) +
                                " in one write, not " + std::to_string(count));
    }
}

Memory memory_of(const End& end, std::uint32_t count) {
    const profile::Area* words =
        end.station->profile->find_area(std::string_view(end.area->view_of));
    const modbus::Table table = words != nullptr ? words->table : end.area->table;
    const std::uint32_t width = modbus::is_bit_table(end.area->table) ? 1 : 16;
    return {end.station, {table, end.end.address * width, count * width}};
}

/// Returns false and adds a problem if two relays write the same items: their value would be
/// undefined.
bool check_overlap(Reader& in, const Route& route, const std::vector<Route>& others) {
    for (const Route& other : others) {
        if (!route.to.overlaps(other.to)) continue;
        in.problem("to", "overlaps what the relay " + other.relay.name() + " writes");
        return false;
    }
    return true;
}

/// Returns false and adds a problem if it closes a cycle.
bool check_loop(Reader& in, const Route& route, const std::vector<Route>& others) {
    if (route.from.overlaps(route.to)) {
        in.problem("to", route.relay.to.at + " overlaps what the relay itself reads, " +
                             route.relay.from.at + ": its values would wander");
        return false;
    }
    std::vector<Copy> copies;
    copies.reserve(others.size() + 1);
    for (const Route& other : others) copies.push_back({other.from, other.to});
    copies.push_back({route.from, route.to});
    const std::vector<std::size_t> cycle = find_cycle(copies);
    if (cycle.empty()) return true;
    std::string text;
    for (const std::size_t step : cycle) {
        const Relay& relay = step < others.size() ? others[step].relay : route.relay;
        text += (text.empty() ? "" : ", then ") + relay.name();
    }
    in.problem("to", "relays in a circle: " + text);
    return false;
}

void load_relay(Reader& root, const Node& node, Config& config, std::vector<Route>& routes) {
    Reader in(root.loading, node, "a relay", "{from: press/UW100, to: oven/GDT200}");
    Relay relay;
    const Given given = relay_keys().read(in, relay);
    if (in.has("refresh") && !relay.on_change)
        in.warn("refresh",
                "refresh has no effect without on_change: true: this relay writes every turn");
    in.finish();
    const auto from = given.has("from") ? find_end(in, "from", relay.from) : std::nullopt;
    const auto to = given.has("to") ? find_end(in, "to", relay.to) : std::nullopt;
    if (!from || !to) return;
    relay.from = from->end;
    relay.to = to->end;
    if (modbus::is_bit_table(relay.from.table) != modbus::is_bit_table(relay.to.table)) {
        in.problem("to", relay.from.at + " and " + relay.to.at +
                             " do not fit: one holds bits, the other registers");
        return;
    }
    check_source(in, *from, relay.count);
    check_target(in, *to, relay.count);
    const Route route{relay, memory_of(*from, relay.count), memory_of(*to, relay.count)};
    if (check_overlap(in, route, routes) && check_loop(in, route, routes)) routes.push_back(route);
    config.relays.push_back(std::move(relay));
}

}  // namespace

namespace {

const Station* find_station(Loading& loading, yaml::Mark mark, const std::string& name) {
    if (const Station* const station = station_named(loading.config, name)) return station;
    const std::vector<std::string_view> names(loading.station_names.begin(),
                                              loading.station_names.end());
    if (!loading.names_missing) loading.problems.add(mark, yaml::no_such("station", name, names));
    return nullptr;
}

}  // namespace

const Station* find_station(Reader& in, std::string_view key, const std::string& name) {
    return find_station(in.loading, in.mark(key), name);
}

std::optional<PointPath> parse_point_path(const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == text.npos || slash == 0 || slash + 1 == text.size()) return std::nullopt;
    return PointPath{text.substr(0, slash), text.substr(slash + 1)};
}

const points::Point* find_point(Loading& loading, yaml::Mark mark, const PointPath& path) {
    const Station* const station = find_station(loading, mark, path.station);
    if (station == nullptr) return nullptr;
    const auto found = std::ranges::find(station->points, path.point, &points::Point::name);
    if (found != station->points.end()) return &*found;
    std::vector<std::string_view> names;
    for (const points::Point& point : station->points) names.push_back(point.name);
    loading.problems.add(mark, yaml::no_such("point", path.point, names));
    return nullptr;
}

const Keys<Relay>& relay_keys() {
    const auto text = [](const points::RelayEnd& end) {
        return end.station.empty() ? "" : end.station + '/' + end.at;
    };
    const Form form{"^[^/]+/."};
    static const auto kKeys =
        Keys<Relay>()
            .value(
                text_shape("from", form, "Source: STATION/NOTATION, such as press/UW100."),
                [](Reader& in, Relay& relay) { return read_end(in, "from", relay.from); },
                [=](const Relay& relay) { return text(relay.from); })
            .required()
            .example("press/UW100")
            .value(
                text_shape("to", form, "Target: STATION/NOTATION."),
                [](Reader& in, Relay& relay) { return read_end(in, "to", relay.to); },
                [=](const Relay& relay) { return text(relay.to); })
            .required()
            .example("press/UW200")
            .integer("count", &Relay::count, 1, 2040, "Number of registers or bits.")
            .weaker(By::growing)
            .example("8")
            .duration("every", &Relay::every, 1ms, points::kSlowest, "Interval between two reads.")
            .example("1s")
            .boolean("on_change", &Relay::on_change, "Writes only what has changed.")
            .duration("refresh", &Relay::refresh, 1s, points::kSlowest,
                      "With on_change: writes all again that often; what other clients write "
                      "there is overwritten within a second.");
    return kKeys;
}

bool load_relays(Reader& root, Config& config) {
    std::vector<Route> routes;
    for (const Node& node :
         root.entries("relays", "[{from: press/UW100, to: oven/GDT200}]", points::kMaxRelays))
        load_relay(root, node, config, routes);
    return !routes.empty();
}

}  // namespace panelgate::config
