#include "panelgate/explain/inventory.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "panelgate/config/deadlines.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/explain/rights_text.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "setting_tree.hpp"

namespace panelgate::explain {

namespace {

using config::Setting;
using yaml::format_duration;

std::string rights(bool read_only) { return read_only ? "read only" : "read and write"; }

/// ", 5 goes out as 15, 6 goes out as 16"
std::string translations_of(const config::Station& station) {
    std::string text;
    if (!station.translate || station.guard) return text;
    for (const profile::Translation& one : profile::translations(*station.profile)) {
        text += ", " + std::to_string(one.asked) + " goes out as " + std::to_string(one.sent);
    }
    return text;
}

/// The timeout that clients need, and settings that would suit clients with a short one.
std::string clients_of(const config::Line& line) {
    const config::ClientTimeout client = config::client_timeout(line);
    const std::string worst = format_duration(client.worst);
    const std::string wanted = format_duration(config::kQuickClient);
    std::string text = "  clients: every request is answered within " + worst + ", ";
    if (client.worst < config::kQuickClient)
        return text + "a timeout of " + wanted + " is enough\n";
    text += "so their timeout has to be longer";
    if (!client.quick) return text + "; " + wanted + " are too short for this wire\n";
    const config::QuickSettings& quick = *client.quick;
    text += "; for " + wanted + " set queue: {deadline: " + format_duration(quick.deadline) +
            "}, timing: {response_timeout: " + format_duration(quick.response_timeout) +
            "} and retries: " + std::to_string(quick.retries);
    if (quick.most_registers)
        text +=
            ", and read at most " + std::to_string(*quick.most_registers) + " registers at once";
    return text + '\n';
}

std::string text_of(const std::vector<Network>& allow) {
    std::string text;
    for (const Network& network : allow)
        text += (text.empty() ? "" : " ") + config::network_text(network);
    return text.empty() ? "everybody" : text;
}

std::string text_of(const std::map<std::uint8_t, tcp_server::UnitTarget>& units) {
    std::string text;
    for (const auto& [unit, target] : units) {
        text += "  unit " + std::to_string(unit) + " is " + target.line + '/' +
                std::to_string(target.station) + '\n';
    }
    return text;
}

std::string broadcasts_of(const config::Config& config, const tcp_server::Settings& listener) {
    using Mode = tcp_server::BroadcastMode;
    if (listener.read_only || listener.broadcast == Mode::deny) return "refused";
    if (const config::Station* forbids = config::forbids_broadcasts(config, listener))
        return "refused: " + forbids->name + " is read-only";
    return listener.broadcast == Mode::silent ? "sent, and not answered" : "sent and answered";
}

std::string text_of(const Standing& standing) {
    if (standing.own) {
        std::string text;
        for (const Right right : kAllRights) {
            if (!standing.may(right)) continue;
            text += (text.empty() ? "" : ", ") + std::string(label(right));
        }
        return text;
    }
    switch (standing.role) {
        case Role::none:
            return "nothing";
        case Role::viewer:
            return "read";
        case Role::operator_:
            return "read and write";
        case Role::engineer:
            return "read, write, raw, broadcast, discover and simulator";
        case Role::admin:
            return "everything";
    }
    std::abort();
}

/// What an entry is, in words.
struct Heading {
    std::string text;
    std::string_view told;  ///< its keys that are in the words
};

Heading heading_of(const config::Line& line) {
    std::string text = "line " + line.name + ": " + line.device.device;
    if (!line.second.empty()) text += " or else " + line.second;
    if (line.kind != config::Line::Kind::tcp) {
        text += ", " + to_string(line.device.serial);
    } else if (line.device.serial.mode == SerialMode::ascii) {
        text += ", ASCII";
    }
    if (line.listens) text += ", only listened to";
    return {std::move(text),
            " name device mode serial.baud serial.data_bits serial.parity serial.stop_bits "
            "serial.mode unlisted_stations "};
}

Heading heading_of(const config::Station& station, const arbiter::StationSettings& settings) {
    std::string text = "station " + std::to_string(station.id) + ' ' + station.name + ", " +
                       station.profile->name + ", " + rights(station.read_only);
    if (settings.crc_order != modbus::CrcOrder::low_first) text += ", CRC high byte first";
    return {text + translations_of(station), " id name profile access crc_order "};
}

/// Whom `allow` and `tls` let in.
std::string guests_of(const std::vector<Network>& allow, const std::optional<tls::Settings>& tls) {
    return text_of(allow) + (tls::wants_certificate(tls) ? " with a certificate" : "");
}

std::string rights_of(const tcp_server::Settings& listener) {
    if (listener.read_only || !tls::goes_by_certificates(listener.tls))
        return rights(listener.read_only);
    return "read, and write where the role in the client's certificate may";
}

Heading heading_of(const tcp_server::Settings& listener) {
    std::string text = "modbus_tcp " + listener.name() + ':';
    for (const std::string& line : listener.lines) text += ' ' + line;
    return {text + ", " + rights_of(listener) + ", for " + guests_of(listener.allow, listener.tls),
            " listen lines access allow broadcast diagnostics_unit units "};
}

Heading heading_of(const serial_server::Settings& master) {
    std::string text = "serial master " + master.name + ": " + master.device.device + ", " +
                       to_string(master.device.serial) +
                       (master.access.framing == modbus::Framing::rtu ? ", rtu:" : ":");
    for (const std::string& line : master.access.lines) text += ' ' + line;
    const bool silent = master.on_failure == serial_server::OnFailure::silence;
    text += ", " + rights(master.access.read_only) + ", failures reported by " +
            (silent ? "silence" : "exceptions");
    return {std::move(text),
            " name device serial.baud serial.data_bits serial.parity serial.stop_bits lines "
            "access units framing on_failure "};
}

Heading heading_of(const web::Settings& http) {
    const bool by_role = tls::goes_by_certificates(http.tls);
    std::string text = "http " + http.name() + ": without a token " + text_of(http.anonymous) +
                       (by_role ? ", with a certificate what its role may" : "") + ", for " +
                       guests_of(http.allow, http.tls);
    if (!http.hosts.empty()) text += ", as";
    for (const std::string& host : http.hosts) text += ' ' + host;
    return {std::move(text), " listen anonymous allow hosts "};
}

std::string text_of(const modbus::Span& items) {
    const bool bits = modbus::is_bit_table(items.table);
    std::string text = bits ? "bit " : items.count == 1 ? "register " : "registers ";
    text += std::to_string(items.first);
    return items.count == 1 ? text : text + " to " + std::to_string(items.end() - 1);
}

Heading heading_of(const images::Settings& image, const images::Layout& layout) {
    using modbus::Table;
    std::string text = "image " + image.name + ": unit " + std::to_string(image.unit) + " with " +
                       std::to_string(layout.size(Table::holding_registers)) + " registers and " +
                       std::to_string(layout.size(Table::coils)) +
                       " bits, a value that is not good " +
                       (image.stale == images::Stale::last ? "stays" : "is 0B");
    return {std::move(text), " name unit points stale quality "};
}

/// An entry of a list that is known by its name, or a map of the file.
Heading heading_of(const SettingTree& tree) {
    const std::string key(tree.key());
    if (!tree.map->in_list) return {key + ':', ""};
    const std::string name(tree.name());
    if (key == "poll") return {"poll " + name + ':', " read "};
    if (key == "relays") return {"relay " + name + ':', " from to "};
    return {key.substr(0, key.size() - 1) + ' ' + name + ':', " name "};
}

/// Writes a part of the configuration: of each entry what it is in words, then all that is set and
/// not in them, in the file's own words.
class Writer {
  public:
    Writer(const config::Config& config, const std::vector<Setting>& part) : config_(&config) {
        const auto map_of = [](std::string_view path) { return path.substr(0, path.rfind('/')); };
        std::set<std::string_view> owners;  // maps from which others inherit
        for (const Setting& setting : part)
            if (!setting.otherwise.empty()) owners.insert(map_of(setting.otherwise));
        for (const Setting& setting : part)
            if (!setting.map->in_list || owners.contains(setting.map->path))
                places_.emplace(setting.path, &setting);
    }

    std::string text(const SettingTree& top) {
        if (const std::string rest = rest_of(top, "", ""); !rest.empty()) text_ = rest + '\n';
        for (const auto& one : top.below) add("", *one);
        return std::move(text_);
    }

  private:
    void add(const std::string& indent, const SettingTree& tree);
    void add(const std::string& indent, const SettingTree& tree, const Heading& heading);
    void add_line(const SettingTree& tree);
    void add_listener(const SettingTree& tree);
    void add_master(const SettingTree& tree);
    void add_image(const SettingTree& tree);
    /// "max_age 2s, timing.frame_gap 5ms"
    std::string rest_of(const SettingTree& tree, std::string_view told,
                        const std::string& above) const;

    const config::Config* config_;
    std::unordered_map<std::string_view, const Setting*> places_;
    std::size_t listeners_ = 0;  ///< that are written
    std::string text_;
};

std::string Writer::rest_of(const SettingTree& tree, std::string_view told,
                            const std::string& above) const {
    const auto find = [this](std::string_view path) {
        const auto place = places_.find(path);
        return place == places_.end() ? nullptr : place->second;
    };
    const auto is_told = [told](const std::string& key) {
        return told.find(' ' + key + ' ') != told.npos;
    };
    std::string text;
    const auto add = [&text](const std::string& more) {
        if (!more.empty()) text += (text.empty() ? "" : ", ") + more;
    };
    for (const Setting* setting : tree.settings) {
        const bool is_set = !setting->secret && setting->applies && !setting->value.empty();
        if (!is_set || is_default(*setting, find)) continue;
        const std::string key = above + std::string(setting->key());
        if (!is_told(key)) add(key + ' ' + setting->value);
    }
    for (const auto& one : tree.below) {
        const std::string key = above + std::string(one->key());
        const bool is_part = tree.map != nullptr && !one->map->in_list;  // the file's have headings
        if (is_part && !is_told(key)) add(rest_of(*one, told, key + '.'));
    }
    return text;
}

void Writer::add(const std::string& indent, const SettingTree& tree, const Heading& heading) {
    const std::string rest = rest_of(tree, heading.told, "");
    const bool is_bare = heading.text.ends_with(':');
    const bool has_entries =
        std::ranges::any_of(tree.below, [](const auto& one) { return one->map->in_list; });
    if (is_bare && rest.empty() && !has_entries && !tree.map->in_list) return;
    text_ += indent + heading.text + (rest.empty() ? "" : is_bare ? " " : ", ") + rest + '\n';
    for (const auto& one : tree.below)
        if (one->map->in_list) add(indent + "  ", *one);
}

void Writer::add(const std::string& indent, const SettingTree& tree) {
    const std::string_view keys = tree.keys();
    if (keys == "lines") return add_line(tree);
    if (keys == "modbus_tcp") return add_listener(tree);
    if (keys == "serial_masters") return add_master(tree);
    if (keys == "images") return add_image(tree);
    if (keys == "http") return add(indent, tree, heading_of(*config_->http));
    add(indent, tree, heading_of(tree));
}

void Writer::add_line(const SettingTree& tree) {
    const config::Line& line = *std::ranges::find(config_->lines, tree.name(), &config::Line::name);
    const Heading heading = heading_of(line);
    const std::string rest = rest_of(tree, heading.told, "");
    text_ += heading.text + (rest.empty() ? "" : ", ") + rest + '\n';
    std::size_t station = 0;
    for (const auto& one : tree.below) {
        if (!one->map->in_list) continue;
        add("  ", *one, heading_of(line.stations[station], line.arbiter.stations[station]));
        ++station;
    }
    if (line.listens) return;
    text_ += std::string("  other stations: ") +
             (line.refuse_unlisted ? "refused" : "passed on, read and write") + '\n' +
             clients_of(line);
}

void Writer::add_listener(const SettingTree& tree) {
    const tcp_server::Settings& listener = config_->modbus_tcp[listeners_++];
    add("", tree, heading_of(listener));
    text_ += text_of(listener.units);
    if (listener.diagnostics_unit)
        text_ +=
            "  unit " + std::to_string(*listener.diagnostics_unit) + " is the gateway itself\n";
    text_ += "  broadcasts are " + broadcasts_of(*config_, listener) + '\n';
}

void Writer::add_master(const SettingTree& tree) {
    const serial_server::Settings& master =
        *std::ranges::find(config_->serial_masters, tree.name(), &serial_server::Settings::name);
    add("", tree, heading_of(master));
    text_ += text_of(master.access.units);
}

void Writer::add_image(const SettingTree& tree) {
    const images::Settings& image =
        *std::ranges::find(config_->images, tree.name(), &images::Settings::name);
    const images::Layout layout = layout_of(image, *config_);
    add("", tree, heading_of(image, layout));
    for (const images::Place& place : layout.places()) {
        const points::Point& point = *place.point;
        text_ += "  " + text_of(place.items) + " is " + place.entry->station + '/' + point.name +
                 ", " + std::string(label(point.type)) + (point.writable ? ", writable" : "") +
                 (place.quality ? ", quality at " + std::to_string(*place.quality) : "") + '\n';
    }
}

}  // namespace

std::string inventory_text(const config::Config& config) {
    std::string text;
    config::each_part(config, [&](const std::vector<Setting>& part) {
        text += Writer(config, part).text(tree_of(part));
    });
    return text + rights_matrix(config);
}

}  // namespace panelgate::explain
