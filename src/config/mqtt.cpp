// The session at an MQTT broker: rows, and what two of its keys say together.

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <string_view>

#include "panelgate/base/text.hpp"
#include "panelgate/line/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using mqtt::Settings;

constexpr std::string_view kBroker = "write it into the broker, such as broker: mqtt://HOST:1883";
constexpr std::string_view kSecret =
    "a secret does not belong in the configuration: write it to a file that only this program may "
    "read, and here password_file: with its path";
constexpr std::string_view kTls =
    "write broker: mqtts://HOST:8883, and ca, certificate and key into tls: {...}";
constexpr std::array<yaml::Elsewhere, 8> kKeysElsewhere{{{"host", {}, {}, kBroker},
                                                         {"port", {}, {}, kBroker},
                                                         {"url", {}, {}, kBroker},
                                                         {"server", {}, {}, kBroker},
                                                         {"password", {}, {}, kSecret},
                                                         {"secret", {}, {}, kSecret},
                                                         {"token", {}, {}, kSecret},
                                                         {"ssl", {}, {}, kTls}}};
constexpr std::size_t kLongest = 128;  // characters of a topic, a group, a node, a client id

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

bool read_broker(Reader& in, Settings& settings) {
    const auto text = in.text("broker");
    if (!text || parse_broker(*text, settings)) return text.has_value();
    if (text->find('@') != text->npos) {  // it is not shown: a password may be in it
        in.problem(
            "broker",
            "broker must be an address alone, such as mqtt://broker.plant:1883; the user goes "
            "to username, the password into a file: password_file");
        return false;
    }
    in.problem("broker",
               "broker must be mqtt://HOST:PORT, or mqtts://HOST:PORT with TLS, such as "
               "mqtt://broker.plant:1883, not " +
                   yaml::quote(*text) + broker_hint(*text));
    return false;
}

/// A part of topics; `kind` says in messages what the part must be.
Form part(std::string_view key, std::string_view forbidden, std::string_view kind) {
    return {"^(?![/$])(?!.*//)(?!.*/$)[^" + std::string(forbidden) + "]+$", true, kLongest,
            [=](std::string_view typed) -> std::string {
                const bool edge =
                    typed.starts_with('/') || typed.ends_with('/') || typed.starts_with('$');
                const bool wrong = edge || typed.find_first_of(forbidden) != typed.npos ||
                                   typed.find("//") != typed.npos;
                return wrong ? std::string(key) + " must be " + std::string(kind) + ", not " +
                                   yaml::quote(typed)
                             : "";
            }};
}

/// The file's text without the line end is the password.
bool read_password(Reader& in, Settings& settings) {
    const auto typed = in.text("password_file");
    if (!typed) return false;
    settings.password_file = in.loading.path_of(*typed);
    auto text = in.loading.content_of(settings.password_file);
    if (!text) {
        in.problem("password_file",
                   "cannot read the password file; give the path of a file that holds the password "
                   "and that this program may read");
        return false;
    }
    text->erase(0, byte_order_mark(*text));
    while (text->ends_with('\n') || text->ends_with('\r')) text->pop_back();
    if (text->empty()) in.problem("password_file", "the password file is empty");
    if (!in.has("username"))
        in.problem("password_file", "a password needs a username; add username: NAME");
    settings.password = *text;
    return true;
}

auto pem_file(std::string_view key, std::string Settings::* path,
              std::string tls::Material::* content) {
    return [=](Reader& in, Settings& settings) {
        const auto text = in.text(key);
        if (!text) return false;
        settings.*path = in.loading.path_of(*text);
        const auto file = in.loading.content_of(settings.*path);
        if (!settings.tls)
            in.problem(key, std::string(key) + " needs TLS; write broker: mqtts://HOST:8883");
        else if (!file)
            in.problem(key, "cannot read " + settings.*path +
                                "; give the path of a PEM file that this program may read");
        settings.files.*content = file.value_or("");
        return file.has_value();
    };
}

void check_pair(Reader& in, const Settings& settings) {
    if (settings.certificate.empty() == settings.key.empty()) return;
    in.problem(settings.key.empty() ? "certificate" : "key",
               "certificate and key belong together; give both");
}

/// `tls`, or the same keys beside it, as they stood first.
const Keys<Settings>& file_keys(bool beside) {
    const auto make = [](bool old) {
        constexpr std::string_view kOld = "The same as in `tls`, from earlier versions.";
        const auto text = [=](std::string_view own) { return old ? kOld : own; };
        return Keys<Settings>()
            .value(shape_of("ca", Kind::text,
                            text("PEM file of the CA that signs the broker's certificate. Without "
                                 "it the system's trusted CAs.")),
                   pem_file("ca", &Settings::ca, &tls::Material::ca),
                   [](const Settings& of) { return of.ca; })
            .example(old ? "" : "/etc/panelgate/tls/ca.crt")
            .value(shape_of("certificate", Kind::text,
                            text("PEM file of the gateway's own certificate, with key.")),
                   pem_file("certificate", &Settings::certificate, &tls::Material::certificate),
                   [](const Settings& of) { return of.certificate; })
            .value(shape_of("key", Kind::text,
                            text("PEM file of that certificate's key, with certificate.")),
                   pem_file("key", &Settings::key, &tls::Material::key),
                   [](const Settings& of) { return of.key; });
    };
    static const auto kBeside = make(true);
    static const auto kInside = make(false);
    return beside ? kBeside : kInside;
}
const Keys<Settings>& keys_inside() { return file_keys(false); }

void check_mqtt(Reader& in, const Settings& settings) {
    if (in.has("keep_alive") &&
        settings.keep_alive != std::chrono::floor<std::chrono::seconds>(settings.keep_alive))
        in.problem("keep_alive", "keep_alive must be of whole seconds, such as 60s");
    const bool inside = in.child("tls") != nullptr;
    if (!inside) check_pair(in, settings);
    for (const std::string_view key : {"ca", "certificate", "key"})
        if (inside && in.has(key))
            in.problem(key, std::string(key) + " belongs into tls, which is there; move it");
    if (settings.host == "localhost" || is_loopback(settings.host)) return;
    if (!settings.tls && !settings.password.empty())
        in.warn("broker",
                "the password crosses the network where everybody can read it; write broker: "
                "mqtts://" +
                    settings.host + ":8883");
    if (settings.write && settings.username.empty() && settings.certificate.empty())
        in.warn("write",
                "any client that may publish at this broker may write to the panels, and the "
                "gateway connects without a username; give it a username, and rights at the "
                "broker for TOPIC/+/+/set");
}

}  // namespace

const Keys<Settings>& mqtt_keys() {
    static constexpr Words<mqtt::Format, 2> kFormats{
        {{"json", mqtt::Format::json}, {"sparkplug", mqtt::Format::sparkplug}}};
    static constexpr Words<bool, 2> kWrites{{{"none", false}, {"points", true}}};
    constexpr std::string_view kLevel = "one level of a topic, without +, # and /";
    static const auto kKeys =
        Keys<Settings>()
            .value(text_shape("broker", {"^mqtts?://."},
                              "Address: mqtt://HOST:1883, or mqtts://HOST:8883 with TLS."),
                   read_broker, &Settings::broker)
            .required()
            .example("mqtts://broker.plant:8883")
            .word("format", &Settings::format, kFormats,
                  "json, or sparkplug (Sparkplug B), which has group and node in place of "
                  "the topic.")
            .text("topic", &Settings::topic,
                  part("topic", "+#",
                       "a topic such as plant/panelgate, without + and #, without $ in front or / "
                       "at an end"),
                  "Beginning of the topics TOPIC/STATION/POINT, of format json.")
            .text("group", &Settings::group, part("group", "+#/", kLevel),
                  "Group id. Without it the topic, with '-' for '/'.")
            .only_with("format", {"sparkplug"}, "is of Sparkplug; add format: sparkplug")
            .text("node", &Settings::node, part("node", "+#/", kLevel),
                  "Edge node id. Without it the machine's name.")
            .only_with("format", {"sparkplug"}, "is of Sparkplug; add format: sparkplug")
            .integer("qos", &Settings::qos, 0, 1,
                     "Quality of service; 0: what is on its way may be lost.")
            .only_with("format", {"json"}, "is prescribed by Sparkplug; remove it", true)
            .text("client_id", &Settings::client_id, {.longest = kLongest},
                  "Client id. Without it panelgate- and the machine's name.")
            .text("username", &Settings::username, {}, "User at the broker. Without it none.")
            .value(shape_of("password_file", Kind::text,
                            "File that holds the password of `username`."),
                   read_password, [](const Settings& of) { return of.password_file; })
            .duration("keep_alive", &Settings::keep_alive, 5s, 1h,
                      "Keep-alive interval, in whole seconds.")
            .integer("store", &Settings::store, 100, 1'000'000,
                     "Changes that are kept while the broker is away.")
            .word("write", &Settings::write, kWrites,
                  "points: who may publish TOPIC/+/+/set, or DCMD, writes points.")
            .weaker(By::coming, "points")
            .boolean("home_assistant", &Settings::home_assistant,
                     "Home Assistant finds stations and points by itself (device discovery).")
            .only_with("format", {"json"}, "is for format: json", true)
            .below(
                shape_of("tls", Kind::map,
                         "TLS at the broker, with mqtts://. Without it the system's CAs count."),
                []() -> const Table& { return keys_inside(); },
                [](Reader& in, Settings& settings) {
                    const yaml::Node* node = in.map("tls", "{ca: /etc/panelgate/tls/ca.crt}");
                    if (node == nullptr) return false;
                    Reader own(in.loading, *node, "tls");
                    keys_inside().read(own, settings);
                    check_pair(own, settings);
                    own.finish();
                    return true;
                },
                {})
            .not_empty("give ca, certificate and key, or leave it out")
            .with(file_keys(true), std::identity{});
    return kKeys;
}

bool load_mqtt(Reader& root, Config& config) {
    const yaml::Node* node = root.map("mqtt", "{broker: mqtt://HOST:1883, topic: plant/panelgate}");
    if (node == nullptr) return false;
    Reader in(root.loading, *node, "mqtt");
    in.elsewhere(root.loading.top_keys);
    in.elsewhere(kKeysElsewhere);
    mqtt_keys().read(in, config.mqtt.emplace());
    check_mqtt(in, *config.mqtt);
    in.finish();
    return true;
}

}  // namespace panelgate::config
