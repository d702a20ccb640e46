// panelgate check --explain: which rule decides on a request that is told in words.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/explain/explain_door.hpp"
#include "panelgate/explain/rights_text.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::explain {

namespace {

using access::Act;
using modbus::Span;

constexpr const char* kForm =
    "; write [from=ADDRESS] [role=ROLE] [token=NAME] [face=FACE] [listener=NAME] [count=N] "
    "read|write|broadcast|raw [read|write] STATION/PLACE, such as from=10.0.0.7 role=operator "
    "write press/UW102";

/// What was asked, as far as it has been understood.
struct AskedRight {
    Who who{};
    bool has_role = false;
    bool has_face = false;
    std::int64_t count = 1;
    std::optional<Act> act;
    std::optional<bool> raw_reads;  ///< what a raw request is, too; nullopt: it was not said
    const config::Line* line = nullptr;
    const config::Station* station = nullptr;
    Span items;
    std::string wrong;
};

std::optional<Face> face_of(std::string_view word) {
    for (const Face face :
         {Face::modbus_tcp, Face::udp, Face::serial_master, Face::http, Face::mqtt})
        if (word == label(face)) return face;
    return std::nullopt;
}

void set_role(AskedRight& asked, const config::Config& config, const std::string& word) {
    Standing standing = standing_named(word, config.access.roles);
    asked.has_role = true;
    if (standing.role == Role::none && !standing.own) asked.who.certificate_role = word;
    asked.who.standing = std::move(standing);
}

void set(AskedRight& asked, const config::Config& config, const std::string& key,
         const std::string& value) {
    if (key == "from") {
        asked.who.address = value;
        if (!is_address(value)) asked.wrong = "'" + value + "' is no address such as 10.0.0.7";
    } else if (key == "token") {
        asked.who.token = value;
    } else if (key == "listener") {
        asked.who.listener = value;
        if (!face_by(config, value))
            asked.wrong =
                "there is no listener '" + value + "'; there are " + listener_names(config);
    } else if (key == "role") {
        set_role(asked, config, value);
    } else if (key == "face") {
        const auto face = face_of(value);
        asked.has_face = face.has_value();
        if (face) asked.who.face = *face;
        if (!face) asked.wrong = "there is no face '" + value + '\'';
    } else if (key == "count") {
        const auto count = yaml::parse_integer(value);
        if (count && *count >= 1) asked.count = *count;
        if (!count || *count < 1) asked.wrong = "count is a number from 1";
    } else {
        asked.wrong = "'" + key + "' is not known";
    }
}

/// TABLE/ADDRESS, a point, or a notation of the panel.
std::optional<Span> items_of(const config::Station& station, const std::string& place) {
    const std::size_t slash = place.find('/');
    if (slash != place.npos) {
        const auto address = yaml::parse_integer(place.substr(slash + 1));
        for (const modbus::Table table : modbus::kTables) {
            if (place.substr(0, slash) == label(table) && address && *address >= 0 &&
                *address < modbus::kTableItems)
                return Span{table, static_cast<std::uint32_t>(*address), 1};
        }
        return std::nullopt;
    }
    const auto point = std::ranges::find(station.points, place, &points::Point::name);
    if (point != station.points.end()) return Span{point->table, point->address, point->count()};
    const auto item = profile::parse_notation(*station.profile, place);
    if (!item) return std::nullopt;
    return Span{item->area->table, item->address, 1};
}

void find_place(const config::Config& config, const std::string& text, AskedRight& asked) {
    const std::size_t slash = text.find('/');
    for (const config::Line& line : config.lines) {
        for (const config::Station& station : line.stations) {
            if (slash == text.npos || station.name != text.substr(0, slash)) continue;
            asked.line = &line;
            asked.station = &station;
        }
    }
    if (asked.station == nullptr) {
        asked.wrong = "'" + text + "' names no station of the configuration";
        return;
    }
    const auto items = items_of(*asked.station, text.substr(slash + 1));
    if (!items)
        asked.wrong =
            "station '" + asked.station->name + "' has no place '" + text.substr(slash + 1) + '\'';
    if (!items) return;
    asked.items = *items;
    if (asked.count > 1) asked.items.count = static_cast<std::uint32_t>(asked.count);
    if (asked.items.end() > modbus::kTableItems) asked.wrong = "these items end beyond 65535";
}

/// A listener has a face, and raw requests come by one of them only. False: that contradicts.
bool complete_face(const config::Config& config, AskedRight& asked) {
    const auto by_listener = face_by(config, asked.who.listener);
    const bool raw = asked.act == Act::raw;
    if (by_listener && !asked.has_face) asked.who.face = *by_listener;
    if (raw && !by_listener && !asked.has_face) asked.who.face = Face::http;
    const bool udp = asked.who.face == Face::udp && by_listener == Face::modbus_tcp;
    if (by_listener && asked.who.face != *by_listener && !udp)
        asked.wrong = "the listener " + asked.who.listener + " is of the face " +
                      std::string(label(*by_listener));
    if (!asked.who.token.empty() && asked.who.face != Face::http)
        asked.wrong = "only clients of http have tokens";
    return asked.wrong.empty();
}

/// Completes the asked role: the token's role, or the door's role of clients without a token.
void complete(const config::Config& config, AskedRight& asked) {
    if (!asked.who.token.empty() && config.http) {
        const auto& tokens = config.http->tokens;
        const auto token = std::ranges::find(tokens, asked.who.token, &web::Token::name);
        if (token == tokens.end())
            asked.wrong = "there is no token '" + asked.who.token + '\'';
        else if (asked.has_role && asked.who.standing != token->standing)
            asked.wrong = "the token '" + asked.who.token + "' has the role " +
                          std::string(token->standing.name()) + ", leave out role";
        else
            asked.who.standing = token->standing;
        asked.has_role = true;
        if (!asked.has_face) asked.who.face = Face::http;
    }
    if (asked.has_role && !asked.has_face && asked.who.certificate_role.empty())
        asked.who.face = Face::http;
    if (!complete_face(config, asked)) return;
    if (asked.has_role) return;
    const bool anonymous = asked.who.face == Face::http && config.http;
    asked.who.standing = anonymous ? config.http->anonymous : Standing(Role::operator_);
}

AskedRight parse(const config::Config& config, const std::string& text) {
    AskedRight asked;
    std::istringstream in(text);
    std::string place;
    for (std::string word; asked.wrong.empty() && in >> word;) {
        const std::size_t equals = word.find('=');
        if (equals != word.npos) {
            set(asked, config, word.substr(0, equals), word.substr(equals + 1));
            continue;
        }
        bool is_act = false;
        for (const Act act : {Act::read, Act::write, Act::broadcast, Act::raw}) {
            if (word != label(act)) continue;
            is_act = true;
            const bool is_second = asked.act == Act::raw && (act == Act::read || act == Act::write);
            if (is_second) asked.raw_reads = act == Act::read;
            if (!is_second && asked.act) asked.wrong = "it says more than one thing that is done";
            if (!is_second) asked.act = act;
        }
        if (!is_act && !place.empty()) asked.wrong = "it names more than one place";
        if (!is_act) place = word;
    }
    if (asked.wrong.empty() && !asked.act) asked.wrong = "it does not say what is done";
    if (asked.wrong.empty()) find_place(config, place, asked);
    if (asked.wrong.empty()) complete(config, asked);
    return asked;
}

/// The request that REST or a Modbus client would send.
std::optional<modbus::Request> request_of(const AskedRight& asked) {
    const Span& items = asked.items;
    const bool reads = asked.act == Act::read || asked.raw_reads.value_or(false);
    Bytes pdu;
    if (reads) {
        pdu = modbus::encode_read(items);
    } else if (items.table == modbus::Table::coils) {
        const std::vector<bool> bits(items.count);
        pdu = items.count == 1
                  ? modbus::encode_write_coil(static_cast<std::uint16_t>(items.first), false)
                  : modbus::encode_write_coils(static_cast<std::uint16_t>(items.first), bits);
    } else if (items.table == modbus::Table::holding_registers) {
        const std::vector<std::uint16_t> registers(items.count);
        pdu = items.count == 1
                  ? modbus::encode_write_register(static_cast<std::uint16_t>(items.first), 0)
                  : modbus::encode_write_registers(static_cast<std::uint16_t>(items.first),
                                                   registers);
    }
    if (pdu.empty() || items.count > 2000 || (!reads && items.count > 120)) return std::nullopt;
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return std::nullopt;
    return std::move(*request);
}

/// A broadcast reaches all stations of its line.
std::string unreachable(const config::Line& line) {
    for (const config::Station& station : line.stations) {
        if (station.read_only)
            return "a broadcast reaches station '" + station.name + "', which is read_only";
    }
    return "";
}

/// What decides before any rule; "" if nothing does.
std::string decided_before(const config::Config& config, const AskedRight& asked) {
    const bool writes = asked.act != Act::read && !asked.raw_reads.value_or(false);
    const AtDoor request{asked.who, asked.act.value_or(Act::read), writes, *asked.line,
                         *asked.station};
    if (std::string why = refused_at_door(config, request, rt::wall_now()); !why.empty())
        return why;
    if (asked.act == Act::broadcast)
        if (std::string why = unreachable(*asked.line); !why.empty()) return why;
    if (asked.station->listens) return "line '" + asked.line->name + "' is only listened to";
    if (writes && asked.station->read_only)
        return "station '" + asked.station->name + "' is read_only";
    if (asked.act != Act::read && !asked.who.certificate_role.empty())
        return "the role '" + asked.who.certificate_role +
               "' of a certificate is no role that the gateway has, so it may only read";
    if (asked.who.face != Face::http || asked.who.standing.own) return "";
    const Role needed = asked.act == Act::read    ? Role::viewer
                        : asked.act == Act::write ? Role::operator_
                                                  : Role::engineer;
    if (asked.who.standing.role >= needed) return "";
    return "over http this needs the role " + std::string(label(needed)) + ", not " +
           std::string(label(asked.who.standing.role));
}

std::string place_in(const std::string& file, const access::Rule& rule) {
    return file + ':' + std::to_string(rule.line) + ':' + std::to_string(rule.column);
}

}  // namespace

namespace {

Explanation explain_on_line(const config::Config& config, const std::string& file,
                            const AskedRight& asked) {
    const auto request = request_of(asked);
    if (!request) return {false, "", "no request does that to so many items of this table"};
    if (const std::string why = decided_before(config, asked); !why.empty())
        return {false, "denied: " + why, ""};
    std::optional<modbus::Request> sent;
    if (asked.station->translate && !asked.station->guard)
        sent = profile::translate(*asked.station->profile, *request);
    const bool broadcast = asked.act == Act::broadcast;
    const WhoRef who = make_who(asked.who);  // the verdict may name its role
    const access::Verdict verdict = asked.line->access.rules->judge(
        who, {.station = broadcast ? std::uint8_t{0} : asked.station->id,
              .asked = &*request,
              .sent = sent && !broadcast ? &*sent : nullptr,
              .raw = asked.act == Act::raw});
    std::string text = verdict.allowed ? "allowed: " : "denied: ";
    if (!verdict.role.empty()) {
        text += "the role '" + std::string(verdict.role) + "' does not have the right " +
                std::string(label(verdict.act));
    } else if (verdict.rule == nullptr) {
        text += std::string("no rule matches, and the default is ") +
                (config.access.allow_by_default ? "allow" : "deny") + " (" + file + ')';
    } else {
        text += "rule '" + verdict.rule->name + "' (" + place_in(file, *verdict.rule) + ')';
    }
    return {verdict.allowed, std::move(text), ""};
}

/// The other lines to which a broadcast through this listener goes.
std::vector<const config::Line*> further_lines(const config::Config& config,
                                               const AskedRight& asked) {
    std::vector<const config::Line*> further;
    const auto listener = std::ranges::find_if(
        config.modbus_tcp, [&](const auto& one) { return one.name() == asked.who.listener; });
    if (asked.act != Act::broadcast || listener == config.modbus_tcp.end()) return further;
    const auto& own = listener->lines;
    for (const config::Line& line : config.lines)
        if (&line != asked.line && !line.stations.empty() &&
            (own.empty() || std::ranges::find(own, line.name) != own.end()))
            further.push_back(&line);
    return further;
}

/// What one line refuses of a broadcast goes to none.
Explanation explain(const config::Config& config, const std::string& file,
                    const AskedRight& asked) {
    Explanation all = explain_on_line(config, file, asked);
    AskedRight there = asked;
    for (const config::Line* line : further_lines(config, asked)) {
        if (!all.allowed) break;
        there.line = line;
        there.station = &line->stations.front();
        Explanation other = explain_on_line(config, file, there);
        if (!other.allowed) all = {false, other.text + ", on line '" + line->name + '\'', ""};
    }
    return all;
}

}  // namespace

Explanation explain(const config::Config& config, const std::string& file,
                    const std::string& question) {
    AskedRight asked = parse(config, question);
    if (!asked.wrong.empty()) return {false, "", asked.wrong + kForm};
    if (asked.act != Act::raw || asked.raw_reads) return explain(config, file, asked);
    // A raw request without read or write: allowed if both are allowed, else the explanation of the
    // refusal.
    asked.raw_reads = true;
    Explanation read = explain(config, file, asked);
    asked.raw_reads = false;
    Explanation write = explain(config, file, asked);
    if (!write.wrong.empty()) return read;  // nothing can write there
    if (read.allowed == write.allowed) return read;
    const bool only_reads = read.allowed;
    return {false,
            (only_reads ? write : read).text +
                (only_reads ? "; a raw read is allowed" : "; a raw write is allowed"),
            ""};
}

}  // namespace panelgate::explain
