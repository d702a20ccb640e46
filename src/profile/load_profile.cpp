#include "panelgate/profile/load_profile.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "check_profile.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::profile {

/// Reads a profile's `simulation` map; profile.areas must be loaded.
void load_simulation(const yaml::Node& node, PanelProfile& profile, yaml::Problems& problems);

namespace {

using yaml::MapReader;
using yaml::Node;
using yaml::Problems;
using Kind = Simulation::Motion::Kind;

constexpr std::array<std::pair<std::string_view, Kind>, 4> kKinds{
    {{"ramp", Kind::ramp}, {"sine", Kind::sine}, {"toggle", Kind::toggle}, {"clock", Kind::clock}}};

/// Reads area and address of a cell; adds a problem if the profile has no such item.
std::uint32_t place(MapReader& in, const PanelProfile& profile, std::string& area_name,
                    std::size_t items) {
    area_name = in.required_text("area").value_or("");
    const auto address =
        static_cast<std::uint32_t>(in.required_integer("address", 0, 65535).value_or(0));
    const Area* area = profile.find_area(std::string_view(area_name));
    if (area_name.empty()) return address;
    if (area == nullptr) {
        in.problem("area", "there is no area '" + area_name + '\'');
    } else if (items > 0 && !area->readable.contains(address, static_cast<std::uint32_t>(items))) {
        in.problem("address", "address lies outside the area " + area_name);
    }
    return address;
}

Simulation::Cell load_cell(const Node& node, const PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "memory");
    Simulation::Cell cell;
    if (const Node* values = in.sequence("values")) {
        for (const Node& item : values->items) {
            const auto value = item.quoted ? std::nullopt : yaml::parse_integer(item.scalar);
            if (!value || *value < 0 || *value > 65535) {
                problems.add(item.mark, "values must list whole numbers from 0 to 65535");
            }
            cell.values.push_back(static_cast<std::uint16_t>(value.value_or(0)));
        }
    }
    if (node.kind == Node::Kind::map && in.child("values") == nullptr)
        in.problem("values", "memory needs 'values'");
    cell.address = place(in, profile, cell.area, cell.values.size());
    const Area* area = profile.find_area(std::string_view(cell.area));
    const bool bits = area != nullptr && modbus::is_bit_table(area->table);
    if (bits && std::any_of(cell.values.begin(), cell.values.end(), [](auto v) { return v > 1; }))
        in.problem("values", "the values of " + cell.area + " are bits: 0 or 1");
    in.finish();
    return cell;
}

Simulation::Motion load_motion(const Node& node, const PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "motion");
    Simulation::Motion motion;
    motion.address = place(in, profile, motion.area, 1);
    motion.kind = in.choice<Kind>("kind", kKinds).value_or(Kind::ramp);
    motion.low = in.number("low").value_or(motion.low);
    motion.high = in.number("high").value_or(motion.high);
    if (motion.low < 0 || motion.high > 65535 || motion.low > motion.high) {
        in.problem("low", "low and high must be from 0 to 65535, low first");
    }
    motion.period = in.duration("period", 1s, 86400s).value_or(motion.period);
    in.finish();
    return motion;
}

}  // namespace

void load_simulation(const Node& node, PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "simulation");
    Simulation& simulation = profile.simulation;
    simulation.protected_exception =
        static_cast<std::uint8_t>(in.integer("protected_exception", 1, 4).value_or(3));
    if (const Node* memory = in.sequence("memory")) {
        for (const Node& item : memory->items)
            simulation.memory.push_back(load_cell(item, profile, problems));
    }
    if (const Node* motion = in.sequence("motion")) {
        for (const Node& item : motion->items)
            simulation.motion.push_back(load_motion(item, profile, problems));
    }
    in.finish();
}

using Embedded = std::vector<std::pair<std::string_view, std::string_view>>;
const Embedded& shipped_profiles();  // config/profiles/*.yaml, compiled in

namespace {

using Tables = std::array<std::pair<std::string_view, modbus::Table>, modbus::kTables.size()>;

constexpr std::uint32_t kLastAddress = 65535;
constexpr int kMaxBaud = 4'000'000;
constexpr std::array<std::pair<std::string_view, BitDigits>, 3> kBits{
    {{"none", BitDigits::none}, {"hex", BitDigits::hex}, {"decimal", BitDigits::decimal}}};

Tables tables() {
    Tables words;
    std::ranges::transform(modbus::kTables, words.begin(),
                           [](modbus::Table table) { return std::pair(label(table), table); });
    return words;
}

/// Reads a list of integers within [min, max].
std::vector<int> integers(MapReader& in, std::string_view key, int min, int max) {
    std::vector<int> values;
    const Node* list = in.sequence(key);
    if (list == nullptr) return values;
    for (const Node& item : list->items) {
        const auto value = item.quoted ? std::nullopt : yaml::parse_integer(item.scalar);
        if (!value || *value < min || *value > max) {
            in.problems().add(item.mark, std::string(key) + " must list whole numbers from " +
                                             std::to_string(min) + " to " + std::to_string(max));
            continue;
        }
        values.push_back(static_cast<int>(*value));
    }
    return values;
}

/// Reads a list of words out of `words`.
template <class T, std::size_t N>
std::vector<T> choices(MapReader& in, std::string_view key,
                       const std::array<std::pair<std::string_view, T>, N>& words) {
    std::vector<T> values;
    const Node* list = in.sequence(key);
    if (list == nullptr) return values;
    for (const Node& item : list->items) {
        const auto found = std::find_if(words.begin(), words.end(), [&](const auto& word) {
            return word.first == item.scalar;
        });
        if (found != words.end()) {
            values.push_back(found->second);
            continue;
        }
        std::string message = std::string(key) + " must list";
        for (const auto& [name, value] : words) message += ' ' + std::string(name);
        in.problems().add(item.mark, message);
    }
    return values;
}

/// Reads a list; adds a problem if it is missing.
const Node* required_sequence(MapReader& in, std::string_view key, std::string_view what) {
    const Node* list = in.sequence(key);
    if (in.child(key) == nullptr)
        in.problem(key, std::string(what) + " needs '" + std::string(key) + '\'');
    if (list != nullptr && list->items.empty())
        in.problem(key, std::string(key) + " must not be empty");
    return list;
}

std::optional<AddressRange> range(MapReader& in, std::string_view key) {
    const Node* list = in.sequence(key, "[0, 119]");
    if (list == nullptr) return std::nullopt;
    std::vector<std::uint32_t> ends;
    for (const Node& item : list->items) {
        const auto value = item.quoted ? std::nullopt : yaml::parse_integer(item.scalar);
        if (value && *value >= 0 && *value <= kLastAddress)
            ends.push_back(static_cast<std::uint32_t>(*value));
    }
    if (list->items.size() != 2 || ends.size() != 2 || ends[0] > ends[1]) {
        in.problem(key, std::string(key) + " must be [FIRST, LAST], two addresses from 0 to 65535");
        return std::nullopt;
    }
    return AddressRange{ends[0], ends[1]};
}

void load_stations(const Node& node, PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "stations");
    profile.first_station =
        static_cast<std::uint8_t>(in.integer("first", 1, modbus::kMaxListedStation).value_or(1));
    constexpr std::uint8_t kMost = modbus::kMaxListedStation;
    profile.last_station = static_cast<std::uint8_t>(
        in.integer("last", profile.first_station, kMost)
            .value_or(std::max(profile.first_station, modbus::kMaxStation)));
    in.text("source");
    in.finish();
}

/// Without a default in the file, uses the first allowed values.
void load_default(const Node* node, Serial& serial, Problems& problems) {
    SerialFormat& f = serial.default_format;
    if (!serial.baud.empty()) f.baud = serial.baud[0];
    if (!serial.parity.empty()) f.parity = serial.parity[0];
    if (!serial.stop_bits.empty()) f.stop_bits = serial.stop_bits[0];
    if (node == nullptr) return;
    MapReader in(*node, problems, "default");
    f.baud = static_cast<int>(in.integer("baud", 50, kMaxBaud).value_or(f.baud));
    f.parity = in.choice<Parity>("parity", kParityWords).value_or(f.parity);
    f.stop_bits = static_cast<int>(in.integer("stop_bits", 1, 2).value_or(f.stop_bits));
    in.finish();
}

void load_serial(const Node& node, Serial& serial, Problems& problems) {
    const std::size_t before = problems.list().size();
    MapReader in(node, problems, "serial");
    serial.baud = integers(in, "baud", 50, kMaxBaud);
    serial.parity = choices(in, "parity", kParityWords);
    serial.stop_bits = integers(in, "stop_bits", 1, 2);
    serial.source = in.text("source").value_or("");
    load_default(in.map("default"), serial, problems);
    in.finish();
    if (problems.list().size() == before) check_serial(serial, node, problems);
}

FunctionRule load_function(const Node& node, Problems& problems) {
    MapReader in(node, problems, "a function");
    FunctionRule rule;
    rule.code = static_cast<std::uint8_t>(in.required_integer("code", 1, 127).value_or(1));
    rule.max_count = static_cast<unsigned>(in.integer("max", 1, 2040).value_or(0));
    rule.broadcast = in.boolean("broadcast").value_or(false);
    rule.source = in.text("source").value_or("");
    in.finish();
    return rule;
}

Notation load_notation(const Node& node, Problems& problems) {
    MapReader in(node, problems, "notation");
    Notation notation;
    notation.prefix = in.required_text("prefix").value_or("?");
    notation.bit = in.choice<BitDigits>("bit", kBits).value_or(BitDigits::none);
    notation.base = static_cast<unsigned>(in.integer("base", 0, 1).value_or(0));
    notation.digits = static_cast<unsigned>(in.integer("digits", 1, 6).value_or(0));
    notation.short_digits = static_cast<unsigned>(in.integer("short_digits", 1, 6).value_or(0));
    if (notation.bit != BitDigits::none && (notation.base != 0 || notation.digits != 0)) {
        in.problem("bit", "a notation with a bit part has neither base nor digits");
    }
    in.finish();
    return notation;
}

Area load_area(const Node& node, Problems& problems) {
    MapReader in(node, problems, "an area");
    Area area;
    area.name = in.required_text("name").value_or("?");
    area.description = in.text("description").value_or("");
    if (const Node* notation = in.map("notation"))
        area.notation = load_notation(*notation, problems);
    const bool is_map = node.kind == Node::Kind::map;  // otherwise already reported
    for (const std::string_view key : {"notation", "table", "readable"}) {
        if (is_map && in.child(key) == nullptr)
            in.problem(key, "an area needs '" + std::string(key) + '\'');
    }
    area.table = in.choice<modbus::Table>("table", tables()).value_or(area.table);
    area.also = choices(in, "also", tables());
    const auto readable = range(in, "readable");
    area.readable = readable.value_or(AddressRange{});
    area.writable = range(in, "writable");
    if (readable && area.writable &&
        !(readable->contains(area.writable->first) && readable->contains(area.writable->last))) {
        in.problem("writable", "writable must lie inside readable");
    }
    area.view_of = in.text("view_of").value_or("");
    area.source = in.text("source").value_or("");
    in.finish();
    return area;
}

void load_areas(MapReader& in, PanelProfile& profile) {
    const Node* list = required_sequence(in, "areas", "a profile");
    if (list == nullptr) return;
    const std::size_t before = in.problems().list().size();
    for (const Node& item : list->items) profile.areas.push_back(load_area(item, in.problems()));
    if (in.problems().list().size() == before) check_areas(profile, *list, in.problems());
}

void load_timing(const Node& node, Timing& timing, Problems& problems) {
    MapReader in(node, problems, "timing");
    timing.frame_gap_characters =
        in.number("frame_gap_characters").value_or(timing.frame_gap_characters);
    if (timing.frame_gap_characters < 3.5 || timing.frame_gap_characters > 1000) {
        in.problem("frame_gap_characters", "frame_gap_characters must be from 3.5 to 1000");
    }
    timing.max_gap_bits = static_cast<unsigned>(in.integer("max_gap_bits", 0, 10000).value_or(0));
    timing.source = in.text("source").value_or("");
    in.finish();
}

void load_exceptions(MapReader& in, PanelProfile& profile) {
    const Node* list = in.sequence("exceptions");
    if (list == nullptr) return;
    for (const Node& item : list->items) {
        MapReader entry(item, in.problems(), "an exception");
        ExceptionMeaning meaning;
        meaning.code =
            static_cast<std::uint8_t>(entry.required_integer("code", 1, 255).value_or(1));
        meaning.meaning = entry.required_text("meaning").value_or("");
        entry.finish();
        profile.exceptions.push_back(std::move(meaning));
    }
}

void load_unreachable(MapReader& in, PanelProfile& profile) {
    const Node* list = in.sequence("unreachable");
    if (list == nullptr) return;
    for (const Node& item : list->items) {
        MapReader entry(item, in.problems(), "unreachable");
        Unreachable hint;
        hint.prefix = entry.required_text("prefix").value_or("?");
        hint.reason = entry.required_text("reason").value_or("");
        entry.finish();
        profile.unreachable.push_back(std::move(hint));
    }
}

std::optional<Bytes> load_pdu(MapReader& in, std::string_view key) {
    const auto text = in.required_text(key);
    if (!text) return std::nullopt;
    auto pdu = from_hex(*text);
    if (pdu && !pdu->empty() && pdu->size() <= modbus::kMaxPdu) return pdu;
    in.problem(key,
               std::string(key) + " must be a PDU in pairs of hex digits, not '" + *text + '\'');
    return std::nullopt;
}

void load_identification(MapReader& in, PanelProfile& profile) {
    const Node* list = in.sequence("identification");
    if (list == nullptr) return;
    for (const Node& item : list->items) {
        MapReader entry(item, in.problems(), "an identification");
        Identification made;
        made.request = load_pdu(entry, "request").value_or(Bytes());
        made.reply = load_pdu(entry, "reply").value_or(Bytes());
        made.means = entry.required_text("means").value_or("");
        made.source = entry.text("source").value_or("");
        const auto request = modbus::Request::make(made.request, modbus::QuantityCheck::wide);
        if (!made.request.empty() && !(request && request->is_read()))
            entry.problem("request", "a panel is identified by reads only");
        entry.finish();
        profile.identification.push_back(std::move(made));
    }
}

void load_functions(MapReader& in, PanelProfile& profile) {
    const Node* list = required_sequence(in, "functions", "a profile");
    if (list == nullptr) return;
    const std::size_t before = in.problems().list().size();
    for (const Node& item : list->items)
        profile.functions.push_back(load_function(item, in.problems()));
    if (in.problems().list().size() == before) check_functions(profile, *list, in.problems());
}

Catalogue read_shipped() {
    Catalogue catalogue;
    for (const auto& [name, text] : shipped_profiles()) {
        Problems problems("config/profiles/" + std::string(name) + ".yaml");
        auto profile = load_profile(text, std::string(name), problems);
        if (!profile) throw std::logic_error(problems.text());
        catalogue.add(std::move(*profile));
    }
    return catalogue;
}

}  // namespace

std::optional<PanelProfile> load_profile(std::string_view text, std::string name,
                                         Problems& problems) {
    const std::size_t before = problems.list().size();
    const Node root = yaml::parse(text, problems);
    if (problems.list().size() != before) return std::nullopt;
    PanelProfile profile;
    profile.name = std::move(name);
    MapReader in(root, problems, "a profile");
    if (problems.list().size() != before) return std::nullopt;
    profile.description = in.required_text("description").value_or("");
    profile.manual = in.required_text("manual").value_or("");
    if (const Node* stations = in.map("stations")) load_stations(*stations, profile, problems);
    if (const Node* serial = in.map("serial")) load_serial(*serial, profile.serial, problems);
    profile.crc_order = in.choice<modbus::CrcOrder>("crc_order", modbus::kCrcOrders)
                            .value_or(modbus::CrcOrder::low_first);
    load_functions(in, profile);
    load_areas(in, profile);
    if (const Node* timing = in.map("timing")) load_timing(*timing, profile.timing, problems);
    load_exceptions(in, profile);
    load_unreachable(in, profile);
    load_identification(in, profile);
    if (const Node* simulation = in.map("simulation"))
        load_simulation(*simulation, profile, problems);
    in.finish();
    if (problems.list().size() != before) return std::nullopt;
    return profile;
}

Catalogue Catalogue::shipped() {
    static const Catalogue kShipped = read_shipped();  // constant: read once
    return kShipped;
}

void Catalogue::add(PanelProfile profile) {
    std::string name = profile.name;
    profiles_.insert_or_assign(std::move(name), std::move(profile));
}

const PanelProfile* Catalogue::find(std::string_view name) const {
    const auto found = profiles_.find(name);
    return found == profiles_.end() ? nullptr : &found->second;
}

}  // namespace panelgate::profile
