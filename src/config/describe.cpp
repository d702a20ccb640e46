#include "panelgate/config/describe.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/config/setting.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

namespace {

/// Has one of each map and list. Keys are recorded whether present or not; beside a keyword (auto)
/// nothing else is read. The values are the examples of the documentation.
constexpr std::string_view kSpecimen = R"(
lines:
  - name: floor1
    device: /dev/serial/by-id/usb-adapter
    serial: {baud: 38400, parity: none}
    rs485: {mode: off}
    timing: {reply_hole: 60ms}
    queue: {limit: 256}
    offline: {after: 3}
    simulate: {echo: false}
    stations:
      - id: 31
        name: press
        profile: autonics-gplp-s
        timing: {response_timeout: 300ms}
        simulate: {dead: false}
        poll: [{read: UW0, count: 32}]
        points:
          - {name: temperature, at: UW100, type: i16, scale: 0.1, unit: celsius,
             labels: {0: off, 1: on}, no_value: [-32768]}
modbus_tcp:
  - {listen: "127.0.0.1:502", lines: [floor1], units: {101: floor1/31}, diagnostics_unit: 255,
     allow: [127.0.0.0/8],
     tls: {certificate: /etc/panelgate/tls/gateway.crt, key: /etc/panelgate/tls/gateway.key,
           ca: /etc/panelgate/tls/ca.crt, client: required, crl: /etc/panelgate/tls/crl.pem,
           role_from: certificate}}
serial_masters:
  - {name: plc, device: /dev/ttyUSB1, serial: {baud: 19200}, rs485: {mode: off}, lines: [floor1],
     units: {101: floor1/31}}
http: {listen: "127.0.0.1:8080", hosts: [gateway.plant.example], allow: [127.0.0.0/8],
       cors: ["https://scada.plant.example"],
       tokens: [{name: ops, role: operator, file: /run/secrets/ops}],
       tls: {certificate: /etc/panelgate/tls/gateway.crt, key: /etc/panelgate/tls/gateway.key,
             ca: /etc/panelgate/tls/ca.crt, client: optional, crl: /etc/panelgate/tls/crl.pem,
             role_from: certificate}}
relays: [{from: press/UW100, to: press/UW200, count: 8, every: 1s}]
mqtt: {broker: "mqtts://broker.plant:8883", tls: {ca: /etc/panelgate/tls/ca.crt}}
access:
  default: allow
  roles: [{name: setter, rights: [read, write]}]
  rules:
    - {name: press-setpoints, allow: [read, write], from: [192.168.10.0/24], roles: [operator],
       tokens: [ops], faces: [http], listeners: ["127.0.0.1:8080"], stations: [press],
       functions: [16], range: UW100-UW199}
    - {name: no-other-writes, deny: [write, broadcast, raw],
       range: {table: holding-registers, address: 0, count: 500}}
log: {level: info}
realtime: {priority: 20}
audit: {file: /var/log/panelgate/audit.jsonl}
)";

/// Certificates, their keys and tokens.
struct Secrets final : Files {
    std::optional<std::string> read(const std::string& path) const override {
        if (path.ends_with("/ca.crt")) return ca.certificate;
        if (path.ends_with(".crt")) return server.certificate;
        if (path.ends_with("/crl.pem")) return crl;
        return path.ends_with(".key") ? server.key : "0123456789abcdef";
    }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }

    tls::Issued ca = tls::issue_ca("specimen", {0, 1});
    tls::Issued server = tls::issue_server(ca, {"specimen"}, {0, 1});
    std::string crl = tls::revoke(ca, "", server.certificate, {0, 1});
};

/// A list or a map in one line, where it has no keys of its own.
std::string flow_text(const yaml::Node& node) {
    std::string text;
    for (const yaml::Node& item : node.items) text += (text.empty() ? "" : ", ") + item.scalar;
    if (node.kind == yaml::Node::Kind::sequence) return '[' + text + ']';
    for (const yaml::Entry& entry : node.entries)
        text += (text.empty() ? "" : ", ") + entry.key + ": " + entry.value.scalar;
    return '{' + text + '}';
}

void add_examples(const yaml::Node& node, const std::string& path,
                  std::vector<yaml::KeyShape>& keys) {
    using Kind = yaml::Node::Kind;
    const auto shape = std::ranges::find(keys, path, &yaml::KeyShape::path);
    const bool has_keys = std::ranges::any_of(keys, [&](const yaml::KeyShape& key) {
        return path.empty() || key.path.starts_with(path + '/');
    });
    if (!has_keys) {
        if (shape != keys.end())
            shape->example = node.kind == Kind::scalar ? node.scalar : flow_text(node);
        return;
    }
    for (const yaml::Node& item : node.items) add_examples(item, path, keys);
    for (const yaml::Entry& entry : node.entries)
        add_examples(entry.value, path.empty() ? entry.key : path + '/' + entry.key, keys);
}

/// What a change of a map needs, one of its keys needs. Maps come before their keys.
void inherit_changes(std::vector<yaml::KeyShape>& keys) {
    for (yaml::KeyShape& key : keys) {
        const std::size_t end = key.path.rfind('/');
        if (end == key.path.npos || !key.change.empty()) continue;
        const auto above = std::ranges::find(keys, key.path.substr(0, end), &yaml::KeyShape::path);
        if (above != keys.end()) key.change = above->change;
    }
}

Described describe_specimen() {
    yaml::Description description;
    yaml::Problems problems("specimen");
    problems.describe(&description);
    if (!load(kSpecimen, Secrets(), problems)) throw std::logic_error(problems.text());
    Described described{description.keys(), description.rules()};
    add_examples(yaml::parse(kSpecimen, problems), "", described.keys);
    inherit_changes(described.keys);
    for (std::size_t i = 0; i < described.keys.size(); ++i)
        described.places.emplace(described.keys[i].path, i);
    return described;
}

}  // namespace

const Described& describe() {
    static const Described kDescribed = describe_specimen();
    return kDescribed;
}

const yaml::KeyShape* Described::find(std::string_view path) const {
    const auto place = places.find(path);
    return place == places.end() ? nullptr : &keys[place->second];
}

const yaml::KeyShape* Described::of(const Setting& setting) const {
    const std::string& map = setting.map->keys;
    const std::string path = (map.empty() ? "" : map + '/') + std::string(setting.key());
    const yaml::KeyShape* key = find(path);
    return key == nullptr ? find(map) : key;
}

std::string Described::condition_of(std::string_view key) const {
    for (const yaml::KeyRule& rule : rules) {
        if (rule.needs || rule.map + '/' + rule.key != key) continue;
        const auto is_allowed = [&](const std::string& word) {
            return std::ranges::find(rule.words, word) != rule.words.end();
        };
        std::vector<std::string> others;
        if (const yaml::KeyShape* other = find(rule.map + '/' + rule.other)) others = other->words;
        std::erase_if(others, is_allowed);
        const bool shorter = rule.absent_will_do && others.size() < rule.words.size();
        std::string words;
        for (const std::string& word : shorter ? others : rule.words)
            words += (words.empty() ? "" : " or ") + word;
        return (shorter ? "not with " : "only with ") + rule.other + ": " + words;
    }
    return "";
}

}  // namespace panelgate::config
