#include "load_tls.hpp"

#include <memory>
#include <string>
#include <string_view>

#include "panelgate/tls/context.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using tls::ClientCertificate;
using yaml::MapReader;

constexpr std::string_view kTlsExample =
    "{certificate: /etc/panelgate/tls/gateway.crt, key: /etc/panelgate/tls/gateway.key}";

/// Reads a file that is named by a key; false, and a problem, if it cannot be read.
bool load_file(Loading& loading, MapReader& in, std::string_view key, bool required,
               std::string& path, std::string& content) {
    const auto text = required ? in.required_text(key) : in.text(key);
    if (!text) return !required && !in.has(key);
    path = loading.path_of(*text);
    const auto read = loading.content_of(path);
    if (!read) {
        in.problem(key, "cannot read " + path +
                            "; give the path of a PEM file that this program may read "
                            "(`panelgate cert` makes such files)");
        return false;
    }
    content = *read;
    return true;
}

bool load_files(Loading& loading, MapReader& in, tls::Settings& settings) {
    tls::Material& files = settings.material;
    bool all = load_file(loading, in, "certificate", true, settings.certificate, files.certificate);
    all = load_file(loading, in, "key", true, settings.key, files.key) && all;
    all = load_file(loading, in, "ca", false, settings.ca, files.ca) && all;
    return load_file(loading, in, "crl", false, settings.crl, files.crl) && all;
}

/// Keys that need others.
bool check_clients(MapReader& in, const tls::Settings& settings) {
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

void make_context(MapReader& in, tls::Settings& settings) try {
    settings.made = std::make_shared<const tls::Context>(settings);
} catch (const tls::Unusable& why) {
    in.problem(why.file, why.what());
}

}  // namespace

std::optional<tls::Settings> load_tls(Loading& loading, MapReader& in) {
    const yaml::Node* node = in.map("tls", kTlsExample);
    in.refuse_empty("tls", "give at least certificate and key, or leave it out");
    if (node == nullptr) return std::nullopt;
    MapReader keys(*node, loading.problems, "tls", kTlsExample);
    tls::Settings settings;
    const bool readable = load_files(loading, keys, settings);
    tls_keys().read(keys, settings);
    if (check_clients(keys, settings) && readable) make_context(keys, settings);
    keys.finish();
    if (readable && loading.files.is_readable_by_all(settings.key))
        loading.warn(keys.mark("key"), "every user of this machine can read the key " +
                                           settings.key + "; `chmod o-r " + settings.key + '`');
    return settings;
}

void load_modbus_security(Loading& loading, MapReader& in, tcp_server::Settings& settings) {
    settings.tls = load_tls(loading, in);
    if (!settings.tls) return;
    if (!in.has("listen")) settings.port = kSecurePort;
    if (settings.udp)
        in.problem("udp", "datagrams are not encrypted by tls; leave one of them out");
}

void show_tls(const SettingWriter& listener, const std::optional<tls::Settings>& settings) {
    if (!settings) return;
    const SettingWriter section = listener.item("tls");
    tls_keys().show(section, *settings);
    const tls::Material& files = settings->material;
    section.put_secret("files", files.certificate + files.key + files.ca + files.crl);
}

}  // namespace panelgate::config
