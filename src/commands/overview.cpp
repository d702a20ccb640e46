#include "overview.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "answers.hpp"
#include "panelgate/base/text.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace json = boost::json;

namespace {

constexpr std::size_t kRows = 10;  // clients and panels of `top`
constexpr std::size_t kBar = 16;   // characters: the table is 80 wide

std::string shown(const json::object& object, std::string_view name) {
    return printable(text_of(object, name));
}

std::string whole(double value) { return number_text(std::round(value)); }

std::string percent(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f %%", value);
    return text;
}

bool is_up(const json::object& line) {
    const json::value* up = line.if_contains("up");
    return up != nullptr && up->is_bool() && up->get_bool();
}

Figures figures_for(const AllFigures& all, const std::string& line, const std::string& station) {
    const auto found = all.find({line, station});
    return found == all.end() ? Figures{} : found->second;
}

std::string mean(const Figures& figures) {
    return figures.transactions > 0 ? latency_text(figures.seconds / figures.transactions) : "-";
}

/// "3 of 120"
Cell errors_of(const Figures& figures) {
    return {whole(figures.errors) + " of " + whole(figures.requests),
            figures.errors > 0 ? Colour::warning : Colour::none};
}

/// Unknown: the station was not asked, or the line is down. Heard: the station answers another
/// master.
bool is_well(std::string_view state) {
    return state == "online" || state == "heard" || state == "unknown";
}

Colour colour_of(std::string_view state) {
    if (state == "unknown") return Colour::warning;
    return is_well(state) ? Colour::good : Colour::bad;
}

std::string line_of(const Overview& overview, const json::object& station) {
    const auto id = number_of(station, "id").value_or(0);
    const std::string line = shown(station, "line");
    return overview.lines.empty() ? whole(id) : line + '/' + whole(id);
}

/// "press: station-silent"
std::string finding_text(const json::object& line, const json::object& finding) {
    const std::string name = shown(finding, "name");
    const auto station = number_of(finding, "station");
    std::string who = shown(line, "name");
    if (station) who += '/' + whole(*station);
    if (!name.empty()) who = name;
    return who + ": " + shown(finding, "cause");
}

void add_relays(const json::object& relays, std::vector<std::string>& list) {
    for (const json::object* relay : objects_of(relays, "relays")) {
        const std::string state = shown(*relay, "state");
        if (state != "ok" && state != "waiting")
            list.push_back("relay " + shown(*relay, "name") + ": " + state);
    }
}

}  // namespace

std::vector<std::string> troubles(const Overview& overview) {
    std::vector<std::string> list;
    if (!overview.not_ready.empty()) list.push_back("not ready: " + printable(overview.not_ready));
    for (const json::object& line : overview.lines) {
        if (!is_up(line))
            list.push_back("line " + shown(line, "name") + " is " + shown(line, "state"));
    }
    for (const json::object* station : objects_of(overview.stations, "stations")) {
        const std::string state = shown(*station, "state");
        const auto last = number_of(*station, "last_success_ms");
        if (is_well(state)) continue;
        list.push_back(shown(*station, "name") + " is " + state +
                       (last ? ", its last answer is " + span_text(*last / 1000) + " old"
                             : ", it has never answered"));
    }
    for (const json::object& line : overview.lines) {
        for (const json::object* finding : objects_of(line, "findings"))
            list.push_back(finding_text(line, *finding));
    }
    add_relays(overview.relays, list);
    return list;
}

namespace {

std::string lines_table(const Overview& overview, bool coloured) {
    TextTable table({"LINE", "STATE", ">LOAD", ">QUEUE", ">LATENCY", ">ERRORS", "DEVICE"});
    for (const json::object& line : overview.lines) {
        const std::string state = shown(line, "state");
        const bool listens = text_of(line, "mode") == "listen";
        const Figures figures = figures_for(overview.figures, text_of(line, "name"), "");
        table.add(
            {shown(line, "name"),
             {state + (listens ? ", listening" : ""), is_up(line) ? Colour::good : Colour::bad},
             percent(number_of(line, "load_percent").value_or(0)),
             whole(number_of(line, "queue_depth").value_or(0)),
             mean(figures),
             errors_of(figures),
             shown(line, "device")});
    }
    return table.text(coloured);
}

std::string stations_table(const Overview& overview, bool coloured) {
    TextTable table(
        {"STATION", "LINE/ID", "PROFILE", "STATE", ">LAST ANSWER", ">LATENCY", ">ERRORS"});
    for (const json::object* station : objects_of(overview.stations, "stations")) {
        const std::string state = shown(*station, "state");
        const auto last = number_of(*station, "last_success_ms");
        const Figures figures =
            figures_for(overview.figures, text_of(*station, "line"), text_of(*station, "name"));
        table.add({shown(*station, "name"),
                   line_of(overview, *station),
                   shown(*station, "profile"),
                   {state, colour_of(state)},
                   last ? span_text(*last / 1000) + " ago" : "never",
                   mean(figures),
                   errors_of(figures)});
    }
    return table.text(coloured);
}

std::string findings_text(const Overview& overview) {
    std::string text;
    for (const json::object& line : overview.lines) {
        for (const json::object* finding : objects_of(line, "findings")) {
            text += finding_text(line, *finding) + '\n';
            for (const char* part : {"text", "advice"}) {
                const std::string sentence = shown(*finding, part);
                if (!sentence.empty()) text += "  " + sentence + '\n';
            }
        }
    }
    return text.empty() ? "" : '\n' + text;
}

}  // namespace

std::string status_text(const Overview& overview, bool coloured) {
    std::string text = lines_table(overview, coloured) + '\n' + stations_table(overview, coloured) +
                       findings_text(overview) + '\n';
    const std::vector<std::string> list = troubles(overview);
    if (list.empty()) return text + painted("all is well", Colour::good, coloured) + '\n';
    text += painted("not all is well:", Colour::bad, coloured) + '\n';
    for (const std::string& one : list) text += "  " + one + '\n';
    return text;
}

std::string status_json(const Overview& overview) {
    const auto list_in = [](const json::object& answer, std::string_view name) {
        const json::value* found = answer.if_contains(name);
        return found != nullptr ? *found : json::value(json::array());
    };
    const std::vector<std::string> list = troubles(overview);
    const json::object all{{"url", overview.url},
                           {"ready", overview.not_ready.empty()},
                           {"troubles", json::array(list.begin(), list.end())},
                           {"lines", json::array(overview.lines.begin(), overview.lines.end())},
                           {"stations", list_in(overview.stations, "stations")},
                           {"relays", list_in(overview.relays, "relays")}};
    return json::serialize(all) + '\n';
}

namespace {

std::string bar(double share) {
    const auto full = static_cast<std::size_t>(
        std::lround(std::clamp(share / 100, 0.0, 1.0) * static_cast<double>(kBar)));
    return '[' + std::string(full, '#') + std::string(kBar - full, ' ') + ']';
}

std::string rate(double count, double seconds) {
    if (seconds <= 0) return "-";
    char text[32];
    std::snprintf(text, sizeof text, "%.1f", count / seconds);
    return text;
}

std::string utilisation(const Overview& overview, double seconds, bool coloured) {
    TextTable table(
        {"LINE", "STATE", ">LOAD", "", ">QUEUE", ">REQUESTS/S", ">ERRORS/S", ">LATENCY"});
    for (const json::object& line : overview.lines) {
        const double load = number_of(line, "load_percent").value_or(0);
        const Figures figures = figures_for(overview.figures, text_of(line, "name"), "");
        const Colour colour = load > 80 ? Colour::bad : load > 50 ? Colour::warning : Colour::good;
        table.add({shown(line, "name"),
                   {shown(line, "state"), is_up(line) ? Colour::good : Colour::bad},
                   percent(load),
                   {bar(load), colour},
                   whole(number_of(line, "queue_depth").value_or(0)),
                   rate(figures.requests, seconds),
                   {rate(figures.errors, seconds),
                    figures.errors > 0 && seconds > 0 ? Colour::warning : Colour::none},
                   mean(figures)});
    }
    return table.text(coloured);
}

using Client = std::pair<const json::object*, const json::object*>;  // its line, and it

double share_of(const Client& client) { return number_of(*client.second, "percent").value_or(0); }

std::string clients_table(const Overview& overview, bool coloured) {
    std::vector<Client> clients;
    for (const json::object& line : overview.lines) {
        for (const json::object* client : objects_of(line, "clients"))
            clients.emplace_back(&line, client);
    }
    std::ranges::sort(clients, std::ranges::greater(), share_of);
    TextTable table({"CLIENT", "LINE", ">SHARE", ">REQUESTS", ">FAILED", "LAST ERROR"});
    for (std::size_t i = 0; i < std::min(clients.size(), kRows); ++i) {
        const auto& [line, client] = clients[i];
        const double failed = number_of(*client, "failed").value_or(0);
        const auto ago = number_of(*client, "last_error_ms");
        table.add(
            {shown(*client, "name"),
             shown(*line, "name"),
             percent(share_of(clients[i])),
             whole(number_of(*client, "requests").value_or(0)),
             {whole(failed), failed > 0 ? Colour::warning : Colour::none},
             ago ? shown(*client, "last_error") + ", " + span_text(*ago / 1000) + " ago" : ""});
    }
    return table.text(coloured);
}

std::string slowest_table(const Overview& overview, bool coloured) {
    std::vector<std::pair<double, const json::object*>> stations;
    for (const json::object* station : objects_of(overview.stations, "stations")) {
        const Figures figures =
            figures_for(overview.figures, text_of(*station, "line"), text_of(*station, "name"));
        const bool silent = text_of(*station, "state") == "offline";
        if (figures.transactions > 0 || silent)
            stations.emplace_back(
                figures.transactions > 0 ? figures.seconds / figures.transactions : 0, station);
    }
    std::ranges::sort(stations, std::ranges::greater(), [](const auto& one) { return one.first; });
    TextTable table({"SLOWEST", "LINE/ID", "STATE", ">LATENCY", ">ERRORS"});
    for (std::size_t i = 0; i < std::min(stations.size(), kRows); ++i) {
        const auto& [latency, station] = stations[i];
        const std::string state = shown(*station, "state");
        table.add({shown(*station, "name"),
                   line_of(overview, *station),
                   {state, colour_of(state)},
                   latency > 0 ? latency_text(latency) : "-",
                   errors_of(figures_for(overview.figures, text_of(*station, "line"),
                                         text_of(*station, "name")))});
    }
    return table.text(coloured);
}

}  // namespace

std::string top_text(const Overview& overview, double seconds, bool coloured) {
    const std::string of =
        seconds > 0 ? "figures of the last " + span_text(seconds) : "figures since its start";
    return overview.url + ", " + of + "\n\n" + utilisation(overview, seconds, coloured) + '\n' +
           clients_table(overview, coloured) + '\n' + slowest_table(overview, coloured);
}

}  // namespace panelgate::commands
