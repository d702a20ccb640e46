#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"

namespace panelgate::mqtt {

enum class Format : std::uint8_t { json, sparkplug };
/// As the configuration writes it.
inline std::string_view label(Format format) {
    return format == Format::json ? "json" : "sparkplug";
}

struct Settings {
    std::string host;
    std::uint16_t port = 1883;
    Format format = Format::json;
    std::string topic = "panelgate";  ///< what all topics of `json` begin with
    std::string group;                ///< of Sparkplug; empty: the topic, with '-' for '/'
    std::string node;                 ///< of Sparkplug; empty: the machine's name
    std::string client_id;            ///< empty: "panelgate-" and the machine's name
    std::string username;             ///< empty: none
    std::string password;             ///< read from its file at load
    bool write = false;               ///< those who may publish at the broker may write points
    int qos = 1;                      ///< of `json`: 0 or 1; Sparkplug prescribes its own
    Duration keep_alive = 60s;        ///< whole seconds
    bool tls = false;
    std::string ca;           ///< a file; empty: those that the system trusts
    std::string certificate;  ///< the gateway's own; empty: none
    std::string key;          ///< of the certificate

    std::size_t store = 10'000;    ///< changes that wait for the broker; more than in_flight
    std::size_t in_flight = 64;    ///< messages that the broker has not acknowledged
    std::size_t results = 1024;    ///< answers to writes that the broker does not have
    std::size_t batch = 64;        ///< messages that are sent before others have their turn
    std::size_t payload = 4096;    ///< bytes of what is taken from the broker
    std::size_t metrics = 64;      ///< of one command of a Sparkplug host
    std::size_t writes = 32;       ///< of the broker that are under way
    Duration leave_within = 1s;    ///< the broker's closing behind the last word
    Duration accepted_in = 10s;    ///< the broker's answer to a connection
    Duration first_pause = 500ms;  ///< before the broker is tried again; doubled
    Duration longest_pause = 15s;

    /// "mqtt://HOST:PORT"
    std::string broker() const;
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::mqtt
