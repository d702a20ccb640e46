#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "answer.hpp"
#include "exchange.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/api/values.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

/// In the list of lines a finding is reduced to its cause.
json::object describe(const LineEntry& line, const bus::LineStatus& status) {
    json::object object;
    object["name"] = line.name;
    object["device"] = line.device;
    object["state"] = status.state;
    object["mode"] = status.listens ? "listen" : "master";
    object["up"] = status.up;
    object["load_percent"] = std::round(status.load_percent * 10) / 10;
    object["queue_depth"] = status.queue_depth;
    object["echo"] = label(status.echo);
    json::array causes;
    for (const bus::LineFinding& finding : status.findings) causes.emplace_back(finding.cause);
    object["findings"] = std::move(causes);
    return object;
}

json::array describe(const std::vector<bus::LineFinding>& findings) {
    json::array list;
    for (const bus::LineFinding& finding : findings) {
        json::object object;
        object["cause"] = finding.cause;
        object["station"] = nullptr;
        if (finding.station) object["station"] = *finding.station;
        object["name"] = nullptr;
        if (!finding.name.empty()) object["name"] = finding.name;
        object["text"] = finding.text;
        object["advice"] = finding.advice;
        object["evidence"] = finding.evidence;
        json::object figures;
        for (const auto& [name, value] : finding.figures) figures[name] = value;
        object["figures"] = std::move(figures);
        list.push_back(std::move(object));
    }
    return list;
}

json::array describe(const std::vector<bus::ClientShare>& clients) {
    json::array list;
    for (const bus::ClientShare& client : clients) {
        json::object object;
        object["name"] = client.name;
        object["address"] = nullptr;
        if (client.address) object["address"] = *client.address;
        object["requests"] = client.requests;
        object["failed"] = client.failed;
        object["last_error"] = nullptr;
        object["last_error_ms"] = nullptr;
        if (client.last_error) {
            object["last_error"] = label(*client.last_error);
            object["last_error_ms"] = whole_ms(client.last_error_ago);
        }
        object["gone_ms"] = nullptr;
        if (client.gone) object["gone_ms"] = whole_ms(*client.gone);
        object["busy_seconds"] = to_seconds(client.busy);
        object["percent"] = std::round(client.percent * 10) / 10;
        object["transactions"] = client.transactions;
        list.push_back(std::move(object));
    }
    return list;
}

/// Findings only of stations that may be seen.
bus::LineStatus status_of(const LineEntry& line, const Sight& sight) {
    bus::LineStatus status = line.bus->status();
    std::erase_if(status.findings, [&](const bus::LineFinding& finding) {
        return finding.station && !sight.station(line, *finding.station);
    });
    return status;
}

}  // namespace

Handling get_lines(HttpRequest request, const Api* api) {
    const Sight sight(*api->directory, request.caller->who());
    std::vector<std::pair<const LineEntry*, bus::LineStatus>> seen;
    for (const LineEntry& line : api->directory->lines)
        if (sight.line(line)) seen.emplace_back(&line, status_of(line, sight));
    Table table{.directory = api->lent, .name = "lines", .count = seen.size()};
    table.entry = [seen = std::move(seen)](std::size_t i) {
        return describe(*seen[i].first, seen[i].second);
    };
    co_return table_answer(request, std::move(table));
}

Handling get_line(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const Sight sight(*api->directory, request.caller->who());
    const bus::LineStatus status = status_of(*line, sight);
    json::object body = describe(*line, status);
    body["findings"] = describe(status.findings);
    std::vector<bus::ClientShare> clients = line->bus->clients();
    // Whom they ask, and what they get, is about all stations.
    if (!sight.whole(*line)) clients.clear();
    body["clients"] = describe(clients);
    co_return json_response(200, body);
}

std::string_view label(DiscoveryReport::State state) {
    switch (state) {
        case DiscoveryReport::State::never:
            return "never";
        case DiscoveryReport::State::running:
            return "running";
        case DiscoveryReport::State::done:
            return "done";
        case DiscoveryReport::State::stopped:
            return "stopped";
    }
    std::abort();
}

namespace {

constexpr std::int64_t kDefaultShare = 10;  ///< %
constexpr std::int64_t kMostShare = 50;
constexpr const char* kAll = "1-247";

json::object describe(const std::string& line, const DiscoveryReport& report) {
    json::object object;
    object["line"] = line;
    object["state"] = label(report.state);
    object["share_percent"] = report.share_percent;
    object["asked"] = report.asked;
    object["refused"] = report.refused;
    object["of"] = report.of;
    object["asked_stations"] = report.asked_stations;
    object["silent_stations"] = report.silent_stations;
    object["found"] = report.stations.size();
    object["bus_ms"] = whole_ms(report.bus);
    object["took_ms"] = whole_ms(report.took);
    if (report.remaining) object["remaining_ms"] = whole_ms(*report.remaining);
    if (!report.why.empty()) object["why"] = report.why;
    json::array stations;
    for (const DiscoveredStation& station : report.stations) {
        stations.push_back(json::object{
            {"id", station.id},
            {"profiles", json::array(station.profiles.begin(), station.profiles.end())},
            {"evidence", station.evidence}});
    }
    object["stations"] = std::move(stations);
    object["yaml"] = report.yaml;
    return object;
}

struct Wanted {
    std::string stations = kAll;
    unsigned share = kDefaultShare;
};

Wanted wanted_of(std::string_view text) {
    Wanted wanted;
    if (text.empty()) return wanted;
    const json::object body = parse_object(text, {"stations", "share_percent"}).value();
    if (body.contains("stations")) wanted.stations = string_member(body, "stations").value();
    if (body.contains("share_percent"))
        wanted.share =
            static_cast<unsigned>(number_member(body, "share_percent", 1, kMostShare).value());
    return wanted;
}

/// Why no discovery can start on this line now.
std::optional<Problem> barred(const LineEntry& line, const DiscoverySource& source) {
    const bus::LineStatus status = line.bus->status();
    // A listening line's refusal of a write names the reason: another master.
    if (const auto refusal = line.bus->write_refusal(0); status.listens && refusal)
        return problem_of(*refusal);
    if (source.report(line.name).state == DiscoveryReport::State::running)
        return problem(409, "stations are being looked for on line '" + line.name + "' already");
    if (status.up) return std::nullopt;
    Problem down = problem_of(Fault::line_down, false);
    down.detail = "the line is " + status.state;
    return down;
}

}  // namespace

Handling get_discovery(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const std::string& name = line->name;
    co_return json_response(200, describe(name, api->providers.discovery->report(name)));
}

Handling post_discover(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const auto wanted = wanted_of(request.body);
    DiscoverySource& source = *api->providers.discovery;
    if (const auto problem = barred(*line, source)) co_return to_response(*problem);
    const std::string& name = line->name;
    if (const auto wrong = source.start(name, wanted.stations, wanted.share))
        co_return to_response(problem(400, "stations " + *wrong));
    log_client(*request.caller, "discovery started",
               {{"line", name}, {"stations", wanted.stations}});
    request.caller->take_effect();
    co_return json_response(202, describe(name, source.report(name)));
}

Handling delete_discovery(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const std::string& name = line->name;
    if (api->providers.discovery->report(name).state == DiscoveryReport::State::running)
        log_client(*request.caller, "discovery stopped", {{"line", name}});
    api->providers.discovery->stop(name);
    co_return json_response(200, describe(name, api->providers.discovery->report(name)));
}

namespace {

/// The function that most of the line's listed panels accept as a broadcast; in a tie the preferred
/// one.
std::uint8_t broadcast_function(const Directory& directory, const LineEntry& line,
                                const std::vector<std::uint8_t>& functions) {
    const auto takers = [&](std::uint8_t function) {
        return std::ranges::count_if(directory.stations, [&](const StationEntry& station) {
            if (station.line != line.name) return false;
            const auto* rule = station.profile->find_function(function);
            return rule != nullptr && rule->broadcast;
        });
    };
    return *std::ranges::max_element(functions, {}, takers);
}

bus::Request broadcast_request(const Directory& directory, const LineEntry& line,
                               const json::object& body) {
    const std::string word = string_member(body, "table").value();
    const modbus::Table table = parse_table(word, 400).value();
    if (!is_writable(table)) refuse(422, word + " cannot be written", "not-writable");
    const auto address = number_member(body, "address", 0, 0xFFFF).value();
    const std::vector<std::uint16_t> cells = cells_of(body, table).value();
    const auto functions = write_functions(table, cells.size());
    const std::uint8_t function = broadcast_function(directory, line, functions);
    const unsigned limit = directory.generic->max_count(function);
    if (cells.size() > limit || address + static_cast<std::int64_t>(cells.size()) > 0x10000)
        refuse(422, "at most " + std::to_string(limit) +
                        " values in one broadcast, up to address 65535");
    return request_to(0, encode_write(function, static_cast<std::uint16_t>(address), cells))
        .value();
}

/// The answer to a broadcast: 202, because no station replies to one.
HttpResponse broadcast_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    return json_response(202, json::object{{"transmitted", true}, {"confirmed", false}});
}

/// Reads back from each listed station of the line, one after the other, while there is time; the
/// rest is reported as not read. "confirmed": all of these stations have the new values.
Handling read_everywhere(HttpRequest request, const Api* api, const LineEntry* line,
                         Verification written, Patience patience) {
    json::array stations;
    bool all = true;
    for (const StationEntry& station : api->directory->stations) {
        if (station.line != line->name) continue;
        json::object result{{"station", station.name}};
        boost::asio::awaitable<bool> reads =
            read_back(request.caller, &station, &written, patience, &result);
        const bool holds = co_await std::move(reads);
        all = all && holds;
        stations.push_back(std::move(result));
    }
    json::object body{{"transmitted", true}, {"confirmed", all && !stations.empty()}};
    body["stations"] = std::move(stations);
    co_return json_response(200, body);
}

}  // namespace

Handling post_broadcast(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const auto body = parse_object(request.body, {"table", "address", "values", "verify"}).value();
    const auto verify = flag_member(body, "verify").value();
    // An invalid request is reported first; a valid one is for the bus to refuse, which counts and
    // logs it.
    bus::Request made = broadcast_request(*api->directory, *line, body);
    const auto written = Verification::of(made.request);
    const Patience patience(line->deadline, api->providers.now);
    const bus::Answer answer = co_await ask(request.caller, line->bus, std::move(made), patience);
    if (!verify || answer.refusal || !answer.pdu) co_return broadcast_answer(answer);
    boost::asio::awaitable<HttpResponse> reading =
        read_everywhere(std::move(request), api, line, *written, patience);
    co_return co_await std::move(reading);
}

namespace {

Parsed<void> check_raw_station(const Directory& directory, const LineEntry& line, std::uint8_t id,
                               bool may) {
    const std::string name = line.name + ":" + std::to_string(id);
    if (id != 0 && !directory.find_station(name))
        return problem(404, "there is no station '" + name + "'", "unknown-station");
    if (id != 0 && may) return {};
    if (const auto refusal = line.bus->write_refusal(id)) return problem_of(*refusal);
    return {};
}

/// No station answers a broadcast, so a broadcast can only write.
Problem no_broadcast() {
    Problem made = problem_of(Fault::denied, false);
    made.detail =
        "refused here, nothing was sent: station 0 is all stations of the line, of which none "
        "answers: a broadcast can write (05, 06, 15, 16), but not read";
    return made;
}

Parsed<bus::Request> raw_request(const Directory& directory, const LineEntry& line,
                                 const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxListedStation);
    if (!station) return station.error();
    const auto hex = string_member(body, "pdu");
    if (!hex) return hex.error();
    auto pdu = from_hex(*hex);
    if (!pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return problem(400, "pdu must be 1 to 253 bytes as pairs of hex digits");
    }
    const auto id = static_cast<std::uint8_t>(*station);
    const bool reads = modbus::is_pure_read(*pdu);  // also if it is malformed
    const bool spreads = modbus::is_broadcastable(pdu->front());
    auto made = request_to(id, std::move(*pdu));
    if (id == 0 && !spreads && (made || reads)) return no_broadcast();
    const auto allowed = check_raw_station(directory, line, id, reads || made);
    if (!allowed) return allowed.error();
    return made;
}

/// Reports a request that is invalid or refused before the bus is asked: the bus counts and logs
/// it.
void count_refused(Caller& caller, bus::RequestPort& bus, const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxListedStation);
    const auto hex = string_member(body, "pdu");
    const auto pdu = hex ? from_hex(*hex) : std::nullopt;
    if (!station || !pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) return;
    introduce(caller, &bus);
    bus.count_refused(static_cast<std::uint8_t>(*station), *pdu, caller.who());
}

/// A panel's exception reply is a normal answer here.
HttpResponse raw_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    json::object body;
    body["pdu"] = upper_hex(*answer.pdu, "");
    if (const auto code = modbus::exception_of(*answer.pdu)) body["exception"] = *code;
    return json_response(200, body);
}

}  // namespace

Handling post_raw(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const auto body = parse_object(request.body, {"station", "pdu"}).value();
    auto planned = raw_request(*api->directory, *line, body);
    if (!planned) {
        count_refused(*request.caller, *line->bus, body);
        co_return to_response(planned.error());
    }
    bus::Request made = std::move(*planned);
    const bool broadcast = made.station == 0;
    const Patience patience(line->deadline, api->providers.now);
    made.raw = made.verbatim = true;
    const bus::Answer answer = co_await ask(request.caller, line->bus, std::move(made), patience);
    co_return broadcast ? broadcast_answer(answer) : raw_answer(answer);
}

}  // namespace panelgate::web
