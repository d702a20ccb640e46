#include "load_access.hpp"
#include "load_roles.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hints.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

/// True for a name as a browser sends it, or an address without brackets.
bool is_host(std::string_view text) {
    if (text.find('/') == text.npos && parse_cidr(text)) return true;
    if (line::is_broken_address(text)) return false;
    return !text.empty() && !text.ends_with('.') && std::ranges::all_of(text, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '.' || c == '_';
    });
}

/// Returns [fd00::1], as written in a URL, without brackets.
std::string without_brackets(const std::string& text) {
    if (!text.starts_with('[') || !text.ends_with(']')) return text;
    const std::string inside = text.substr(1, text.size() - 2);
    return is_ipv6(inside) ? inside : text;
}

}  // namespace

void load_hosts(Loading& loading, yaml::MapReader& in, web::Settings& settings) {
    in.looks_like("hosts", "^\\[?[A-Za-z0-9._:-]+\\]?$", true);
    for (const yaml::Node* item : in.items("hosts", "[gw.plant.example]", "the machine's names")) {
        const std::string host = without_brackets(item->scalar);
        if (is_host(host)) {
            settings.hosts.push_back(host);
        } else {
            loading.problems.add(
                item->mark,
                "hosts lists names such as gateway.plant.example, without http:// "
                "and without a port, not '" +
                    item->scalar + '\'' +
                    (line::is_broken_address(item->scalar) ? "; its numbers are no IP address"
                                                           : missing_commas(item->scalar)));
        }
    }
}

namespace {

/// The scheme, host and port of an URL as browsers send them (RFC 6454, 6.2): in lower case,
/// without the scheme's own port. Nothing if it has none, or more.
std::optional<std::string> origin_of(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    const bool secure = text.starts_with("https://");
    if (!secure && !text.starts_with("http://")) return std::nullopt;
    const std::size_t host = text.find("//") + 2;
    const auto colon = text.find(':', std::max(host, text.find(']', host) + 1));
    if (!is_host(without_brackets(text.substr(host, colon - host)))) return std::nullopt;
    if (colon == text.npos) return text;
    const auto port = to_number<std::uint16_t>(std::string_view(text).substr(colon + 1));
    if (!port || *port == 0) return std::nullopt;
    if (*port == (secure ? 443 : 80)) text.erase(colon);
    return text;
}

}  // namespace

void load_cors(Loading& loading, yaml::MapReader& in, std::vector<std::string>& origins) {
    in.looks_like("cors", "^[Hh][Tt][Tt][Pp][Ss]?://\\[?[A-Za-z0-9._:-]+\\]?(:[0-9]{1,5})?$");
    for (const yaml::Node& item : in.entries("cors", {})) {
        if (auto origin = origin_of(item.scalar)) {
            origins.push_back(std::move(*origin));
            continue;
        }
        const auto path = item.scalar.find('/', item.scalar.find("//") + 2);
        const auto bare = origin_of(item.scalar.substr(0, path));
        loading.problems.add(item.mark,
                             "cors lists origins such as https://scada.plant.example, with the "
                             "scheme, without a path, not '" +
                                 item.scalar + '\'' + (bare ? "; write " + *bare : ""));
    }
}

namespace {

using yaml::MapReader;
using yaml::Node;

/// HTTP headers cannot carry them; in an encoding of two bytes a character every second one may be
/// zero.
bool has_control_character(std::string_view text) {
    return std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 0x7f; });
}

/// Returns a path that a variable supplied, as the configuration does not show it. Text that is no
/// path may be the token itself.
std::string path_of(const Node* file) {
    const bool is_path =
        file != nullptr && !file->variable.empty() && file->scalar.starts_with('/');
    return is_path ? ' ' + file->scalar : "";
}

/// Reads a token, or its hash: the file's text without surrounding blanks and byte order mark.
/// `elsewhere`: the secret is in the configuration, which is already a problem.
std::string load_secret(Loading& loading, MapReader& in, bool elsewhere, web::Token& token) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const auto typed = elsewhere ? in.text("file") : in.required_text("file");
    if (!typed) return "";
    token.file = loading.path_of(*typed);
    const std::string& file = token.file;
    if (loading.files.is_special(file)) {
        in.problem("file", "the token file must be a file, not a pipe, a socket or a device");
        return "";
    }
    auto text = loading.files.read(file);
    if (text) text->erase(0, byte_order_mark(*text));
    if (!text) {
        // Does not show the text: users may have written the token itself there.
        in.problem("file", "cannot read the token file" + path_of(in.child("file")) +
                               "; give the path of a file that holds the token and "
                               "that this program may read");
        return "";
    }
    const std::size_t first = text->find_first_not_of(kBlanks);
    if (first == std::string::npos) {
        in.problem("file", "the token file is empty");
        return "";
    }
    std::string secret = text->substr(first, text->find_last_not_of(kBlanks) + 1 - first);
    if (secret.find_first_of(kBlanks) != std::string::npos)
        in.problem("file", "the token file " + file + " must hold one token, without blanks");
    else if (has_control_character(secret))
        in.problem("file", "the token file " + file +
                               " must be plain text (UTF-8); it holds control characters");
    return secret;
}

constexpr std::string_view kTokenExample = "{name: ops, role: operator, file: /run/secrets/ops}";

constexpr std::string_view kInFile =
    "a secret does not belong in the configuration: write it to a file that only this program may "
    "read, and here file: with its path";
constexpr std::array<yaml::Elsewhere, 4> kTokenKeysElsewhere{{{"token", {}, {}, kInFile},
                                                              {"secret", {}, {}, kInFile},
                                                              {"password", {}, {}, kInFile},
                                                              {"value", {}, {}, kInFile}}};

/// `expires`: a day, which is the last one of the token, or an instant; in UTC.
void load_expiry(MapReader& in, web::Token& token) {
    in.looks_like("expires", "^[0-9]{4}-[0-9]{2}-[0-9]{2}(T[0-9]{2}:[0-9]{2}:[0-9]{2}Z)?$");
    const auto typed = in.text("expires");
    if (!typed) return;
    token.expires = web::parse_expiry(*typed);
    if (!token.expires)
        in.problem("expires",
                   "expires must be a day such as 2027-12-31, or an instant such as "
                   "2027-12-31T18:00:00Z, not " +
                       yaml::quote(*typed));
}

/// Also one that was typed in capitals: taken for the token, it would let in whoever reads it.
bool looks_like_hash(std::string_view secret) {
    constexpr std::string_view kHashOf = "sha256:";
    return secret.size() >= kHashOf.size() &&
           std::ranges::equal(secret.substr(0, kHashOf.size()), kHashOf, [](char a, char b) {
               return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b;
           });
}

web::Token load_token(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a token", kTokenExample);
    in.elsewhere(kTokenKeysElsewhere);
    const bool elsewhere = std::ranges::any_of(node.entries, [](const yaml::Entry& entry) {
        return std::ranges::find(kTokenKeysElsewhere, entry.key, &yaml::Elsewhere::key) !=
               kTokenKeysElsewhere.end();
    });
    web::Token token;
    token.name = in.required_text("name").value_or("");
    if (in.required_text("role"))
        token.standing = load_role(loading, in, "role").value_or(Role::viewer);
    const std::string secret = load_secret(loading, in, elsewhere, token);
    if (web::is_token_hash(secret)) {
        token.hash = secret;
    } else if (looks_like_hash(secret)) {
        in.problem(
            "file",
            "the token file " + token.file +
                " must hold the token, or sha256: and 64 hex digits in lower case, as `panelgate "
                "token new` writes it");
    } else if (!secret.empty()) {
        token.hash = web::hash_of(secret);
        token.characters = secret.size();
    }
    load_expiry(in, token);
    token_keys().read(in, token);
    in.finish();
    return token;
}

}  // namespace

void load_tokens(Loading& loading, MapReader& in, std::vector<web::Token>& tokens) {
    in.refuse_empty("tokens", "give at least one token, or leave it out");
    for (const Node& node : in.entries("tokens", "[" + std::string(kTokenExample) + "]")) {
        web::Token token = load_token(loading, node);
        if (!token.name.empty() &&
            std::ranges::find(tokens, token.name, &web::Token::name) != tokens.end())
            loading.problems.add(node.mark, "there are two tokens '" + token.name + '\'');
        const auto same = std::ranges::find(tokens, token.hash, &web::Token::hash);
        if (!token.hash.empty() && same != tokens.end() && same->name != token.name)
            loading.problems.add(
                node.mark,
                "the tokens '" + same->name + "' and '" + token.name +
                    "' are the same text and cannot be distinguished; give each its own");
        tokens.push_back(std::move(token));
    }
}

}  // namespace panelgate::config
