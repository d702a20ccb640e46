#include <algorithm>
#include <array>
#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "loader.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using yaml::MapReader;

constexpr std::string_view kMqttExample = "{broker: mqtt://HOST:1883, topic: plant/panelgate}";
constexpr std::string_view kBroker = "write it into the broker, such as broker: mqtt://HOST:1883";
constexpr std::string_view kSecret =
    "a secret does not belong in the configuration: write it to a file that only this program may "
    "read, and here password_file: with its path";
constexpr std::string_view kTls =
    "write broker: mqtts://HOST:8883, and ca, certificate and key into tls: {...}";
constexpr std::string_view kTlsExample = "{ca: /etc/panelgate/tls/ca.crt}";
constexpr std::array<yaml::Elsewhere, 8> kMqttKeysElsewhere{{{"host", {}, {}, kBroker},
                                                             {"port", {}, {}, kBroker},
                                                             {"url", {}, {}, kBroker},
                                                             {"server", {}, {}, kBroker},
                                                             {"password", {}, {}, kSecret},
                                                             {"secret", {}, {}, kSecret},
                                                             {"token", {}, {}, kSecret},
                                                             {"ssl", {}, {}, kTls}}};

/// Parses "mqtt://HOST:PORT", "mqtts://HOST"; false for anything else.
bool parse_broker(std::string_view text, mqtt::Settings& settings) {
    constexpr std::string_view kPlain = "mqtt://";
    constexpr std::string_view kSafe = "mqtts://";
    settings.tls = text.starts_with(kSafe);
    if (!settings.tls && !text.starts_with(kPlain)) return false;
    std::string rest(text.substr((settings.tls ? kSafe : kPlain).size()));
    auto endpoint = line::parse_tcp_device("tcp://" + rest);
    if (!endpoint)
        endpoint = line::parse_tcp_device("tcp://" + rest + (settings.tls ? ":8883" : ":1883"));
    if (!endpoint) return false;
    settings.host = endpoint->host;
    settings.port = static_cast<std::uint16_t>(*yaml::parse_integer(endpoint->port));
    return true;
}

/// Suggests mqtt://localhost:1883 for localhost:1883 and http://localhost:1883/.
std::string broker_hint(std::string_view typed) {
    const std::size_t scheme = typed.find("://");
    const std::string_view kind = typed.substr(0, scheme);
    if (scheme != typed.npos && (kind == "ws" || kind == "wss"))
        return "; MQTT over WebSocket is not there: write the broker's port for plain MQTT, such "
               "as mqtt://HOST:1883, or mqtts://HOST:8883";
    constexpr std::array<std::string_view, 4> kSafe{"mqtts", "https", "ssl", "tls"};
    const bool safe =
        scheme != typed.npos && std::ranges::find(kSafe, typed.substr(0, scheme)) != kSafe.end();
    std::string rest(scheme == typed.npos ? typed : typed.substr(scheme + 3));
    if (rest.ends_with('/')) rest.pop_back();
    const std::string broker = (safe ? "mqtts://" : "mqtt://") + rest;
    mqtt::Settings unused;
    return parse_broker(broker, unused) ? "; write " + broker : "";
}

void load_broker(MapReader& in, mqtt::Settings& settings) {
    const auto text = in.required_text("broker");
    in.looks_like("broker", "^mqtts?://.");
    if (!text || parse_broker(*text, settings)) return;
    if (text->find('@') != text->npos) {  // it is not shown: a password may be in it
        in.problem(
            "broker",
            "broker must be an address alone, such as mqtt://broker.plant:1883; the user goes "
            "to username, the password into a file: password_file");
        return;
    }
    in.problem("broker",
               "broker must be mqtt://HOST:PORT, or mqtts://HOST:PORT with TLS, such as "
               "mqtt://broker.plant:1883, not " +
                   yaml::quote(*text) + broker_hint(*text));
}

/// Reads a part of topics; `kind` says in messages what it must be.
void load_part(MapReader& in, std::string_view key, std::string_view forbidden,
               std::string_view kind, std::string& part) {
    constexpr std::size_t kLongest = 128;
    const auto text = in.text(key);
    in.looks_like(key, "^(?![/$])(?!.*//)(?!.*/$)[^" + std::string(forbidden) + "]+$", true);
    in.schema(key).longest_text = kLongest;
    if (!text) return;
    const bool wrong_edge =
        text->starts_with('/') || text->ends_with('/') || text->starts_with('$');
    if (wrong_edge || text->size() > kLongest || text->find_first_of(forbidden) != text->npos ||
        text->find("//") != text->npos) {
        in.problem(key, std::string(key) + " must be " + std::string(kind) + ", not " +
                            yaml::quote(*text));
        return;
    }
    part = *text;
}

/// Returns the file's text without the line end; "" and a problem if there is none.
std::string load_password(Loading& loading, MapReader& in, std::string& file) {
    const auto typed = in.text("password_file");
    if (!typed) return "";
    file = loading.path_of(*typed);
    auto text = loading.content_of(file);
    if (!text) {
        in.problem("password_file",
                   "cannot read the password file; give the path of a file that holds the password "
                   "and that this program may read");
        return "";
    }
    text->erase(0, byte_order_mark(*text));
    while (text->ends_with('\n') || text->ends_with('\r')) text->pop_back();
    if (text->empty()) in.problem("password_file", "the password file is empty");
    if (!in.has("username"))
        in.problem("password_file", "a password needs a username; add username: NAME");
    return *text;
}

void load_file(Loading& loading, MapReader& in, std::string_view key, bool tls, std::string& path,
               std::string& content) {
    const auto text = in.text(key);
    if (!text) return;
    path = loading.path_of(*text);
    if (!tls)
        in.problem(key, std::string(key) + " needs TLS; write broker: mqtts://HOST:8883");
    else if (const auto file = loading.content_of(path))
        content = *file;
    else
        in.problem(key, "cannot read " + path +
                            "; give the path of a PEM file that this program "
                            "may read");
}

void load_files(Loading& loading, MapReader& in, mqtt::Settings& settings) {
    load_file(loading, in, "ca", settings.tls, settings.ca, settings.files.ca);
    load_file(loading, in, "certificate", settings.tls, settings.certificate,
              settings.files.certificate);
    load_file(loading, in, "key", settings.tls, settings.key, settings.files.key);
    if (settings.certificate.empty() == settings.key.empty()) return;
    in.problem(settings.key.empty() ? "certificate" : "key",
               "certificate and key belong together; give both");
}

/// A map as that of listeners; the same keys may stand beside it instead, as they did first.
void load_tls(Loading& loading, MapReader& in, mqtt::Settings& settings) {
    const yaml::Node* node = in.map("tls", kTlsExample);
    in.refuse_empty("tls", "give ca, certificate and key, or leave it out");
    if (node != nullptr) {
        MapReader keys(*node, loading.problems, "tls", kTlsExample);
        mqtt_tls_keys().read(keys, settings);
        load_files(loading, keys, settings);
        keys.finish();
    }
    mqtt::Settings beside;
    beside.tls = settings.tls;
    load_files(loading, in, beside);
    for (const std::string_view key : {"ca", "certificate", "key"})
        if (node != nullptr && in.has(key))
            in.problem(key, std::string(key) + " belongs into tls, which is there; move it");
    if (node != nullptr) return;
    settings.ca = std::move(beside.ca);
    settings.certificate = std::move(beside.certificate);
    settings.key = std::move(beside.key);
    settings.files = std::move(beside.files);
}

void load_format(MapReader& in, mqtt::Settings& settings) {
    static constexpr std::string_view kJson = "json";
    static constexpr std::string_view kSparkplug = "sparkplug";
    const Given given = mqtt_keys().read(in, settings);
    if (given.has("keep_alive") &&
        settings.keep_alive != std::chrono::floor<std::chrono::seconds>(settings.keep_alive))
        in.problem("keep_alive", "keep_alive must be of whole seconds, such as 60s");
    load_part(in, "topic", "+#",
              "a topic such as plant/panelgate, without + and #, without $ in front or / at an end",
              settings.topic);
    load_part(in, "group", "+#/", "one level of a topic, without +, # and /", settings.group);
    load_part(in, "node", "+#/", "one level of a topic, without +, # and /", settings.node);
    for (const std::string_view key : {"group", "node"}) {
        if (in.belongs(key, "format", std::span(&kSparkplug, 1)))
            in.problem(key, std::string(key) + " is of Sparkplug; add format: sparkplug");
    }
    const bool sparkplug = settings.format == mqtt::Format::sparkplug;
    if (in.belongs("qos", "format", std::span(&kJson, 1), true) && sparkplug)
        in.problem("qos", "Sparkplug prescribes the quality of service; remove qos");
}

void load_session(Loading& loading, MapReader& in, mqtt::Settings& settings) {
    constexpr std::size_t kLongest = 128;
    settings.client_id = in.text("client_id").value_or("");
    in.schema("client_id").longest_text = kLongest;
    if (settings.client_id.size() > kLongest)
        in.problem("client_id", "client_id must have at most 128 characters");
    settings.username = in.text("username").value_or("");
    settings.password = load_password(loading, in, settings.password_file);
}

void warn_of_broker(Loading& loading, MapReader& in, const mqtt::Settings& settings) {
    if (settings.host == "localhost" || is_loopback(settings.host)) return;
    if (!settings.tls && !settings.password.empty())
        loading.warn(in.mark("broker"),
                     "the password crosses the network where everybody can read "
                     "it; write broker: mqtts://" +
                         settings.host + ":8883");
    if (settings.write && settings.username.empty() && settings.certificate.empty())
        loading.warn(in.mark("write"),
                     "any client that may publish at this broker may write to the panels, and the "
                     "gateway connects without a username; give it a username, and rights at the "
                     "broker for TOPIC/+/+/set");
}

}  // namespace

void load_mqtt(Loading& loading, MapReader& root) {
    load_section(loading, root, "mqtt", kMqttExample, [&](MapReader& in) {
        in.elsewhere(kMqttKeysElsewhere);
        mqtt::Settings& settings = loading.config.mqtt.emplace();
        load_broker(in, settings);
        load_format(in, settings);
        load_session(loading, in, settings);
        load_tls(loading, in, settings);
        warn_of_broker(loading, in, settings);
    });
}

}  // namespace panelgate::config
