#include "overview.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <initializer_list>
#include <tuple>
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

/// The object of a list whose member `key` has this text; null: there is none.
const json::object* find(const json::object& answer, std::string_view list, std::string_view key,
                         const std::string& text) {
    for (const json::object* one : objects_of(answer, list))
        if (text_of(*one, key) == text) return one;
    return nullptr;
}

/// What was used of a line in the last minute; without anything before its first look.
json::object line_use(const Overview& overview, const std::string& line) {
    const json::object* found = find(overview.usage, "lines", "line", line);
    return found != nullptr ? *found : json::object();
}

json::object station_use(const Overview& overview, const json::object& station) {
    const json::object line = line_use(overview, text_of(station, "line"));
    const json::object* found = find(line, "stations", "station", text_of(station, "name"));
    return found != nullptr ? *found : json::object();
}

double count_of(const json::object& use, std::string_view name) {
    return number_of(use, name).value_or(0);
}

/// "figures of the last minute", or of less where the gateway is younger.
std::string span_of(const Overview& overview) {
    double seconds = 0;
    for (const json::object* line : objects_of(overview.usage, "lines"))
        seconds = std::max(seconds, count_of(*line, "seconds"));
    return "figures of the last " + (seconds >= 60 ? "minute" : span_text(seconds));
}

std::string mean(const json::object& use) {
    const auto ms = number_of(use, "transaction_ms");
    return ms ? latency_text(*ms / 1000) : "-";
}

/// "3 of 120"
Cell errors_of(const json::object& use) {
    return {whole(count_of(use, "errors")) + " of " + whole(count_of(use, "requests")),
            count_of(use, "errors") > 0 ? Colour::warning : Colour::none};
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
    for (const json::object* alarm : objects_of(overview.alarms, "alarms")) {
        const std::string state = shown(*alarm, "state");
        if (state != "normal")
            list.push_back("alarm " + shown(*alarm, "name") + " is " + state + ": " +
                           shown(*alarm, "text"));
    }
    for (const json::object* finding : objects_of(overview.findings, "findings"))
        list.push_back(shown(*finding, "text"));
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
        const json::object use = line_use(overview, text_of(line, "name"));
        table.add(
            {shown(line, "name"),
             {state + (listens ? ", listening" : ""), is_up(line) ? Colour::good : Colour::bad},
             percent(count_of(use, "load_percent")),
             whole(count_of(line, "queue_depth")),
             mean(use),
             errors_of(use),
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
        const json::object use = station_use(overview, *station);
        table.add({shown(*station, "name"),
                   line_of(overview, *station),
                   shown(*station, "profile"),
                   {state, colour_of(state)},
                   last ? span_text(*last / 1000) + " ago" : "never",
                   mean(use),
                   errors_of(use)});
    }
    return table.text(coloured);
}

/// What is found, what to do, and the numbers behind it.
std::string note(std::string text, const json::object& finding,
                 std::initializer_list<const char*> parts) {
    text += '\n';
    for (const char* part : parts) {
        const std::string sentence = shown(finding, part);
        if (!sentence.empty()) text += "  " + sentence + '\n';
    }
    return text;
}

std::string findings_text(const Overview& overview) {
    std::string text;
    for (const json::object* finding : objects_of(overview.findings, "findings"))
        text += note(shown(*finding, "name") + ": " + shown(*finding, "cause"), *finding,
                     {"text", "evidence", "advice"});
    for (const json::object& line : overview.lines) {
        for (const json::object* finding : objects_of(line, "findings"))
            text += note(finding_text(line, *finding), *finding, {"text", "advice"});
    }
    return text.empty() ? "" : '\n' + text;
}

}  // namespace

std::string status_text(const Overview& overview, bool coloured) {
    std::string text = overview.url + ", " + span_of(overview) + "\n\n" +
                       lines_table(overview, coloured) + '\n' + stations_table(overview, coloured) +
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
                           {"relays", list_in(overview.relays, "relays")},
                           {"findings", list_in(overview.findings, "findings")},
                           {"usage", list_in(overview.usage, "lines")}};
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

std::string utilisation(const Overview& overview, bool coloured) {
    TextTable table(
        {"LINE", "STATE", ">LOAD", "", ">QUEUE", ">REQUESTS/S", ">ERRORS/S", ">LATENCY"});
    for (const json::object& line : overview.lines) {
        const json::object use = line_use(overview, text_of(line, "name"));
        const double load = count_of(use, "load_percent");
        const double seconds = count_of(use, "seconds");
        const Colour colour = load > 80 ? Colour::bad : load > 50 ? Colour::warning : Colour::good;
        table.add({shown(line, "name"),
                   {shown(line, "state"), is_up(line) ? Colour::good : Colour::bad},
                   percent(load),
                   {bar(load), colour},
                   whole(count_of(line, "queue_depth")),
                   rate(count_of(use, "requests"), seconds),
                   {rate(count_of(use, "errors"), seconds),
                    count_of(use, "errors") > 0 ? Colour::warning : Colour::none},
                   mean(use)});
    }
    return table.text(coloured);
}

using Client = std::pair<const json::object*, const json::object*>;  // its line, and it

double share_of(const Client& client) { return count_of(*client.second, "percent"); }

std::string clients_table(const Overview& overview, bool coloured) {
    std::vector<Client> clients;
    for (const json::object* line : objects_of(overview.usage, "lines")) {
        for (const json::object* client : objects_of(*line, "clients"))
            clients.emplace_back(line, client);
    }
    std::ranges::sort(clients, std::ranges::greater(), share_of);
    TextTable table({"CLIENT", "LINE", ">SHARE", ">REQUESTS", ">FAILED", "LAST ERROR"});
    for (std::size_t i = 0; i < std::min(clients.size(), kRows); ++i) {
        const auto& [line, client] = clients[i];
        const double failed = number_of(*client, "failed").value_or(0);
        const auto ago = number_of(*client, "last_error_ms");
        table.add(
            {shown(*client, "name"),
             shown(*line, "line"),
             percent(share_of(clients[i])),
             whole(number_of(*client, "requests").value_or(0)),
             {whole(failed), failed > 0 ? Colour::warning : Colour::none},
             ago ? shown(*client, "last_error") + ", " + span_text(*ago / 1000) + " ago" : ""});
    }
    return table.text(coloured);
}

std::string slowest_table(const Overview& overview, bool coloured) {
    std::vector<std::tuple<double, const json::object*, json::object>> stations;
    for (const json::object* station : objects_of(overview.stations, "stations")) {
        json::object use = station_use(overview, *station);
        const auto ms = number_of(use, "transaction_ms");
        if (ms || text_of(*station, "state") == "offline")
            stations.emplace_back(ms.value_or(0), station, std::move(use));
    }
    std::ranges::sort(stations, std::ranges::greater(),
                      [](const auto& one) { return std::get<0>(one); });
    TextTable table({"SLOWEST", "LINE/ID", "STATE", ">LATENCY", ">ERRORS"});
    for (std::size_t i = 0; i < std::min(stations.size(), kRows); ++i) {
        const auto& [latency, station, use] = stations[i];
        const std::string state = shown(*station, "state");
        table.add({shown(*station, "name"),
                   line_of(overview, *station),
                   {state, colour_of(state)},
                   mean(use),
                   errors_of(use)});
    }
    return table.text(coloured);
}

}  // namespace

std::string top_text(const Overview& overview, bool coloured) {
    return overview.url + ", " + span_of(overview) + "\n\n" + utilisation(overview, coloured) +
           '\n' + clients_table(overview, coloured) + '\n' + slowest_table(overview, coloured);
}

}  // namespace panelgate::commands
