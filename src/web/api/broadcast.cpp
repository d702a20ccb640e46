#include <algorithm>
#include <boost/json/array.hpp>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "patience.hpp"
#include "station_path.hpp"
#include "verification.hpp"
#include "write_plan.hpp"
#include "writing.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// The function that most of the line's listed panels take as a broadcast; the preferred one when
/// they do not decide.
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

Parsed<bus::Request> broadcast_request(const Directory& directory, const LineEntry& line,
                                       const json::object& body) {
    const auto word = string_member(body, "table");
    if (!word) return word.error();
    const auto table = parse_table(*word, 400);
    if (!table) return table.error();
    if (!is_writable(*table)) return problem(422, *word + " cannot be written", "not-writable");
    const auto address = number_member(body, "address", 0, 0xFFFF);
    if (!address) return address.error();
    const auto cells = values_member(body, *table);
    if (!cells) return cells.error();

    const auto functions = write_functions(*table, cells->size());
    const std::uint8_t function = broadcast_function(directory, line, functions);
    const unsigned limit = directory.generic->max_count(function);
    if (cells->size() > limit || *address + static_cast<std::int64_t>(cells->size()) > 0x10000) {
        return problem(422, "at most " + std::to_string(limit) +
                                " values in one broadcast, up to address 65535");
    }
    return request_to(0, encode_write(function, static_cast<std::uint16_t>(*address), *cells));
}

/// Confirmed: whoever is listed on the line shows it.
HttpResponse verified_answer(json::array stations, bool confirmed) {
    json::object body;
    body["transmitted"] = true;
    body["confirmed"] = confirmed;
    body["stations"] = std::move(stations);
    return json_response(200, body);
}

/// Asks each listed station of the line, one after the other, for as long as there is time; the
/// others are told as not read.
Handling read_everywhere(HttpRequest request, const Api* api, const LineEntry* line,
                         Verification written, Patience patience) {
    json::array stations;
    bool all = true;
    for (const StationEntry& station : api->directory->stations) {
        if (station.line != line->name) continue;
        boost::asio::awaitable<ReadBack> reads =
            read_back(request.caller, &station, &written, patience);
        const ReadBack back = co_await std::move(reads);
        json::object told;
        told["station"] = station.name;
        tell(told, back);
        all = all && back.holds.value_or(false);
        stations.push_back(std::move(told));
    }
    const bool confirmed = all && !stations.empty();
    co_return verified_answer(std::move(stations), confirmed);
}

}  // namespace

Handling post_broadcast(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto body = parse_object(request.body, {"table", "address", "values", "verify"});
    if (!body) co_return to_response(body.error());
    const auto verify = flag_member(*body, "verify");
    if (!verify) co_return to_response(verify.error());
    // What is no request says so first; one is the bus's to refuse, which counts and tells it.
    auto planned = broadcast_request(*api->directory, **line, *body);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    const auto written = Verification::of(made.request);
    const Patience patience(request, (*line)->deadline, api->providers.now);
    made.within = patience.left();
    const bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    if (!*verify || answer.refusal || !answer.pdu) co_return broadcast_answer(answer);
    boost::asio::awaitable<HttpResponse> reading =
        read_everywhere(std::move(request), api, *line, *written, patience);
    co_return co_await std::move(reading);
}

}  // namespace panelgate::web
