#include "panelgate/scan/report.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scan {

std::optional<ReadRequest> ReadRequest::make(std::uint8_t station, ByteView pdu,
                                             modbus::CrcOrder order) {
    if (station == 0 || station > modbus::kMaxStation) return std::nullopt;
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    if (!request || !request->is_read()) return std::nullopt;
    return ReadRequest(modbus::encode_adu(station, pdu, order), order);
}

namespace {

constexpr const char* kUnknown = "generic";

bool was_read(const StationFinding& finding) { return finding.evidence.good > 0; }

std::string count_of(std::size_t count, const std::string& what) {
    return std::to_string(count) + ' ' + what + (count == 1 ? "" : "s");
}

std::string address(const StationFinding& finding) { return std::to_string(finding.station); }

/// "4 of 9 replies overlapped, 2 came twice"
std::string counted(const Evidence& seen) {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
    if (seen.damaged > 0) {
        add(std::to_string(seen.damaged) + " of " + std::to_string(seen.asked) +
            " replies overlapped");
    }
    if (seen.twice > 0) add(std::to_string(seen.twice) + " came twice");
    if (seen.mixed) add("the same read was refused and granted");
    return text;
}

/// Returns "" for a station without anomalies.
std::string anomalies(const StationFinding& finding) {
    const Evidence& seen = finding.evidence;
    const bool sure = seen.twice > 0 || seen.mixed;
    if (finding.duplicate) {
        return "two stations " + std::string(sure ? "seem to" : "may") + " share address " +
               address(finding) + ": " + counted(seen);
    }
    std::string text;
    if (seen.damaged > 0) {
        text = std::to_string(seen.damaged) + " of " + std::to_string(seen.asked) +
               " replies were damaged";
    }
    if (seen.late > 0) text += std::string(text.empty() ? "" : "; ") + "answers late";
    return text;
}

std::string profile_of(const StationFinding& finding) {
    std::string text;
    for (const Candidate& candidate : finding.candidates)
        text += (text.empty() ? "" : " or ") + candidate.profile;
    return text.empty() ? "?" : text;
}

}  // namespace

std::string evidence_text(const StationFinding& finding) {
    std::string anomaly = anomalies(finding);
    if (finding.crc_order == modbus::CrcOrder::high_first)
        anomaly += std::string(anomaly.empty() ? "" : "; ") + "the CRC's high byte comes first";
    if (finding.candidates.empty())
        return anomaly.empty() ? "answers, not looked at closer" : anomaly;
    const std::string& why = finding.candidates.front().why;
    return anomaly.empty() ? why : anomaly + "; " + why;
}

std::string found_text(const StationFinding& finding) {
    return "station " + address(finding) + ": " + profile_of(finding) + ", " +
           evidence_text(finding);
}

namespace {

std::string padded(std::string text, std::size_t width) {
    text.resize(std::max(text.size(), width), ' ');
    return text + "  ";
}

std::string heading(const std::string& device, const Result& result) {
    const bool format = result.format && !result.remote;
    std::string text = device + ": ";
    if (result.stations.empty()) {
        if (result.ending == Result::Ending::another_master)
            return text + "another master is talking" +
                   (format ? " at " + to_string(*result.format) : "") + ", nothing was asked";
        return text + "no station answered";
    }
    const auto doubled = static_cast<std::size_t>(
        std::ranges::count_if(result.stations, &StationFinding::duplicate));
    if (format) text += to_string(*result.format) + ", ";
    text += count_of(result.stations.size(), "station");
    if (doubled > 0)
        text += ", " + std::to_string(doubled) + (doubled == 1 ? " address" : " addresses") +
                " shared by two";
    return text;
}

/// Returns the text plain if YAML certainly reads it as text, else in double quotes.
std::string yaml_text(const std::string& text) {
    static constexpr std::string_view kPlain = "/._-+@=";
    const bool plain = std::ranges::all_of(text, [](unsigned char c) {
        return std::isalnum(c) != 0 || kPlain.find(static_cast<char>(c)) != std::string_view::npos;
    });
    if (plain && text.starts_with('/')) return text;
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') quoted += '\\';
        quoted += c;
    }
    return quoted + '"';
}

/// `prefix`: of the name, before the address.
std::string yaml_station(const StationFinding& finding, const std::string& prefix = "station") {
    std::string text;
    if (const std::string anomaly = anomalies(finding); !anomaly.empty())
        text += "      # " + anomaly + "\n";
    if (finding.duplicate) text += "      # (give one of them another address)\n";
    const std::string profile =
        finding.candidates.empty() ? kUnknown : finding.candidates.front().profile;
    text += was_read(finding) ? "      - " : "      # - ";
    text += "{id: " + address(finding) + ", name: " + prefix + '-' + address(finding) +
            ", profile: " + profile;
    if (finding.crc_order == modbus::CrcOrder::high_first)
        text += ", crc_order: " + std::string(label(finding.crc_order));
    text += '}';
    if (finding.candidates.size() > 1) text += "  # or";
    for (std::size_t i = 1; i < finding.candidates.size(); ++i)
        text += ' ' + finding.candidates[i].profile;
    return text + '\n';
}

std::string talk_text(const Talk& talk) {
    std::string text;
    for (const auto& [station, functions] : talk) {
        text += (text.empty() ? "station " : ", station ") + std::to_string(station) + " function";
        for (const std::uint8_t function : functions) text += ' ' + std::to_string(function);
    }
    return text;
}

std::string nothing_answered(const Result& result) {
    if (result.damaged_formats.empty()) {
        return "nothing answered: is the device the right one, are A and B swapped, are the panels "
               "powered and set to Modbus RTU or ASCII? --stations 1-247 asks further addresses";
    }
    std::string formats;
    for (const SerialFormat& format : result.damaged_formats)
        formats += (formats.empty() ? "" : ", ") + to_string(format);
    return "something answers at " + formats +
           ", and every reply is damaged: two stations with one address, or the wiring (A and B, "
           "termination)";
}

}  // namespace

std::string serial_yaml(const std::string& device, const Result& result) {
    if (device.starts_with("modbus-tcp://")) return "";
    const SerialFormat format = result.format.value_or(SerialFormat{});
    const std::string supposed =
        result.remote ? "    # what the far end is set to; supposed from the panels found\n" : "";
    const std::string mode = format.mode == SerialMode::ascii ? "mode: ascii, " : "";
    return supposed + "    serial: {" + mode + "baud: " + std::to_string(format.baud) +
           ", data_bits: " + std::to_string(format.data_bits) +
           ", parity: " + to_string(format.parity) +
           ", stop_bits: " + std::to_string(format.stop_bits) + "}\n";
}

bool found_any(const Result& result) { return std::ranges::any_of(result.stations, was_read); }

std::string report_text(const std::string& device, const Result& result,
                        const std::string& ending) {
    std::string text = heading(device, result);
    if (!ending.empty()) text += " (" + ending + ')';
    text += '\n';
    if (result.stations.empty()) return text;
    constexpr std::string_view kAddress = "ADDRESS";
    std::size_t width = std::string_view("PROFILE").size();
    for (const StationFinding& finding : result.stations)
        width = std::max(width, profile_of(finding).size());
    text += padded(std::string(kAddress), 0) + padded("PROFILE", width) + "EVIDENCE\n";
    for (const StationFinding& finding : result.stations) {
        text += padded(address(finding), kAddress.size()) + padded(profile_of(finding), width) +
                evidence_text(finding) + '\n';
    }
    return text;
}

std::string report_yaml(const std::string& device, const Result& result,
                        const std::string& profiles_dir) {
    if (!found_any(result)) return "# " + heading(device, result) + "\nlines: []\n";
    std::string text = "# found by panelgate scan\n";
    if (result.ending == Result::Ending::running)
        text += "# incomplete: the scan was interrupted\n";
    if (!profiles_dir.empty()) text += "profiles_dir: " + yaml_text(profiles_dir) + '\n';
    text += "lines:\n  - name: line1\n    device: " + yaml_text(device) + '\n' +
            serial_yaml(device, result) + "    stations:\n";
    for (const StationFinding& finding : result.stations) text += yaml_station(finding);
    return text + "modbus_tcp:\n  - listen: 127.0.0.1:1502\n";  // a configuration needs a server
}

std::string stations_yaml(const std::string& line, const std::vector<StationFinding>& stations) {
    std::string text;
    for (const StationFinding& finding : stations) text += yaml_station(finding, line);
    return text;
}

std::vector<std::string> advice(const std::string& device, const Result& result) {
    std::vector<std::string> sentences;
    const std::string talk = talk_text(result.talk);
    if (result.ending == Result::Ending::another_master) {
        return {"another master is talking on " + device + " (" + talk +
                "): stop it, or scan all the same with --speak"};
    }
    if (!talk.empty()) {
        sentences.push_back("frames were heard that answer nothing this scan has asked (" + talk +
                            "): is another master talking? The result may be incomplete");
    }
    if (result.noise > 0) {
        sentences.push_back("before the first request " + count_of(result.noise, "byte") +
                            " came that make no sense in any serial format: another protocol, or "
                            "noise on a line without bias and termination");
    }
    if (result.noisy) {
        sentences.push_back(
            "replies of several stations are damaged: look at wiring, termination "
            "and shield before trusting the rest");
    }
    if (!found_any(result) && result.ending == Result::Ending::finished)
        sentences.push_back(nothing_answered(result));
    return sentences;
}

}  // namespace panelgate::scan
