// Modbus/TCP listeners: rows of the table, and the panels that a listener's clients reach.

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hints.hpp"
#include "listen.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using modbus::Framing;
using tcp_server::BroadcastMode;
using tcp_server::Exceptions;
using tcp_server::Retransmissions;
using tcp_server::Settings;
using yaml::Node;

/// Returns nullptr and adds a problem at `mark` if there is none.
const Line* find_line(Loading& loading, yaml::Mark mark, const std::string& name) {
    if (const Line* line = find_line(loading.config, name)) return line;
    if (loading.names_missing) return nullptr;
    std::vector<std::string_view> names;
    for (const Line& line : loading.config.lines) names.push_back(line.name);
    const std::string commas = missing_commas(name);
    loading.problems.add(mark, commas.empty() ? yaml::no_such("line", name, names)
                                              : "there is no line " + yaml::quote(name) + commas);
    return nullptr;
}

void warn_of_refusals(Loading& loading, yaml::Mark mark, const Line& line) {
    loading.warn(mark, "line '" + line.name +
                           "' is only listened to (mode: listen): every request to it is refused "
                           "(0A); leave it out");
}

/// A line of the list; without the list all that are not only listened to.
bool read_lines(Reader& in, Settings& settings) {
    Loading& loading = in.loading;
    for (const Node* item : in.items("lines", "[floor1]", "all")) {
        const Line* line = find_line(loading, item->mark, item->scalar);
        if (line == nullptr) continue;
        if (line->listens) warn_of_refusals(loading, item->mark, *line);
        if (std::ranges::find(settings.lines, item->scalar) != settings.lines.end())
            loading.problems.add(item->mark, "line '" + item->scalar + "' is listed twice");
        else
            settings.lines.push_back(item->scalar);
    }
    if (in.child("lines") != nullptr) return true;
    for (const Line& line : loading.config.lines)
        if (!line.listens) settings.lines.push_back(line.name);
    return false;
}

/// Finds a station of `line` by id or name; 0 is a broadcast to it.
std::optional<std::uint8_t> find_station(const Line& line, const std::string& text) {
    const auto id = yaml::parse_integer(text);
    for (const Station& known : line.stations) {
        if (known.name == text || (id && *id == known.id)) return known.id;
    }
    const bool passes = id && *id >= 0 && *id <= modbus::kMaxStation;
    if (!passes || (*id != 0 && line.refuse_unlisted)) return std::nullopt;
    return static_cast<std::uint8_t>(*id);
}

/// Warns of a station that is missing from its line's list, if the line has one.
void warn_of_unlisted(Loading& loading, yaml::Mark mark, const Line& line, std::uint8_t station) {
    const bool listed = std::ranges::count(line.stations, station, &Station::id) > 0;
    if (listed || line.stations.empty()) return;
    loading.warn(mark, "line '" + line.name + "' does not list station " + std::to_string(station) +
                           ": requests to it are passed on, and nothing is known of it; add it to "
                           "'stations', or correct the number");
}

/// Suggests the line of a station that was named without one.
std::string line_hint(const Config& config, const std::string& station) {
    for (const Line& line : config.lines) {
        for (const Station& known : line.stations) {
            if (known.name == station || std::to_string(known.id) == station)
                return "; write " + line.name + '/' + station;
        }
    }
    return "";
}

/// Where a unit leads, before its station is looked up.
struct UnitPlace {
    const Line* line = nullptr;
    std::string station;
};

/// Splits "floor1/31", "floor1/press" or "floor1/1-31"; problems at `node`.
std::optional<UnitPlace> unit_place(Loading& loading, const Node& node) {
    const std::size_t slash = node.scalar.find('/');
    if (slash == std::string::npos) {
        loading.problems.add(node.mark, "a unit points to LINE/STATION such as floor1/31, not " +
                                            yaml::quote(node.scalar) +
                                            line_hint(loading.config, node.scalar));
        return std::nullopt;
    }
    const Line* line = find_line(loading, node.mark, node.scalar.substr(0, slash));
    if (line == nullptr) return std::nullopt;
    if (line->listens) warn_of_refusals(loading, node.mark, *line);
    return UnitPlace{line, node.scalar.substr(slash + 1)};
}

/// Looks up the station, by id or name; problems at `mark`.
std::optional<tcp_server::UnitTarget> unit_target(Loading& loading, yaml::Mark mark,
                                                  const UnitPlace& place) {
    const Line& line = *place.line;
    const auto station = find_station(line, place.station);
    if (station && *station != 0) warn_of_unlisted(loading, mark, line, *station);
    if (station) return tcp_server::UnitTarget{line.name, *station};
    if (loading.names_missing) return std::nullopt;
    std::vector<std::string_view> names;
    names.reserve(line.stations.size());
    for (const Station& known : line.stations) names.push_back(known.name);
    loading.problems.add(mark, "line '" + line.name + "' has no station " +
                                   yaml::quote(place.station) +
                                   did_you_mean(place.station, names, "stations"));
    return std::nullopt;
}

/// A number, or "201-231": the first and the last one.
struct Numbers {
    std::int64_t first = 0;
    std::int64_t last = 0;
    std::int64_t count() const { return last - first + 1; }
};

std::optional<Numbers> parse_numbers(std::string_view text, std::int64_t most) {
    const std::size_t dash = text.find('-');
    const auto first = yaml::parse_integer(text.substr(0, dash));
    const auto last = dash == text.npos ? first : yaml::parse_integer(text.substr(dash + 1));
    if (!first || !last || *first < 0 || *last < *first || *last > most) return std::nullopt;
    return Numbers{*first, *last};
}

/// Returns the first station of "floor1/1-31", which goes with as many units; problems at `mark`.
std::optional<std::int64_t> first_station(Loading& loading, yaml::Mark mark,
                                          const std::string& typed, const Numbers& units) {
    const auto stations = parse_numbers(typed, modbus::kMaxStation);
    if (stations && stations->first > 0 && stations->count() == units.count())
        return stations->first;
    loading.problems.add(
        mark, std::to_string(units.count()) + " units lead to as many stations, such as floor1/1-" +
                  std::to_string(units.count()) + ", not to " + yaml::quote(typed));
    return std::nullopt;
}

void read_unit(Reader& in, const yaml::Entry& entry, Settings& settings) {
    const auto units = parse_numbers(entry.key, 255);
    if (!units)
        return in.problems().add(entry.mark,
                                 "a unit id is a number from 0 to 255, or a range such "
                                 "as 201-231, not " +
                                     yaml::quote(entry.key));
    auto place = unit_place(in.loading, entry.value);
    if (!place) return;
    std::optional<std::int64_t> station;
    if (units->count() > 1) {
        station = first_station(in.loading, entry.value.mark, place->station, *units);
        if (!station) return;
    }
    for (std::int64_t unit = units->first; unit <= units->last; ++unit) {
        if (station) place->station = std::to_string((*station)++);
        const auto target = unit_target(in.loading, entry.value.mark, *place);
        if (!target) return;
        if (!settings.units.emplace(static_cast<std::uint8_t>(unit), *target).second)
            return in.problems().add(entry.mark,
                                     "unit " + std::to_string(unit) + " is in 'units' twice");
    }
}

bool read_units(Reader& in, Settings& settings) {
    const Node* map = in.map("units", "{101: floor1/31}");
    if (map == nullptr) return false;
    for (const yaml::Entry& entry : map->entries) read_unit(in, entry, settings);
    return true;
}

KeyShape units_shape(std::int64_t first, std::int64_t last) {
    KeyShape shape = shape_of("units", Kind::map,
                              "Further unit ids (0 to 255, of a serial master 1 to 247), each to "
                              "LINE/STATION, or a range to as many stations, such as "
                              "201-231: floor2/1-31; needed where two lines have the same station "
                              "id.");
    const std::string number = yaml::integer_pattern(first, last);
    shape.keys = '^' + number + "(-" + number + ")?$";
    shape.weaker.by = By::any;
    shape.pattern = "^[^/]+/.";
    shape.may_be_number = false;
    return shape;
}

/// Returns the station of the listener's lines with this id; nullptr if there is none.
const Station* station_with_id(const Config& config, const tcp_server::Settings& settings,
                               std::int64_t id) {
    for (const std::string& name : settings.lines) {
        const std::vector<Station>& stations = find_line(config, name)->stations;
        const auto found = std::ranges::find(stations, id, &Station::id);
        if (found != stations.end()) return &*found;
    }
    return nullptr;
}

/// The gateway's own unit must not hide a station.
void check_diagnostics(Reader& in, const Settings& settings) {
    if (!settings.diagnostics_unit) return;
    const std::uint8_t unit = *settings.diagnostics_unit;
    const std::string number = std::to_string(unit);
    if (settings.units.contains(unit))
        in.problem("diagnostics_unit", "unit " + number + " is in 'units' already");
    if (const Station* hidden = station_with_id(in.loading.config, settings, unit))
        in.problem("diagnostics_unit",
                   "diagnostics_unit " + number + " hides station '" + hidden->name + '\'');
}

bool read_diagnostics(Reader& in, Settings& settings) {
    if (!in.has("diagnostics_unit")) return false;
    settings.diagnostics_unit.reset();
    const Node* given = in.child("diagnostics_unit");
    if (given == nullptr) return true;
    constexpr std::array<std::string_view, 4> kNone{"off", "none", "no", "false"};
    if (std::ranges::find(kNone, given->scalar) != kNone.end()) {
        in.problem("diagnostics_unit",
                   "diagnostics_unit must be a whole number from 1 to 255, not " +
                       yaml::quote(given->scalar) + "; write null for none");
        return false;
    }
    const auto unit = in.integer("diagnostics_unit", 1, 255);
    if (unit) settings.diagnostics_unit = static_cast<std::uint8_t>(*unit);
    return unit.has_value();
}

/// What RTU and ASCII do not support.
void check_framing(Reader& in, const Settings& settings) {
    if (settings.framing == Framing::tcp) return;
    const std::string here = " with framing: " + std::string(modbus::label(settings.framing));
    if (in.has("broadcast") && settings.broadcast == BroadcastMode::reply)
        in.problem("broadcast", "no request to unit 0 is answered" + here +
                                    "; write silent or deny, or leave it out for silent");
    if (settings.retransmissions == Retransmissions::join)
        in.problem("retransmissions", "requests have no transaction id" + here +
                                          ", so none is known again; leave it out");
    if (settings.udp)
        in.problem("udp",
                   "udp is for framing: tcp, where a datagram is one ADU; leave it out" + here);
}

/// With `tls` an address alone will do: its port is kSecurePort.
void check_listen(Reader& in, Settings& settings) {
    const Node* typed = in.child("listen");
    const bool no_port = typed != nullptr && !parse_endpoint(typed->scalar);
    if (settings.tls && typed == nullptr) settings.port = kSecurePort;
    if (no_port && !settings.tls && parse_cidr(typed->scalar)) refuse_listen(in, typed->scalar);
    if (settings.tls && settings.udp)
        in.problem("udp", "datagrams are not encrypted by tls; leave one of them out");
}

bool read_modbus_listen(Reader& in, Settings& settings) {
    const Node* typed = in.child("listen");
    const auto secure =
        parse_endpoint((typed == nullptr ? "" : typed->scalar) + ':' + std::to_string(kSecurePort));
    if (!secure) return read_listen(in, settings);
    settings.address = secure->address;
    settings.port = secure->port;
    return in.has("listen");
}

}  // namespace

Keys<Settings> make_reach_keys(std::int64_t first, std::int64_t last) {
    return Keys<Settings>()
        .value(items_shape("lines", {"[floor1]", "all", name_pattern(), true},
                           "Lines that are served; of a serial master those whose listed stations "
                           "it may ask. Without it all."),
               read_lines, [](const Settings& settings) { return as_written(settings.lines); })
        .weaker(By::more)
        .example("[floor1]")
        .below(units_shape(first, last), {}, read_units,
               [](const SettingWriter& out, const Settings& settings, const SettingWriter*) {
                   for (const auto& [unit, target] : settings.units)
                       out.below("units").put(std::to_string(unit),
                                              target.line + '/' + std::to_string(target.station));
               })
        .not_empty("write such as {101: floor1/31}, or leave it out")
        .example("{101: floor1/31}")
        .word("access", &Settings::read_only, kAccess, "read_only refuses every write.")
        .weaker(By::leaving, "read_only");
}

namespace {

std::string two_lines(std::uint8_t station, const std::string& first, const std::string& second) {
    const std::string id = std::to_string(station);
    std::string text = "station " + id + " is on the lines '" + first + "' and '" + second;
    text += "' of this listener; give both a unit of their own in 'units', such as units: {101: ";
    text += first;
    text += '/' + id + ", 102: ";
    text += second;
    return text + '/' + id + '}';
}

}  // namespace

void check_overlap(Reader& in, const Settings& settings) {
    std::map<int, std::string> owner;
    const auto aliased = [&](const std::string& line, std::uint8_t station) {
        return std::any_of(settings.units.begin(), settings.units.end(), [&](const auto& unit) {
            return unit.second.line == line && unit.second.station == station;
        });
    };
    for (const std::string& name : settings.lines) {
        const Line* line = find_line(in.loading.config, name);
        if (line == nullptr) continue;
        for (const Station& station : line->stations) {
            const auto [first, added] = owner.emplace(station.id, name);
            if (added || first->second == name ||
                (aliased(name, station.id) && aliased(first->second, station.id)))
                continue;
            in.loading.problems.add(in.mark(), two_lines(station.id, first->second, name));
        }
    }
}

const Keys<Settings>& listener_keys() {
    static constexpr Words<Framing, 3> kFramings{
        {{"tcp", Framing::tcp}, {"rtu", Framing::rtu}, {"ascii", Framing::ascii}}};
    static constexpr Words<BroadcastMode, 3> kBroadcasts{{{"reply", BroadcastMode::reply},
                                                          {"silent", BroadcastMode::silent},
                                                          {"deny", BroadcastMode::deny}}};
    static constexpr Words<Retransmissions, 2> kRetransmissions{
        {{"join", Retransmissions::join}, {"pass", Retransmissions::pass}}};
    static constexpr Words<Exceptions, 3> kExceptions{
        {{"all", Exceptions::all}, {"own", Exceptions::own}, {"none", Exceptions::none}}};
    KeyShape diagnostics =
        integers("diagnostics_unit", 1, 255,
                 "Unit id of the gateway's own registers, such as 255; null: none.");
    diagnostics.may_be_null = true;
    diagnostics.weaker = {By::leaving, "null", {}};
    static const auto kKeys =
        Keys<Settings>()
            .value(text_shape("listen", {endpoint_pattern(true)},
                              "ADDR:PORT or [ADDR]:PORT; port 0: a free one."),
                   read_modbus_listen, &Settings::name)
            .example("127.0.0.1:502")
            .change_needs(kListensAnew)
            .with(make_reach_keys(0, 255), std::identity{})
            .word("framing", &Settings::framing, kFramings,
                  "Framing of its clients' requests, over TCP.",
                  [](std::string_view typed) {
                      return typed == "udp" ? "; datagrams have framing: tcp, write udp: true" : "";
                  })
            .change_needs(kListensAnew)
            .boolean("udp", &Settings::udp,
                     "Takes datagrams on the same port as well, with framing tcp.")
            .weaker(By::coming, "true")
            .change_needs(kListensAnew)
            .word("ascii_lower_case", &Settings::ascii_digits, kLowerCase,
                  "Whether hex digits a-f are taken.")
            .change_needs(kListensAnew)
            .only_with("framing", {"ascii"},
                       "is of a listener with framing: ascii, which reads hex digits")
            .word("broadcast", &Settings::broadcast, kBroadcasts,
                  "Answer to a write to unit 0: reply (once it is sent; with framing tcp), "
                  "silent, or deny (exception 01). Without it reply with framing tcp, else silent.")
            .weaker(By::leaving, "deny")
            .initially("")
            .shown_if([](const Settings& settings) {
                return settings.framing == Framing::tcp ||
                       settings.broadcast != BroadcastMode::reply;
            })
            .word("retransmissions", &Settings::retransmissions, kRetransmissions,
                  "With framing tcp, a request that comes again (same transaction id, unit and "
                  "bytes) before its answer: join has one frame and one answer, pass takes it "
                  "for another one. Without it writes are joined.")
            .initially("")
            .word("exceptions", &Settings::exceptions, kExceptions,
                  "What clients get of failures: all; own: exceptions of panels, and silence in "
                  "place of the gateway's own (06, 0A, 0B ...), for clients that take a device "
                  "offline for 0B; none: silence in place of every exception.")
            .value(diagnostics, read_diagnostics,
                   [](const Settings& settings) {
                       const auto& unit = settings.diagnostics_unit;
                       return unit ? std::to_string(*unit) : std::string("null");
                   })
            .example("255")
            .networks("allow", &Settings::allow, "all",
                      "Networks whose clients may connect, such as 192.168.1.0/24. Without it any.")
            .weaker(By::wider)
            .example("[127.0.0.0/8]")
            .change_needs(kAllowCloses)
            .integer("max_connections", &Settings::max_connections, 1, 65535,
                     "Most connections of all clients.")
            .integer("max_connections_per_address", &Settings::max_connections_per_address, 1,
                     65535,
                     "Most connections of one address (of IPv6 a /64); then its longest idle one "
                     "is closed.")
            .below(
                tls_shape(
                    "Modbus/TCP Security: only clients that speak TLS are served. `listen` may be "
                    "an address alone then: its port is 802, as it is of the default, 127.0.0.1."),
                []() -> const Table& { return tls_keys(); },
                [](Reader& in, Settings& settings) { return load_tls(in, settings.tls); },
                [](const SettingWriter& out, const Settings& settings, const SettingWriter*) {
                    show_tls(out, settings.tls);
                })
            .not_empty("give at least certificate and key, or leave it out")
            .change_needs(kTlsCloses);
    return kKeys;
}

namespace {

/// Keys that users write as for the serial lines of other programs.
constexpr std::array<yaml::Elsewhere, 5> kServerKeysElsewhere{
    {{"type", {}, {}, "remove it: serial lines are listed in 'lines'"},
     {"method", {}, {}, "remove it: serial lines are listed in 'lines'"},
     {"device", {}, "a line, one of 'lines'"},
     {"serial", {}, "a line, one of 'lines'"},
     {"stations", {}, "a line, one of 'lines'"}}};

}  // namespace

std::optional<Settings> load_listener(Reader& root, const Node& node) {
    Loading& loading = root.loading;
    Reader in(loading, node, "a modbus_tcp listener", "{listen: 127.0.0.1:502}");
    in.elsewhere(kServerKeysElsewhere);
    Settings settings;
    listener_keys().read(in, settings);
    check_overlap(in, settings);
    check_framing(in, settings);
    check_diagnostics(in, settings);
    check_listen(in, settings);
    in.finish();
    const std::string first = loading.firsts.again("listener " + settings.name(), node.mark);
    if (settings.port != 0 && !first.empty())
        loading.problems.add(node.mark, "there are two listeners on " + settings.name() + first);
    return settings;
}

}  // namespace panelgate::config
