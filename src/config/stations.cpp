// Stations: their rows, and what their profile says to them.

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/words.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using arbiter::StationSettings;
using profile::allows;
using profile::PanelProfile;
using yaml::Node;

const Keys<sim::Misbehaviour>& fault_keys() {
    using Faults = sim::Misbehaviour;
    static const auto kKeys =
        Keys<Faults>()
            .boolean("dead", &Faults::dead, "Executes nothing and answers nothing.")
            .example("false")
            .duration("slow", &Faults::slow, 0ms, 10min, "Additional think time.")
            .duration("late_by", &Faults::late_by, 0ms, 10min,
                      "Additional think time of the replies of the share `late`.")
            .share("late", &Faults::late, "Share of replies that are delayed by late_by.")
            .share("drop", &Faults::drop, "Share of requests that it executes and does not answer.")
            .share("damage", &Faults::damage, "Share of replies with a wrong bit.")
            .share("truncate", &Faults::truncate, "Share of replies that are cut in half.")
            .share("foreign_id", &Faults::foreign_id,
                   "Share of replies that carry another address.")
            .share("duplicate", &Faults::duplicate,
                   "Share of requests that a second panel with this address answers, too.");
    return kKeys;
}

/// True for 0, which serial line V1.02, 2.2, has for broadcasts.
bool is_broadcast(const Node* id) {
    return id != nullptr && id->kind == Node::Kind::scalar && !id->is_text() && id->scalar == "0";
}

bool read_id(Reader& in, StationBody& body) {
    Loading& loading = in.loading;
    if (is_broadcast(in.child("id"))) {
        in.problem("id", "id must be from 1 to 247, not 0: that is the broadcast");
        return false;
    }
    const auto id = in.integer("id", 1, modbus::kMaxListedStation);
    if (!id) return false;
    body.station.id = static_cast<std::uint8_t>(*id);
    const std::string number = std::to_string(*id);
    if (*id > modbus::kMaxStation)
        in.warn("id", "id " + number +
                          " is outside the standard's 1 to 247: some devices have it (Temco, "
                          "SIN-8), others answer it whatever their own is (PZEM 248, soil sensors "
                          "255); give the device one from 1 to 247 if it can have that");
    const std::string on = std::to_string(loading.config.lines.size());  // this line's index
    loading.firsts.once(in, "id", "id " + on + '/' + number,
                        "there are two stations " + number + " on this line");
    return true;
}

std::string station_name_fault(std::string_view typed) {
    if (typed == kAllStations || typed == kOtherStations)
        return "name must not be '" + std::string(typed) +
               "': metrics and findings call by it what has no name of its own";
    return name_fault(typed);
}

/// Without a name it is LINE-ID.
bool read_name(Reader& in, StationBody& body) {
    Loading& loading = in.loading;
    const std::string number = std::to_string(body.station.id);
    std::string& name = body.station.name;
    name = loading.line->line.name + '-' + number;
    const bool given = in.has("name");
    const auto typed = read_text(in, "name", {.fault = station_name_fault});
    if (given && !typed) return false;
    if (!given && (body.station.id == 0 || loading.line->line.name.empty())) return false;
    name = typed.value_or(name);
    loading.station_names.insert(name);
    loading.firsts.once(
        in, "name", "station " + name,
        given ? "there are two stations '" + name + "'; names are unique over all lines"
              : "there is a station '" + name + "' already; give this a name");
    if (given && yaml::parse_integer(name) && name != number)
        in.problem("name", "name '" + name + "' would be taken for a station id");
    return given;
}

/// `generic`, and a problem, if the profile is unknown.
bool read_profile(Reader& in, StationBody& body) {
    const std::string name = in.text("profile").value_or("generic");
    const profile::Catalogue& catalogue = *in.loading.config.profiles;
    const PanelProfile* found = catalogue.find(name);
    body.station.profile = found == nullptr ? catalogue.find("generic") : found;
    if (found != nullptr) return in.has("profile");
    std::vector<std::string_view> names;
    for (const auto& [known, profile] : catalogue.all()) names.push_back(known);
    const std::string hint = did_you_mean(name, names, "profiles");
    const bool is_far = hint.starts_with("; known");
    in.problem("profile", "there is no profile " + yaml::quote(name) + hint +
                              (is_far ? "; `panelgate profiles` says for which panels" : ""));
    return false;
}

/// The settings of the line, with the station's own timing, and what its profile says.
bool read_timing(Reader& in, StationBody& body) {
    StationSettings& settings = body.settings;
    settings = load_station_timing(in, *in.loading.line, body.station);
    settings.id = body.station.id;
    settings.crc_order =
        body.in_ascii ? modbus::CrcOrder::low_first : body.station.profile->crc_order;
    return in.has("timing");
}

}  // namespace

const Keys<StationBody, StationView>& station_keys() {
    static constexpr Words<bool, 2> kTranslate{{{"auto", true}, {"off", false}}};
    const std::string reserved = std::string(kAllStations) + '|' + std::string(kOtherStations);
    const Form name{"^(?!(?:" + reserved + ")$)" + name_pattern().substr(1), true};
    const auto own = [](const auto& read) {
        return [read](Reader& in, StationBody& body) {
            return !in.loading.is_template && read(in, body);
        };
    };
    static const auto kKeys =
        Keys<StationBody, StationView>()
            .value(
                integers("id", 1, modbus::kMaxListedStation, "Address of the panel on the line."),
                own([](Reader& in, StationBody& body) {
                    return in.require("id") && read_id(in, body);
                }),
                [](const StationView& of) { return std::to_string(of.station.id); })
            .in_schema([](KeyShape& shape) { shape.required = true; })
            .example("31")
            .value(text_shape("name", name,
                              "Name of a-z, 0-9 and '-', unique over all lines. Without it "
                              "LINE-ID."),
                   own(read_name), [](const StationView& of) { return of.station.name; })
            .example("press")
            .value(shape_of("template", Kind::text,
                            "Template whose keys it takes; the station's own keys win."),
                   [](Reader& in, StationBody&) { return in.has("template"); }, {})
            .value(
                shape_of("profile", Kind::text, "Panel profile; `panelgate profiles` lists them."),
                own(read_profile), [](const StationView& of) { return of.station.profile->name; })
            .weaker(By::any)
            .initially("generic")
            .example("autonics-gplp-s")
            .word(
                "access", [](auto& of) -> auto& { return of.station.read_only; }, kAccess,
                "read_only refuses every write.")
            .weaker(By::leaving, "read_only")
            .initially("read_write")
            .below(
                shape_of("timing", Kind::map, "Times of this station, in place of the line's."),
                []() -> const Table& { return timing_keys(); }, read_timing,
                [](const SettingWriter& out, const StationView& of, const SettingWriter* line) {
                    const SettingWriter owner = line->below("timing");
                    timing_keys().show(
                        out.below("timing"),
                        written(of.settings, of.station.automatic_gap, of.station.think_time),
                        &owner);
                })
            .inherited()
            .integer(
                "retries", [](auto& of) -> auto& { return of.settings.retries; }, 0, 10,
                "Retries of a read. Without it the line's.")
            .weaker(By::growing)
            .boolean(
                "retry_writes", [](auto& of) -> auto& { return of.settings.retry_writes; },
                "Sends a write again that was not answered.")
            .weaker(By::coming, "true")
            .initially("false")
            .word(
                "crc_order", [](auto& of) -> auto& { return of.settings.crc_order; },
                modbus::kCrcOrders,
                "Order of the CRC's bytes, on RTU lines. Without it the profile's; high_first: "
                "Autonics GP with firmware from before June 2005.")
            .shown_if([](const StationView& of) { return !of.in_ascii; })
            .change_needs(kOpensPort)
            .duration(
                "max_age", [](auto& of) -> auto& { return of.settings.max_age; }, 0ms, 24h,
                "How old a value may be that answers a client; 0ms: the panel is asked "
                "each time.")
            .initially("0ms")
            .boolean(
                "guard", [](auto& of) -> auto& { return of.station.guard; },
                "Refuses requests that the profile rules out, before they reach the bus.")
            .weaker(By::leaving, "true")
            .initially("false")
            .word(
                "translate", [](auto& of) -> auto& { return of.station.translate; }, kTranslate,
                "Sends functions that the panel lacks as ones that it has: 05 and 06 as "
                "15 and 16, and 02 and 04 as 01 and 03 where the profile says that the "
                "memory is the same. Not with a guard.")
            .initially("auto")
            .boolean(
                "any_length", [](auto& of) -> auto& { return of.settings.any_length; },
                "Passes replies to reads (01 to 04) of any length on to Modbus clients, for "
                "registers of 4 or 12 bytes; points and polls still need two bytes a register.")
            .initially("false")
            .maps(
                "poll", [](auto& of) -> auto& { return of.station.polls; }, poll_keys,
                "[{read: UW100, count: 8, every: 1s}]", points::kMaxPolls, load_poll,
                &points::Poll::read, "Blocks that are polled, to answer clients (max_age).")
            .map(
                "simulate", [](auto& of) -> auto& { return of.station.faults; }, fault_keys,
                "{dead: true}", "What a simulated panel does wrong.")
            .change_needs(kOpensPort)
            .maps(
                "points", [](auto& of) -> auto& { return of.station.points; }, point_keys,
                "[{name: temperature, at: UW100}]", points::kMaxPoints, load_point,
                &points::Point::name, "Values by name.")
            .weaker(By::added)
            .value(
                shape_of("points_file", Kind::text,
                         "Table of further points (CSV): a row a point, a column a key."),
                [](Reader& in, StationBody& of) { return read_points_file(in, of.station); },
                [](const StationView& of) { return of.station.points_file; })
            .example("press.csv");
    return kKeys;
}

namespace {

template <class T, class Format>
std::string join(const std::vector<T>& values, const Format& format) {
    std::string list;
    for (const T& value : values) list += (list.empty() ? "" : ", ") + format(value);
    return list;
}

/// Checks the line's serial format against the panel's settings. Manuals describe RTU only.
void check_serial(Reader& in, const LineContext& work, const PanelProfile& profile) {
    if (!work.serial_known || work.line.device.serial.mode == SerialMode::ascii) return;
    const profile::Serial& serial = profile.serial;
    const SerialFormat& format = work.line.device.serial;
    const std::string source = " (" + profile.manual + ", " + serial.source + ')';
    const auto number = [](int value) { return std::to_string(value); };
    const auto word = [](Parity parity) { return to_string(parity); };
    const auto refuse = [&](std::string_view key, const std::string& allowed,
                            const std::string& value) {
        in.problem("profile", profile.name + " allows " + std::string(key) + ' ' + allowed +
                                  ", not the line's " + value + source);
    };
    if (!allows(serial.baud, format.baud))
        refuse("baud", join(serial.baud, number), number(format.baud));
    if (!allows(serial.parity, format.parity))
        refuse("parity", join(serial.parity, word), to_string(format.parity));
    if (!allows(serial.stop_bits, format.stop_bits))
        refuse("stop_bits", join(serial.stop_bits, number), number(format.stop_bits));
}

void check_range(Reader& in, const PanelProfile& profile, std::uint8_t id) {
    if (id == 0 || (id >= profile.first_station && id <= profile.last_station)) return;
    if (id > modbus::kMaxStation && profile.name == "generic") return;  // read_id() has warned
    in.problem("id", "id must be from " + std::to_string(profile.first_station) + " to " +
                         std::to_string(profile.last_station) + " for " + profile.name + ", not " +
                         std::to_string(id) + " (" + profile.manual + ')');
}

/// Returns the items that every read of these functions may have: the panel's limit within the
/// standard's.
std::uint16_t read_limit(const PanelProfile& profile, std::initializer_list<std::uint8_t> functions,
                         unsigned standard) {
    unsigned limit = standard;
    for (const std::uint8_t function : functions)
        if (profile.find_function(function) != nullptr)
            limit = std::min(limit, profile.max_count(function));
    return static_cast<std::uint16_t>(limit);
}

void check_crc_order(Reader& in, const Station& station) {
    if (in.has("crc_order"))
        in.problem("crc_order", "ASCII has no CRC, and one order of its LRC; leave it out");
    if (station.profile->crc_order != modbus::CrcOrder::low_first)
        in.warn("profile", "profile " + station.profile->name +
                               " differs in the order of the CRC's bytes, and ASCII has no CRC: "
                               "take the profile of the newer panel");
}

/// What only the gateway's own requests use.
void check_listening(Reader& in, const StationSettings& settings, const Station& station) {
    if (in.child("poll") != nullptr)
        in.problem("poll",
                   "the line is only listened to (mode: listen): nothing is asked there; write "
                   "points, which what passes by fills");
    const auto warn = [&](std::string_view key, bool is_set) {
        if (is_set && in.has(key)) warn_of_unused_key(in, key);
    };
    warn("retries", true);
    warn("retry_writes", settings.retry_writes);
    warn("max_age", settings.max_age > Duration::zero());
    warn("guard", station.guard);
    warn("translate", !station.translate);
    if (settings.any_length)
        in.warn("any_length",
                "any_length does nothing on a line that is only listened to (mode: listen): no "
                "client reads through the gateway there; leave it out");
}

/// Reads a station, or the body of a template.
void read_station(Reader& in, StationBody body) {
    Loading& loading = in.loading;
    auto& [station, settings, in_ascii] = body;
    station.listens = loading.line->line.listens;
    loading.station = &station;
    loading.points = {};
    station_keys().read(in, body);
    loading.station = nullptr;
    if (in_ascii) {
        settings.crc_order = modbus::CrcOrder::low_first;
        check_crc_order(in, station);
    }
    using namespace modbus;
    settings.max_registers =
        read_limit(*station.profile, {kReadHoldingRegisters, kReadInputRegisters}, 125);
    settings.max_bits = read_limit(*station.profile, {kReadCoils, kReadDiscreteInputs}, 2000);
    settings.vouched = station.profile->name != "generic";  // generic only repeats the standard
    in.finish();
    constexpr std::ptrdiff_t kTile = 3;  // values on a tile
    if (std::ranges::count_if(station.points, &points::Point::overview) > kTile)
        in.problem("points",
                   "at most 3 points of a station have overview: true; its tile has no "
                   "room for more");
    if (station.listens) check_listening(in, settings, station);
}

/// Keys that users write beside `id`.
constexpr std::array<yaml::Elsewhere, 13> kKeysElsewhere{
    {{"response_timeout", "timing", {}},
     {"frame_gap", "timing", {}},
     {"late_window", "timing", {}},
     {"station_gap", "timing", {}},
     {"after_write", "timing", {}},
     {"connect_pause", {}, "a line: all stations share its connection"},
     {"think_time", "timing", {}},
     {"serial", {}, "a line: all stations of a line share it"},
     {"baud", {}, "a line's serial"},
     {"parity", {}, "a line's serial"},
     {"device", {}, "a line"},
     {"echo", {}, "a line"},
     {"at", {}, "a point"}}};

/// Returns the problems of a template's body with this profile; nullptr: with the one it names.
yaml::Problems faults_of(Loading& loading, const Node& body, const PanelProfile* profile) {
    yaml::Problems faults(loading.problems.file());
    Config config;
    config.profiles = loading.config.profiles;
    Line line;
    LineContext work{line, false};
    Loading alone{loading.files, faults, config};
    alone.line = &work;
    alone.is_template = true;
    Reader in(alone, body, "a station");
    Station station;
    StationSettings settings;
    station.id = 1;
    station.name = "template";
    StationBody parts{station, settings};
    if (profile == nullptr) read_profile(in, parts);
    if (profile != nullptr) station.profile = profile;
    read_station(in, parts);
    return faults;
}

}  // namespace

void load_station(Reader& owner, const Node& node, Line& line) {
    Loading& loading = owner.loading;
    Reader in(loading, node, "a station", "{id: 31, name: press}");
    in.elsewhere(kKeysElsewhere);
    Station station;
    station.id = 0;
    StationSettings settings;
    read_station(in, {station, settings, line.device.serial.mode == SerialMode::ascii});
    check_range(in, *station.profile, station.id);
    check_serial(in, *loading.line, *station.profile);
    line.stations.push_back(std::move(station));
    line.arbiter.stations.push_back(settings);
}

void check_template(Loading& loading, const Node& body) {
    const bool named = body.find("profile") != nullptr;
    yaml::Problems least = faults_of(loading, body, nullptr);
    for (const auto& [name, profile] : loading.config.profiles->all()) {
        if (named || least.empty()) break;
        yaml::Problems faults = faults_of(loading, body, &profile);
        if (faults.list().size() < least.list().size()) least = std::move(faults);
    }
    loading.problems.take(least);
}

}  // namespace panelgate::config
