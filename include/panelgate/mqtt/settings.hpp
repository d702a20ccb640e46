#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::mqtt {

enum class Format : std::uint8_t { json, sparkplug };
/// Returns its name in the configuration.
inline std::string_view label(Format format) {
    return format == Format::json ? "json" : "sparkplug";
}

/// The contents of `ca`, `certificate` and `key`. Changed contents leave the session as it is: they
/// count for the session's next connection.
struct Files : tls::Material {
    friend bool operator==(const Files&, const Files&) { return true; }
};

struct Settings {
    std::string host;
    std::uint16_t port = 1883;
    Format format = Format::json;
    std::string topic = "panelgate";  ///< prefix of all `json` topics
    std::string group;                ///< Sparkplug; empty: the topic, with '-' for '/'
    std::string node;                 ///< Sparkplug; empty: the host name
    std::string client_id;            ///< empty: "panelgate-" and the host name
    std::string username;             ///< empty: none
    std::string password_file;        ///< empty: none
    std::string password;             ///< read from its file at load
    bool write = false;               ///< clients that may publish at the broker may write points
    bool home_assistant = false;      ///< `json` only: Home Assistant finds stations and points
    bool shared = false;              ///< another gateway publishes these topics at other times
    int qos = 1;                      ///< `json` only: 0 or 1; Sparkplug defines its own
    Duration keep_alive = 60s;        ///< whole seconds
    bool tls = false;
    std::string ca;           ///< file; empty: the system's trust store
    std::string certificate;  ///< the gateway's own; empty: none
    std::string key;          ///< of the certificate

    std::size_t store = 10'000;        ///< changes stored for the broker; more than in_flight
    std::size_t in_flight = 64;        ///< unacknowledged messages
    std::size_t results = 1024;        ///< write results queued for the broker
    std::size_t batch = 64;            ///< messages sent before yielding to the loop
    std::size_t payload = 4096;        ///< maximum payload accepted from the broker, bytes
    std::size_t packet = 16'384;       ///< a longer packet is kept by a broker of MQTT 5, bytes
    std::size_t messages = 1000;       ///< taken from the broker in a second
    std::size_t metrics = 64;          ///< per command of a Sparkplug host
    std::size_t writes = 32;           ///< writes from the broker under way
    Duration disconnect_timeout = 1s;  ///< wait for the broker to close after the farewell
    Duration connack_timeout = 10s;    ///< wait for the CONNACK
    Duration first_pause = 500ms;      ///< before the first reconnect; doubled each time
    Duration longest_pause = 15s;
    Files files{};

    /// Its files, as those of a client.
    tls::Settings client() const {
        tls::Settings made;
        made.ca = ca;
        made.certificate = certificate;
        made.key = key;
        made.material = files;
        return made;
    }

    /// Returns "mqtt://HOST:PORT" or "mqtts://HOST:PORT".
    std::string broker() const {
        return (tls ? "mqtts://" : "mqtt://") + endpoint_text(host, port);
    }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::mqtt
