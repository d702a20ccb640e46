#include "panelgate/scan/report.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/scanner.hpp"
#include "state.hpp"

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

std::string time_text(Duration time) {
    const auto seconds = static_cast<long>(std::ceil(to_seconds(time)));
    if (seconds < 100) return std::to_string(seconds) + " s";
    return std::to_string((seconds + 59) / 60) + " min";
}

}  // namespace

std::string format_progress(const Progress& progress, std::size_t width) {
    const auto percent = static_cast<int>(100 * std::clamp(progress.share, 0.0, 1.0));
    std::string line = (percent < 10    ? "  "
                        : percent < 100 ? " "
                                        : "") +
                       std::to_string(percent) + " %, " +
                       (progress.found > 0 ? "about " : "at most ") +
                       time_text(progress.remaining) + " left, " + std::to_string(progress.found) +
                       " found: " + progress.what;
    line.resize(std::min(line.size(), width));
    return line;
}

namespace {

constexpr int kProbes = 12;        // of a typical recognition
constexpr Duration kProbe = 20ms;  // request, think time and reply

/// The far end's setting cannot be read: takes a format that all panels found support.
std::optional<SerialFormat> probable_format(const profile::Catalogue& profiles,
                                            const Result& result) {
    std::vector<const profile::PanelProfile*> panels;
    for (const StationFinding& finding : result.stations) {
        if (finding.candidates.empty()) continue;
        const auto* panel = profiles.find(finding.candidates.front().profile);
        if (panel != nullptr) panels.push_back(panel);
    }
    return common_format(profiles, panels);
}

}  // namespace

/// Sums first pass, second pass and other CRC order for stations assumed silent, and the
/// examination of stations that have answered.
Duration Scanner::State::asking_cost() const {
    const Duration wire = frame_time(format, modbus::kReadRequestAdu);
    const auto first = static_cast<std::int64_t>(first_pass.size());
    const auto second = settings.quick ? 0 : static_cast<std::int64_t>(second_pass.size()) + first;
    std::int64_t high_first = static_cast<std::int64_t>(high_first_pass.size());
    for (const auto* pass : {&first_pass, &second_pass}) {
        if (settings.quick) break;
        high_first += std::ranges::count_if(
            *pass, [this](std::uint8_t station) { return station_may_be_high_first(station); });
    }
    const Duration examining = settings.repeats * (settings.settle + kProbe) + kProbes * kProbe;
    const auto open = static_cast<std::int64_t>(to_examine.size()) + (examination ? 1 : 0);
    return first * (settings.first_timeout + wire) + second * (settings.second_timeout + wire) +
           high_first * (settings.first_timeout + wire) + open * examining;
}

std::string Scanner::State::activity() const {
    const std::string where = settings.remote ? "" : to_string(format) + ", ";
    if (phase == Phase::listening) return where + "listening";
    if (examination) return where + "looking at station " + std::to_string(examination->station());
    if (!attempt) return where + "asking";
    return where + "station " + std::to_string(attempt->request().station());
}

Progress Scanner::progress(TimePoint now) const {
    const State& state = *state_;
    Progress progress;
    progress.found = state.answered.size();
    progress.what = state.activity();
    switch (state.phase) {
        case State::Phase::listening:
        case State::Phase::searching:
            progress.remaining = state.plan.cost(state.settings) + std::max(state.due(), now) - now;
            break;
        case State::Phase::asking:
            progress.remaining = state.asking_cost() + std::max(state.due(), now) - now;
            break;
        case State::Phase::done:
            break;
    }
    const Duration gone = now - state.started;
    const double all = to_seconds(gone + progress.remaining);
    progress.share = all > 0 ? to_seconds(gone) / all : 1;
    return progress;
}

Result Scanner::result() const {
    const State& state = *state_;
    Result result = state.result;
    if (state.examination) result.stations.push_back(state.examination->finding());
    for (const std::uint8_t station : state.to_examine) {
        StationFinding finding;
        finding.station = station;
        result.stations.push_back(std::move(finding));
    }
    for (StationFinding& finding : result.stations) {
        const auto seen = state.other_evidence.find(finding.station);
        if (seen == state.other_evidence.end()) continue;
        finding.evidence.twice += seen->second.twice;
        finding.evidence.late += seen->second.late;
    }
    if (!result.stations.empty() || !result.talk.empty()) {
        result.format =
            result.remote ? probable_format(state.profiles, result) : state.known_format();
        if (result.remote && result.format && state.format.mode == SerialMode::ascii) {
            const int baud = result.format->baud;  // manuals give nothing else for ASCII
            result.format = state.format;
            result.format->baud = baud;
        }
    }
    std::ranges::sort(result.stations, std::less(), &StationFinding::station);
    mark_duplicates(result);
    return result;
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

std::string yaml_serial(const Result& result) {
    if (!result.format) return {};
    const SerialFormat& format = *result.format;
    const std::string supposed =
        result.remote ? "    # what the far end is set to; supposed from the panels found\n" : "";
    const std::string mode = format.mode == SerialMode::ascii ? "mode: ascii, " : "";
    return supposed + "    serial: {" + mode + "baud: " + std::to_string(format.baud) +
           ", data_bits: " + std::to_string(format.data_bits) +
           ", parity: " + to_string(format.parity) +
           ", stop_bits: " + std::to_string(format.stop_bits) + "}\n";
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
            yaml_serial(result) + "    stations:\n";
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
