// The listener of REST: rows, tokens, and the certificates of any listener.

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hints.hpp"
#include "listen.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/tls/context.hpp"
#include "tables.hpp"

namespace panelgate::config {

std::string endpoint_pattern(bool port_may_lack) {
    return "^([0-9]{1,3}(\\.[0-9]{1,3}){3}|\\[[0-9A-Fa-f:.]+\\])(:" +
           yaml::integer_pattern(0, 65535) + (port_may_lack ? ")?$" : ")$");
}

void refuse_listen(Reader& in, std::string_view typed) {
    in.problem("listen", "listen must be ADDR:PORT such as 127.0.0.1:502 or [::1]:502, not " +
                             yaml::quote(typed) + listen_hint(typed));
}

namespace {

using web::Token;
using yaml::Node;

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

std::optional<std::string> read_host(Reader& in, const Node& item) {
    std::string host = without_brackets(item.scalar);
    if (is_host(host)) return host;
    in.problems().add(item.mark,
                      "hosts lists names such as gateway.plant.example, without http:// and "
                      "without a port, not '" +
                          item.scalar + '\'' +
                          (line::is_broken_address(item.scalar) ? "; its numbers are no IP address"
                                                                : missing_commas(item.scalar)));
    return std::nullopt;
}

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

std::optional<std::string> read_origin(Reader& in, const Node& item) {
    if (auto origin = origin_of(item.scalar)) return origin;
    const auto path = item.scalar.find('/', item.scalar.find("//") + 2);
    const auto bare = origin_of(item.scalar.substr(0, path));
    in.problems().add(item.mark,
                      "cors lists origins such as https://scada.plant.example, with the scheme, "
                      "without a path, not '" +
                          item.scalar + '\'' + (bare ? "; write " + *bare : ""));
    return std::nullopt;
}

// Tokens

constexpr std::string_view kInFile =
    "a secret does not belong in the configuration: write it to a file that only this program may "
    "read, and here file: with its path";
constexpr std::array<yaml::Elsewhere, 4> kTokenKeysElsewhere{{{"token", {}, {}, kInFile},
                                                              {"secret", {}, {}, kInFile},
                                                              {"password", {}, {}, kInFile},
                                                              {"value", {}, {}, kInFile}}};

/// True if the secret is in the configuration itself, which is a problem.
bool holds_secret(const Node& node) {
    return std::ranges::any_of(node.entries, [](const yaml::Entry& entry) {
        return std::ranges::find(kTokenKeysElsewhere, entry.key, &yaml::Elsewhere::key) !=
               kTokenKeysElsewhere.end();
    });
}

/// HTTP headers cannot carry them; in an encoding of two bytes a character every second one may be
/// zero.
bool has_control_character(std::string_view text) { return std::ranges::any_of(text, is_control); }

/// Returns a path that a variable supplied, as the configuration does not show it. Text that is no
/// path may be the token itself.
std::string typed_path(const Node* file) {
    const bool is_path =
        file != nullptr && !file->variable.empty() && file->scalar.starts_with('/');
    return is_path ? ' ' + file->scalar : "";
}

/// The token in a file's text, or its hash, without surrounding blanks and byte order mark; "" and
/// a problem if the file holds none.
std::string secret_of(Reader& in, const std::string& file) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const Loading& loading = in.loading;
    const auto refuse = [&](const std::string& why) { return in.problem("file", why), ""; };
    if (loading.files.is_special(file))
        return refuse("the token file must be a file, not a pipe, a socket or a device");
    auto text = loading.files.read(file);
    // Does not show the text: users may have written the token itself there.
    if (!text)
        return refuse("cannot read the token file" + typed_path(in.child("file")) +
                      "; give the path of a file that holds the token and that this program may "
                      "read");
    text->erase(0, byte_order_mark(*text));
    const std::size_t first = text->find_first_not_of(kBlanks);
    if (first == std::string::npos) return refuse("the token file is empty");
    std::string secret = text->substr(first, text->find_last_not_of(kBlanks) + 1 - first);
    if (secret.find_first_of(kBlanks) != std::string::npos)
        in.problem("file", "the token file " + file + " must hold one token, without blanks");
    else if (has_control_character(secret))
        in.problem("file", "the token file " + file +
                               " must be plain text (UTF-8); it holds control characters");
    return secret;
}

/// A hash typed in capitals counts too, because a hash taken for the token would let in its reader.
bool looks_like_hash(std::string_view secret) {
    constexpr std::string_view kHashOf = "sha256:";
    return secret.size() >= kHashOf.size() &&
           std::ranges::equal(secret.substr(0, kHashOf.size()), kHashOf, [](char a, char b) {
               return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b;
           });
}

bool read_file(Reader& in, Token& token) {
    const auto typed =
        holds_secret(in.node()) || in.require("file") ? in.text("file") : std::nullopt;
    if (!typed) return false;
    token.file = in.loading.path_of(*typed);
    const std::string secret = secret_of(in, token.file);
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
    return true;
}

/// A day, which is the last one of the token, or an instant; in UTC.
bool read_expiry(Reader& in, Token& token) {
    const auto typed = in.text("expires");
    if (!typed) return false;
    token.expires = web::parse_expiry(*typed);
    if (!token.expires)
        in.problem("expires",
                   "expires must be a day such as 2027-12-31, or an instant such as "
                   "2027-12-31T18:00:00Z, not " +
                       yaml::quote(*typed));
    return token.expires.has_value();
}

/// A schema knows no file, so it takes any name for a role.
KeyShape role_shape(std::string_view key, std::string_view text) {
    KeyShape shape = text_shape(key, {"^[a-z0-9-]+$"}, text);
    shape.weaker = {.by = By::role};
    return shape;
}

bool read_role(Reader& in, std::string_view key, bool none, Standing& standing) {
    std::vector<std::string_view> words = role_words(in.loading.config);
    if (none) words.insert(words.begin(), "none");
    const auto found = in.choice_index(key, words);
    if (found) standing = standing_named(words[*found], in.loading.config.access.roles);
    return found.has_value();
}

const Keys<Token>& token_keys() {
    static const auto kKeys =
        Keys<Token>()
            .text("name", &Token::name, {}, "Name that is in the log; unique.")
            .required()
            .example("ops")
            .value(
                role_shape("role",
                           "viewer reads, operator writes, engineer also raw, broadcast, "
                           "discover and simulator, admin also reload and configure; or one of "
                           "access.roles."),
                [](Reader& in, Token& token) {
                    return read_role(in, "role", false, token.standing);
                },
                [](const Token& token) { return std::string(token.standing.name()); })
            .required()
            .example("operator")
            .value(shape_of("file", Kind::text,
                            "File that holds the token, or its hash as `panelgate token new` "
                            "prints it, and nothing else."),
                   read_file, [](const Token& token) { return token.file; })
            .in_schema([](KeyShape& shape) { shape.required = true; })
            .example("/run/secrets/ops")
            .value(text_shape("expires",
                              {"^[0-9]{4}-[0-9]{2}-[0-9]{2}(T[0-9]{2}:[0-9]{2}:[0-9]{2}Z)?$"},
                              "Last day of the token, such as 2027-12-31, or an instant, "
                              "2027-12-31T18:00:00Z; in UTC. Without it none."),
                   read_expiry,
                   [](const Token& token) {
                       return token.expires ? web::expiry_text(*token.expires) : std::string();
                   })
            .weaker(By::growing);
    return kKeys;
}

bool read_tokens(Reader& in, web::Settings& http) {
    for (const Node& node :
         in.entries("tokens", "[{name: ops, role: operator, file: /run/secrets/ops}]")) {
        Reader own(in.loading, node, "a token",
                   "{name: ops, role: operator, file: /run/secrets/ops}");
        own.elsewhere(kTokenKeysElsewhere);
        Token token;
        token_keys().read(own, token);
        own.finish();
        const auto same = std::ranges::find(http.tokens, token.hash, &Token::hash);
        if (!token.name.empty() && std::ranges::count(http.tokens, token.name, &Token::name) > 0)
            in.problems().add(node.mark, "there are two tokens '" + token.name + '\'');
        if (!token.hash.empty() && same != http.tokens.end() && same->name != token.name)
            in.problems().add(
                node.mark,
                "the tokens '" + same->name + "' and '" + token.name +
                    "' are the same text and cannot be distinguished; give each its own");
        http.tokens.push_back(std::move(token));
    }
    return !http.tokens.empty();
}

}  // namespace

const Keys<web::Settings>& http_keys() {
    using web::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .value(text_shape("listen", {endpoint_pattern(false)}, "ADDR:PORT or [ADDR]:PORT."),
                   read_listen<Settings>, &Settings::name)
            .weaker(By::any)
            .example("127.0.0.1:8080")
            .change_needs(kListensAnew)
            .value(
                role_shape("anonymous",
                           "Role without a token: none, viewer (reads), operator (reads and "
                           "writes), engineer (also raw, broadcast, discover, simulator), admin "
                           "(also reload, configure), or one of access.roles."),
                [](Reader& in, Settings& http) {
                    return read_role(in, "anonymous", true, http.anonymous);
                },
                [](const Settings& http) { return std::string(http.anonymous.name()); })
            .list("hosts", &Settings::hosts,
                  {"[gw.plant.example]", "the machine's names", "^\\[?[A-Za-z0-9._:-]+\\]?$", true},
                  read_host,
                  "Its names in URLs, besides addresses and localhost; another name is "
                  "answered 421. Without it the machine's name.")
            .weaker(By::more)
            .example("[gateway.plant.example]")
            .list("cors", &Settings::cors,
                  {"[https://scada.plant.example]",
                   {},
                   "^[Hh][Tt][Tt][Pp][Ss]?://\\[?[A-Za-z0-9._:-]+\\]?(:[0-9]{1,5})?$"},
                  read_origin,
                  "Origins of other sites whose pages may read, such as "
                  "https://scada.plant.example.")
            .weaker(By::granted)
            .example("[https://scada.plant.example]")
            .networks("allow", &Settings::allow, "all",
                      "Networks whose clients may connect, such as 192.168.1.0/24. Without it any.")
            .weaker(By::wider)
            .example("[127.0.0.0/8]")
            .change_needs(kAllowCloses)
            .below(
                shape_of("tokens", Kind::list, "Tokens of clients (Authorization: Bearer TOKEN)."),
                []() -> const Table& { return token_keys(); }, read_tokens,
                [](const SettingWriter& out, const Settings& http, const SettingWriter*) {
                    for (const Token& token : http.tokens) {
                        const SettingWriter one = out.item("tokens", token.name);
                        token_keys().show(one, token);
                        one.put_secret("secret", token.hash, true);
                    }
                })
            .weaker(By::added)
            .not_empty("give at least one token, or leave it out")
            .below(
                tls_shape("HTTPS: only clients that speak TLS are served."),
                []() -> const Table& { return tls_keys(); },
                [](Reader& in, Settings& http) { return load_tls(in, http.tls); },
                [](const SettingWriter& out, const Settings& http, const SettingWriter*) {
                    show_tls(out, http.tls);
                })
            .not_empty("give at least certificate and key, or leave it out")
            .change_needs(kTlsCloses)
            .integer("max_connections_per_address", &Settings::max_connections_per_address, 1,
                     static_cast<std::int64_t>(Settings().max_connections),
                     "Most connections of one address (of IPv6 a /64), event streams apart; then "
                     "its longest "
                     "idle one is closed.");
    return kKeys;
}

// Certificates

std::function<bool(Reader&, tls::Settings&)> pem_file(std::string_view key,
                                                      std::string tls::Settings::* path,
                                                      std::string tls::Material::* content) {
    return [=](Reader& in, tls::Settings& settings) {
        const auto text = in.text(key);
        if (!text) return false;
        settings.*path = in.loading.path_of(*text);
        const auto read = in.loading.content_of(settings.*path);
        if (!read)
            in.problem(key, "cannot read " + settings.*path +
                                "; give the path of a PEM file that this program may read "
                                "(`panelgate cert` makes such files)");
        settings.material.*content = read.value_or("");
        return read.has_value();
    };
}

namespace {

using tls::ClientCertificate;

constexpr std::string_view kTlsExample =
    "{certificate: /etc/panelgate/tls/gateway.crt, key: /etc/panelgate/tls/gateway.key}";

/// Keys that need others.
bool check_clients(Reader& in, const tls::Settings& settings) {
    const bool asks = settings.client != ClientCertificate::none;
    bool fits = true;
    const auto refuse = [&](std::string_view key, const char* why) {
        in.problem(key, why);
        fits = false;
    };
    if (asks && settings.ca.empty() && !in.has("ca"))
        refuse("client",
               "clients' certificates need the certificate of the CA that signs them; add "
               "ca: FILE");
    if (!asks && in.has("crl"))
        refuse("crl", "crl is for clients' certificates; add client: required, or remove it");
    if (!asks && settings.role_from_certificate)
        refuse("role_from",
               "a role is in a client's certificate; add client: required, or remove it");
    return fits;
}

}  // namespace

const Keys<tls::Settings>& tls_keys() {
    using tls::Material;
    using tls::Settings;
    using tls::Version;
    static constexpr Words<ClientCertificate, 3> kClients{
        {{"none", ClientCertificate::none},
         {"optional", ClientCertificate::optional},
         {"required", ClientCertificate::required}}};
    static constexpr Words<Version, 2> kVersions{
        {{"TLSv1.2", Version::tls12}, {"TLSv1.3", Version::tls13}}};
    static constexpr Words<bool, 1> kRoles{{{"certificate", true}}};
    static const auto kKeys =
        Keys<Settings>()
            .value(shape_of("certificate", Kind::text,
                            "PEM file of the gateway's certificate, then of those between it and "
                            "its CA."),
                   pem_file("certificate", &Settings::certificate, &Material::certificate),
                   [](const Settings& tls) { return tls.certificate; })
            .required()
            .example("/etc/panelgate/tls/gateway.crt")
            .change_needs(kTlsRenewed)
            .value(shape_of("key", Kind::text,
                            "PEM file of that certificate's key, without a password."),
                   pem_file("key", &Settings::key, &Material::key),
                   [](const Settings& tls) { return tls.key; })
            .required()
            .example("/etc/panelgate/tls/gateway.key")
            .change_needs(kTlsRenewed)
            .value(shape_of("ca", Kind::text,
                            "PEM file of the CA that signs the certificates of clients."),
                   pem_file("ca", &Settings::ca, &Material::ca),
                   [](const Settings& tls) { return tls.ca; })
            .weaker(By::any)
            .example("/etc/panelgate/tls/ca.crt")
            .change_needs(kTlsRenewed)
            .word("client", &Settings::client, kClients,
                  "Whether clients show a certificate: none, optional, required.")
            .weaker(By::falling, {}, {"none", "optional", "required"})
            .example("required")
            .change_needs(kTlsCloses)
            .value(shape_of("crl", Kind::text,
                            "PEM file of the certificates that the CA has revoked."),
                   pem_file("crl", &Settings::crl, &Material::crl),
                   [](const Settings& tls) { return tls.crl; })
            .weaker(By::any)
            .example("/etc/panelgate/tls/crl.pem")
            .change_needs(kTlsCloses)
            .word("role_from", &Settings::role_from_certificate, kRoles,
                  "certificate: the role in a client's certificate decides what it may; without "
                  "one it only reads.")
            .weaker(By::leaving, "certificate")
            .initially("")
            .example("certificate")
            .change_needs(kTlsCloses)
            .word("min_version", &Settings::lowest, kVersions,
                  "Oldest version that is spoken: TLSv1.2 or TLSv1.3.")
            .weaker(By::leaving, "TLSv1.3")
            .change_needs(kTlsRenewed);
    return kKeys;
}

KeyShape tls_shape(std::string_view text) {
    KeyShape shape = shape_of("tls", Kind::map, text);
    shape.weaker.by = By::removed;
    return shape;
}

bool load_tls(Reader& in, std::optional<tls::Settings>& settings) {
    const Node* node = in.map("tls", kTlsExample);
    if (node == nullptr) return false;
    Reader own(in.loading, *node, "tls", kTlsExample);
    tls::Settings& tls = settings.emplace();
    const Given given = tls_keys().read(own, tls);
    bool readable = given.has("certificate") && given.has("key");
    for (const std::string_view key : {"ca", "crl"})
        readable = readable && (given.has(key) || !own.has(key));
    if (check_clients(own, tls) && readable) try {
            tls.made = std::make_shared<const tls::Context>(tls);
        } catch (const tls::Unusable& why) {
            own.problem(why.file, why.what());
        }
    own.finish();
    if (readable && in.loading.files.is_readable_by_all(tls.key))
        own.warn("key", "every user of this machine can read the key " + tls.key + "; `chmod o-r " +
                            tls.key + '`');
    return true;
}

/// The keys, and what the files hold as a secret, so that a change of either is a difference.
void show_tls(const SettingWriter& out, const std::optional<tls::Settings>& settings) {
    if (!settings) return;
    const SettingWriter section = out.item("tls");
    tls_keys().show(section, *settings);
    const tls::Material& files = settings->material;
    section.put_secret("files", files.certificate + files.key, false);
    section.put_secret("trusted", files.ca + files.crl, true);
}

}  // namespace panelgate::config
