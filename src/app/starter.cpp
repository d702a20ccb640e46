#include "starter.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::app {
namespace {

constexpr std::size_t kMostExamples = 4;

/// In double quotes, with '$' escaped.
std::string quoted(const std::string& text) {
    std::string made = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') made += '\\';
        made += c;
        if (c == '$') made += c;
    }
    return made + '"';
}

std::string serial_of(const scan::Result& result) {
    const SerialFormat format = result.format.value_or(SerialFormat{});
    const std::string mode = format.mode == SerialMode::ascii ? "mode: ascii, " : "";
    const std::string supposed =
        result.remote ? "    # What the far end is set to; supposed from the panels found.\n" : "";
    return supposed + "    serial: {" + mode + "baud: " + std::to_string(format.baud) +
           ", data_bits: " + std::to_string(format.data_bits) +
           ", parity: " + to_string(format.parity) +
           ", stop_bits: " + std::to_string(format.stop_bits) + "}\n";
}

/// A point name made from a notation: "at-gdt0" for GDT0.
std::string name_of(std::string_view notation) {
    std::string name = "at-";
    for (const char c : notation) {
        const char small = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        const bool plain = (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9');
        name += plain ? small : '-';
    }
    return name;
}

/// One example line; "" if nothing in the area is readable.
std::string example_of(const profile::Area& area) {
    const bool bits = modbus::is_bit_table(area.table);
    const auto first = static_cast<std::uint16_t>(
        area.writable ? std::max(area.writable->first, area.readable.first) : area.readable.first);
    if (!area.readable.contains(first)) return "";
    const std::string at = profile::format_notation(area, first);
    std::string text = "{name: " + name_of(at) + ", at: " + quoted(at);
    text += bits ? "" : ", type: i16, scale: 0.1, unit: celsius";
    return "        #   - " + text + ", every: 1s}   # " + area.description + '\n';
}

std::string examples_of(const profile::PanelProfile& profile) {
    std::string text = "        # points:   # values by name, for REST, events and /metrics\n";
    std::size_t count = 0;
    for (const profile::Area& area : profile.areas) {
        const std::string example = count < kMostExamples ? example_of(area) : "";
        if (!example.empty()) ++count;
        text += example;
    }
    return text;
}

std::string station_of(const scan::StationFinding& finding, const profile::Catalogue& profiles) {
    const std::string id = std::to_string(finding.station);
    const bool read = finding.evidence.good > 0;
    const auto& candidates = finding.candidates;
    const std::string profile = candidates.empty() ? "generic" : candidates.front().profile;
    std::string text = "      # " + id + ": " + scan::evidence_text(finding) + '\n';
    if (finding.duplicate)
        text += "      # Two panels seem to have this address: give one of them another.\n";
    if (!read) return text + "      # - {id: " + id + "}   # answers, and nothing was readable\n";
    text += "      - id: " + id + "\n        name: station-" + id +
            "   # as you call it: a-z, 0-9 and '-'\n        profile: " + profile;
    if (candidates.size() > 1) text += "   # or";
    for (std::size_t i = 1; i < candidates.size(); ++i) text += ' ' + candidates[i].profile;
    text += "\n        access: read_write   # or read_only\n";
    if (finding.evidence.late > 0)
        text +=
            "        timing: {response_timeout: 2s}   # it answered late: 500 ms are too short\n";
    if (finding.crc_order == modbus::CrcOrder::high_first)
        text += "        crc_order: high_first   # of the panel's firmware\n";
    const profile::PanelProfile* known = profiles.find(profile);
    return text + (known != nullptr ? examples_of(*known) : "");
}

constexpr std::string_view kServers =
    R"(
# For SCADA systems and other Modbus/TCP clients: unit id = address of the panel. Other machines reach
# it with listen: 0.0.0.0:502 and a list of who may.
modbus_tcp:
  - listen: 127.0.0.1:1502
    # allow: [192.168.10.0/24]

# A dashboard at http://127.0.0.1:8080/, REST, and /metrics for Prometheus. Everybody who reaches it
# may read; who may write has a token (or anonymous: operator, on a desk).
http:
  listen: 127.0.0.1:8080
  anonymous: viewer
  # tokens: [{name: ops, role: operator, file: /run/secrets/ops}]

log: {level: info}
)";

}  // namespace

std::string starter_yaml(const Found& found) {
    std::string text =
        "# Written by panelgate init. `panelgate check -c FILE` says what a change means and what\n"
        "# is wrong with it, `panelgate run -c FILE` runs it; config/panelgate.example.yaml has "
        "every\n"
        "# key, `panelgate profiles NAME` what a panel has.\n";
    if (found.result.ending == scan::Result::Ending::running)
        text += "# Incomplete: the scan was interrupted.\n";
    if (!found.profiles_dir.empty()) text += "profiles_dir: " + quoted(found.profiles_dir) + '\n';
    text +=
        "lines:\n  - name: line1\n    device: " + quoted(found.device) + '\n' +
        serial_of(found.result) +
        "    timing: {response_timeout: 500ms}   # a panel that is silent for longer has failed\n"
        "    stations:\n";
    for (const scan::StationFinding& finding : found.result.stations)
        text += station_of(finding, found.profiles);
    return text + std::string(kServers);
}

}  // namespace panelgate::app
