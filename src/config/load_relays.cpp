#include <algorithm>
#include <functional>

#include "load_stations.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::config {
namespace {

using points::Relay;
using points::RelayEnd;
using yaml::MapReader;
using yaml::Node;

struct End {
    RelayEnd end;
    const Station* station = nullptr;
    const profile::Area* area = nullptr;
};

const Station* find_station(const Config& config, std::string_view name) {
    for (const Line& line : config.lines) {
        for (const Station& station : line.stations) {
            if (station.name == name) return &station;
        }
    }
    return nullptr;
}

/// STATION/NOTATION
std::optional<End> load_end(Loading& loading, MapReader& in, std::string_view key) {
    const auto text = in.required_text(key);
    if (!text) return std::nullopt;
    const std::size_t slash = text->find('/');
    if (slash == text->npos || slash == 0 || slash + 1 == text->size()) {
        in.problem(key, std::string(key) + " must be STATION/NOTATION such as press/UW100, not '" +
                            *text + '\'');
        return std::nullopt;
    }
    End end;
    end.end.station = text->substr(0, slash);
    end.end.at = text->substr(slash + 1);
    end.station = find_station(loading.config, end.end.station);
    if (end.station == nullptr) {
        std::vector<std::string_view> names(loading.station_names.begin(),
                                            loading.station_names.end());
        in.problem(key, "there is no station '" + end.end.station + '\'' +
                            did_you_mean(end.end.station, names, "stations"));
        return std::nullopt;
    }
    const auto item = profile::parse_notation(*end.station->profile, end.end.at);
    if (!item) {
        in.problem(key, item.error().message);
        return std::nullopt;
    }
    end.area = item->area;
    end.end.table = item->area->table;
    end.end.address = item->address;
    return end;
}

void check_source(MapReader& in, const End& from, std::uint32_t count) {
    if (!from.area->readable.contains(from.end.address, count)) {
        in.problem("from", std::to_string(count) + " from " + from.end.at +
                               " reach beyond the end of " + from.area->name);
        return;
    }
    const unsigned most = from.station->profile->max_count(modbus::read_function(from.end.table));
    if (count > most) {
        in.problem("count", from.station->profile->name + " gives at most " + std::to_string(most) +
                                " in one read, not " + std::to_string(count));
    }
}

void check_target(MapReader& in, const End& to, std::uint32_t count) {
    const bool bits = modbus::is_bit_table(to.end.table);
    if (!to.area->writable || !to.area->writable->contains(to.end.address, count)) {
        in.problem("to", std::to_string(count) + " from " + to.end.at + " cannot be written (" +
                             to.area->source + ')');
        return;
    }
    if (to.station->read_only) in.problem("to", "station '" + to.station->name + "' is read_only");
    const auto function = bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters;
    const unsigned most = to.station->profile->find_function(function) != nullptr ||
                                  to.station->profile->functions.empty()
                              ? to.station->profile->max_count(function)
                              : 1;
    if (count > most) {
        in.problem("count", to.station->profile->name + " takes at most " + std::to_string(most) +
                                " in one write, not " + std::to_string(count));
    }
}

bool overlap(const RelayEnd& a, std::uint32_t a_count, const RelayEnd& b, std::uint32_t b_count) {
    return a.station == b.station && a.table == b.table && a.address < b.address + b_count &&
           b.address < a.address + a_count;
}

/// Two relays that write the same items: nobody could say which value they hold.
void check_overlap(MapReader& in, const Relay& relay, const std::vector<Relay>& others) {
    for (const Relay& other : others) {
        if (!overlap(relay.to, relay.count, other.to, other.count)) continue;
        in.problem("to", "overlaps what the relay " + other.name() + " writes");
        return;
    }
}

/// A chain of relays that ends where it began.
void check_loop(MapReader& in, const Relay& relay, const std::vector<Relay>& others) {
    std::vector<const Relay*> chain{&relay};
    const std::function<bool(const Relay&)> leads_back = [&](const Relay& from) {
        if (overlap(from.to, from.count, relay.from, relay.count)) return true;
        for (const Relay& next : others) {
            if (std::ranges::find(chain, &next) != chain.end()) continue;
            if (!overlap(from.to, from.count, next.from, next.count)) continue;
            chain.push_back(&next);
            if (leads_back(next)) return true;
            chain.pop_back();
        }
        return false;
    };
    if (!leads_back(relay)) return;
    std::string text;
    for (const Relay* step : chain) text += (text.empty() ? "" : ", then ") + step->name();
    in.problem("to", "relays in a circle: " + text);
}

void load_relay(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a relay");
    const auto from = load_end(loading, in, "from");
    const auto to = load_end(loading, in, "to");
    Relay relay;
    relay.count = static_cast<std::uint32_t>(in.integer("count", 1, 2040).value_or(1));
    relay.every = in.duration("every", 1ms, 24h).value_or(relay.every);
    relay.on_change = in.boolean("on_change").value_or(false);
    in.finish();
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
    check_overlap(in, relay, loading.config.relays);
    check_loop(in, relay, loading.config.relays);
    loading.config.relays.push_back(std::move(relay));
}

}  // namespace

void load_relays(Loading& loading, MapReader& root) {
    const Node* list = root.sequence("relays");
    if (list == nullptr) return;
    if (list->items.size() > points::kMaxRelays) {
        root.problem("relays", "at most " + std::to_string(points::kMaxRelays) + " relays, not " +
                                   std::to_string(list->items.size()));
        return;
    }
    for (const Node& node : list->items) load_relay(loading, node);
}

}  // namespace panelgate::config
