// trace: the transactions of a running gateway's lines; report: all that it tells, for support.
#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "gateway_client.hpp"
#include "output.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/gateway/build_info.hpp"
#include "panelgate/rt/clock.hpp"
#include "trace_text.hpp"

namespace panelgate::commands {

namespace {

constexpr unsigned kMostEntries = 500;  // of a page of a trace
constexpr auto kBetweenPages = 500ms;
constexpr auto kBetweenLooks = 1s;  // at a gateway that is gone

struct TracedLine {
    std::string path;
    TraceFilter filter;
    std::map<unsigned, std::string> names;
    std::string next{};  ///< sequence number where the next page begins
};

std::optional<std::vector<std::string>> line_names(const GatewayClient& gateway, ExitCode& code) {
    boost::json::object answer;
    if (!ask_for(gateway, "/api/v1/lines", answer, code)) return std::nullopt;
    std::vector<std::string> names;
    for (const auto* line : objects_of(answer, "lines")) names.push_back(text_of(*line, "name"));
    return names;
}

std::optional<Station> known_station(const std::vector<Station>& all, const std::string& typed) {
    FoundStation found = station_of(all, typed);
    if (found.wrong.empty()) return std::move(found.station);
    std::cerr << "panelgate: " << found.wrong << '\n';
    return std::nullopt;
}

std::optional<std::vector<TracedLine>> lines_to_trace(const GatewayClient& gateway,
                                                      const TraceOptions& options, ExitCode& code) {
    const auto lines = line_names(gateway, code);
    const auto stations = lines ? all_stations(gateway, code) : std::nullopt;
    if (!stations) return std::nullopt;
    code = kNotReady;
    std::optional<Station> wanted;
    if (!options.station.empty() && !(wanted = known_station(*stations, options.station)))
        return std::nullopt;
    if (!options.line.empty() && std::ranges::find(*lines, options.line) == lines->end()) {
        std::cerr << "panelgate: there is no line '" << options.line << '\''
                  << suggestion(options.line, *lines) << '\n';
        return std::nullopt;
    }
    std::vector<TracedLine> traced;
    for (const std::string& line : *lines) {
        if (!options.line.empty() && line != options.line) continue;
        if (wanted && wanted->line != line) continue;
        TracedLine one{.path = "/api/v1/lines/" + escaped(line) + "/trace",
                       .filter = {.station = wanted ? wanted->id : 0,
                                  .name = wanted ? wanted->name : "",
                                  .errors = options.errors},
                       .names = {}};
        for (const Station& station : *stations)
            if (station.line == line) one.names[station.id] = station.name;
        traced.push_back(std::move(one));
    }
    code = kFine;
    return traced;
}

/// Reads what is new on all lines into `page`; returns the answer that is no page of a trace, if
/// there is one. What was read before it is kept for the next call.
std::optional<GatewayAnswer> read_page(const GatewayClient& gateway, std::vector<TracedLine>& lines,
                                       std::vector<TraceLine>& page) {
    for (TracedLine& line : lines) {
        const std::string query =
            (line.next.empty() ? "?last=" : "?since=" + line.next + "&last=") +
            std::to_string(kMostEntries);
        GatewayAnswer answer = gateway.get(line.path + query);
        if (!answer.is_ok()) return answer;
        if (const auto* next = answer.json.if_contains("next")) line.next = value_text(*next);
        for (auto& one : trace_lines(answer.json, line.filter, line.names))
            page.push_back(std::move(one));
    }
    std::ranges::sort(page, {}, [](const TraceLine& line) { return line.time; });
    return std::nullopt;
}

/// Prints what comes on all lines, for ever. A gateway that is gone is waited for, as `watch` does;
/// one that was started anew counts its transactions anew.
class Follower {
  public:
    Follower(const GatewayClient& gateway, std::vector<TracedLine> lines)
        : gateway_(gateway), lines_(std::move(lines)) {}

    void show(const std::vector<TraceLine>& page) {
        for (const TraceLine& line : page) {
            if (came_back_ && line.time <= newest_) continue;  // it was the same one, and is shown
            std::cout << line.text;
            newest_ = std::max(newest_, line.time);
        }
        if (!page.empty()) came_back_ = false;
        std::cout << std::flush;
    }

    ExitCode run() {
        for (std::vector<TraceLine> page;; page.clear()) {
            if (!std::cout) end_without_output();
            std::this_thread::sleep_for(is_gone_ ? kBetweenLooks : kBetweenPages);
            const auto wrong = read_page(gateway_, lines_, page);
            if (wrong && wrong->status != 0) return gateway_.explain(*wrong);
            show(page);
            if (wrong) {
                say_gone(*wrong);
            } else {
                is_gone_ = false;
            }
        }
    }

  private:
    void say_gone(const GatewayAnswer& answer) {
        for (TracedLine& line : lines_) line.next.clear();
        came_back_ = true;
        if (!std::exchange(is_gone_, true))
            std::cerr << "panelgate: " << gateway_.reason(answer) << "; waiting for it\n";
    }

    const GatewayClient& gateway_;
    std::vector<TracedLine> lines_;
    std::string newest_;  ///< time of what was shown last
    bool is_gone_ = false;
    bool came_back_ = false;  ///< and nothing was shown since
};

}  // namespace

ExitCode trace(const GatewayOptions& at, const TraceOptions& options) {
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    auto lines = lines_to_trace(*gateway, options, code);
    if (!lines) return code;
    if (options.follow) end_with_signals();
    std::vector<TraceLine> page;
    if (const auto wrong = read_page(*gateway, *lines, page)) return gateway->explain(*wrong);
    if (page.size() > options.count)
        page.erase(page.begin(), page.end() - static_cast<std::ptrdiff_t>(options.count));
    std::cout << trace_heading();
    Follower follower(*gateway, std::move(*lines));
    follower.show(page);
    return options.follow ? follower.run() : kFine;
}

namespace {

class Report {
  public:
    explicit Report(const GatewayClient& gateway) : gateway_(gateway) {}

    std::optional<std::string> make(ExitCode& code) {
        const auto lines = line_names(gateway_, code);
        if (!lines) return std::nullopt;
        add("time", rfc3339(rt::wall_now()));
        add("gateway", gateway_.url());
        add("asked_by", gateway::build_text());
        for (const char* name : {"version", "configuration", "reload", "stations", "points",
                                 "relays", "findings", "usage"})
            ask(name, std::string("/api/v1/") + name);
        ask("ready", "/readyz");
        for (const std::string& line : *lines) add_line(line);
        for (const char* part : {"history", "incidents", "trace"}) {
            for (const std::string& line : *lines) add_part(part, line);
        }
        ask("metrics", "/metrics");
        for (std::size_t i = 0; i < missing_.size(); ++i)
            add("missing/" + std::to_string(i + 1), missing_[i]);
        return gateway_.without_token(report_text(parts_));
    }
    const std::vector<std::string>& missing() const { return missing_; }

  private:
    void add(const std::string& name, std::string text, bool is_json = false) {
        parts_.push_back({name, std::move(text), is_json});
    }

    /// A refusal takes nothing from the rest: it is named.
    GatewayAnswer ask(const std::string& name, const std::string& path) {
        GatewayAnswer answer = gateway_.get(path);
        const bool is_readiness = path == "/readyz";
        if (answer.is_ok() || (is_readiness && answer.status != 0))
            add(name, answer.body, !answer.json.empty());
        else
            missing_.push_back(name + ": " + gateway_.reason(answer));
        return answer;
    }

    void add_line(const std::string& line) {
        ask("lines/" + line, "/api/v1/lines/" + escaped(line));
    }

    void add_part(const std::string& part, const std::string& line) {
        const std::string path = "/api/v1/lines/" + escaped(line) + '/' + part;
        if (part != "incidents") {
            ask(part + '/' + line, path + (part == "trace" ? "?last=500" : ""));
            return;
        }
        const GatewayAnswer answer = gateway_.get(path);
        for (const auto* incident : objects_of(answer.json, "incidents")) {
            const std::string id = value_text(incident->at("id"));
            ask("incidents/" + line + ' ' + id, path + '/' + id);
        }
    }

    const GatewayClient& gateway_;
    std::vector<ReportPart> parts_;
    std::vector<std::string> missing_;
};

/// "panelgate-report-20261126T014245Z.json"
std::string usual_name() {
    std::string time = rfc3339(rt::wall_now()).substr(0, 19);
    std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
    return "panelgate-report-" + time + "Z.json";
}

/// Writes a new file that only its owner can read.
ExitCode write_report(const std::string& file, const std::string& text) {
    const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0 && errno == EEXIST) {
        std::cerr << "panelgate: " << file << " is there already; give another name with -o\n";
        return kUsage;
    }
    bool written = fd >= 0;
    for (std::size_t done = 0; written && done < text.size();) {
        const ssize_t now = ::write(fd, text.data() + done, text.size() - done);
        written = now > 0;
        if (written) done += static_cast<std::size_t>(now);
    }
    const int why = errno;
    const bool closed = fd < 0 || ::close(fd) == 0;
    if (written && closed) return kFine;
    std::cerr << "panelgate: cannot write " << file << ": " << std::strerror(written ? errno : why)
              << '\n';
    if (fd >= 0) ::unlink(file.c_str());  // a part of it is no report
    return kInternal;
}

}  // namespace

ExitCode report(const GatewayOptions& at, const std::string& file) {
    const std::string name = file.empty() ? usual_name() : file;
    if (name != "-" && ::access(name.c_str(), F_OK) == 0) return write_report(name, "");
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    Report report(*gateway);
    const auto text = report.make(code);
    if (!text) return code;
    for (const std::string& one : report.missing())
        std::cerr << "panelgate: not in the report: " << one << '\n';
    if (name == "-") {
        std::cout << *text;
        return kFine;
    }
    code = write_report(name, *text);
    if (code == kFine)
        std::cerr << "panelgate: wrote " << name << ", " << text->size() / 1024 + 1
                  << " KiB: configuration without secrets, state, findings, incidents, traces and "
                     "metrics\n";
    return code;
}

ExitCode names(const GatewayOptions& at, const std::string& station) {
    std::cerr.setstate(std::ios::failbit);  // a completion says nothing
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    const std::string path = station.empty() ? "" : "/" + escaped(station) + "/points";
    const GatewayAnswer answer = gateway->get("/api/v1/stations" + path, 1s);
    for (const auto* one : objects_of(answer.json, station.empty() ? "stations" : "points"))
        std::cout << text_of(*one, "name") << '\n';
    return answer.is_ok() ? kFine : kNotReady;
}

}  // namespace panelgate::commands
