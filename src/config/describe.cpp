#include "panelgate/config/describe.hpp"

#include <stdexcept>
#include <string>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

namespace {

/// Has one of each map and list. Keys are recorded whether present or not; beside a keyword (auto)
/// nothing else is read.
constexpr std::string_view kSpecimen = R"(
lines:
  - name: a
    device: sim
    serial: {baud: 9600}
    rs485: {mode: off}
    timing: {reply_hole: 60ms}
    queue: {limit: 256}
    offline: {after: 3}
    simulate: {echo: false}
    stations:
      - id: 1
        name: b
        timing: {frame_gap: 5ms}
        simulate: {dead: false}
        poll: [{read: "400001"}]
        points: [{name: c, at: "400001", labels: {0: zero}, no_value: [1]}]
modbus_tcp:
  - {listen: "127.0.0.1:502", lines: [a], units: {101: a/1}, diagnostics_unit: 255,
     allow: [127.0.0.0/8]}
serial_masters:
  - {name: d, device: /dev/ttyS0, serial: {baud: 9600}, rs485: {mode: off}, lines: [a],
     units: {101: a/1}}
http: {listen: "127.0.0.1:80", hosts: [a], allow: [127.0.0.0/8],
       tokens: [{name: e, role: viewer, file: /f}]}
relays: [{from: b/400001, to: b/400002}]
mqtt: {broker: "mqtt://a"}
log: {level: info}
realtime: {priority: 0}
)";

/// Every file holds a token.
struct Tokens final : Files {
    std::optional<std::string> read(const std::string&) const override {
        return "0123456789abcdef";
    }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

}  // namespace

Described describe() {
    yaml::Description description;
    yaml::Problems problems("specimen");
    problems.describe(&description);
    if (!load(kSpecimen, Tokens(), problems)) throw std::logic_error(problems.text());
    return {description.keys(), description.rules()};
}

}  // namespace panelgate::config
