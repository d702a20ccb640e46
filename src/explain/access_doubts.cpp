// What `check` doubts of access and audit.

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <system_error>

#include "panelgate/access/settings.hpp"
#include "panelgate/explain/explain_door.hpp"
#include "panelgate/explain/rights_text.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::explain {

namespace {

using access::Act;
using access::Rule;

template <class List, class Test>
bool none_of(const List& list, const Test& test) {
    return std::ranges::none_of(list, test);
}

bool has(const std::vector<Face>& faces, Face face) {
    return std::ranges::find(faces, face) != faces.end();
}

std::vector<Face> faces_of(const config::Config& config) {
    std::vector<Face> faces;
    if (!config.modbus_tcp.empty()) faces.insert(faces.end(), {Face::modbus_tcp, Face::udp});
    if (!config.serial_masters.empty()) faces.push_back(Face::serial_master);
    if (config.http) faces.push_back(Face::http);
    if (config.mqtt) faces.push_back(Face::mqtt);
    return faces;
}

bool listeners_contradict(const config::Config& config, const Rule& rule) {
    if (rule.faces.empty() || rule.listeners.empty()) return false;
    return none_of(rule.listeners, [&](const std::string& listener) {
        const auto face = face_by(config, listener);
        const bool udp = face == Face::modbus_tcp && has(rule.faces, Face::udp);
        return !face || has(rule.faces, *face) || udp;
    });
}

bool tokens_contradict(const config::Config& config, const Rule& rule) {
    if (!config.http || rule.tokens.empty() || rule.roles.empty()) return false;
    return none_of(rule.tokens, [&](const std::string& name) {
        const auto& tokens = config.http->tokens;
        const auto token = std::ranges::find(tokens, name, &web::Token::name);
        return token == tokens.end() ||
               std::ranges::find(rule.roles, token->standing.name()) != rule.roles.end();
    });
}

bool only_writes(const Rule& rule) { return !rule.acts.has(Act::read) && !rule.acts.has(Act::raw); }
bool only_reads(const Rule& rule) { return rule.acts == access::Acts{Act::read}; }

bool functions_contradict(const Rule& rule) {
    if (rule.functions.empty()) return false;
    const auto all_of = [&](std::initializer_list<std::uint8_t> codes) {
        return std::ranges::all_of(rule.functions, [&](std::uint8_t code) {
            return std::ranges::find(codes, code) != codes.end();
        });
    };
    if (only_writes(rule)) return all_of({1, 2, 3, 4, 7, 11, 12, 17, 20, 24});
    return only_reads(rule) && all_of({5, 6, 15, 16, 22});
}

/// Items that nothing can write.
bool items_contradict(const Rule& rule) {
    if (!rule.has_range() || rule.items.empty() || !only_writes(rule)) return false;
    const auto writable = [](const modbus::Span& span) {
        return span.table == modbus::Table::coils || span.table == modbus::Table::holding_registers;
    };
    if (rule.unlisted_items && writable(*rule.unlisted_items)) return false;
    return none_of(rule.items,
                   [&](const auto& at) { return std::ranges::any_of(at.second, writable); });
}

std::string why_vain(const config::Config& config, const Rule& rule,
                     const std::vector<Face>& faces) {
    if (!rule.faces.empty() && none_of(rule.faces, [&](Face face) { return has(faces, face); }))
        return "nothing of this configuration has one of its faces";
    if (listeners_contradict(config, rule)) return "its listeners have none of its faces";
    if (tokens_contradict(config, rule)) return "none of its tokens has one of its roles";
    if (functions_contradict(rule))
        return only_reads(rule) ? "its functions read nothing" : "its functions write nothing";
    if (items_contradict(rule)) return "nothing can write to its range";
    return "";
}

void doubt_audit(const config::Config& config, std::vector<std::string>& doubts) {
    namespace fs = std::filesystem;
    if (!config.audit) return;
    const fs::path file(config.audit->file);
    std::error_code unknown;
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    if (!fs::is_directory(folder, unknown)) {
        doubts.push_back("audit: there is no folder " + folder.string() +
                         ": nothing is recorded until it is made");
    } else if (fs::exists(file, unknown) && !fs::is_regular_file(file, unknown)) {
        doubts.push_back("audit: " + file.string() +
                         " is no regular file: nothing can be recorded there");
    }
}

}  // namespace

std::vector<std::string> access_doubts(const config::Config& config, WallTime now) {
    std::vector<std::string> doubts;
    const std::vector<Face> faces = faces_of(config);
    for (const Rule& rule : config.access.rules) {
        const std::string why = why_vain(config, rule, faces);
        if (why.empty()) continue;
        doubts.push_back("rule '" + rule.name + "' in line " + std::to_string(rule.line) +
                         " never decides anything: " + why);
    }
    if (config.http) {
        for (const web::Token& token : config.http->tokens) {
            if (!token.has_expired(now)) continue;
            doubts.push_back("the token '" + token.name + "' ended on " +
                             web::expiry_text(*token.expires) + ": it is answered 401");
        }
    }
    doubt_audit(config, doubts);
    return doubts;
}

}  // namespace panelgate::explain
