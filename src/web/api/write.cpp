#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "body.hpp"
#include "key_book.hpp"
#include "lists.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/judge.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/query.hpp"
#include "reading.hpp"
#include "routes.hpp"
#include "station_path.hpp"
#include "writing.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

/// The query `round`.
Parsed<points::Rounding> rounding_of(const HttpRequest& request) {
    const auto round = query_flag(request, "round");
    if (!round) return round.error();
    return *round ? points::Rounding::nearest : points::Rounding::exact;
}

/// Logs and answers a refusal; the log names the target as the path does: "press/points/setpoint".
HttpResponse refused(const HttpRequest& request, const Problem& why) {
    std::string at;
    for (std::size_t i = 3; i < request.path.size(); ++i)  // after /api/v1/stations
        at += (at.empty() ? "" : "/") + request.path[i];
    log_refused(*request.caller, at, why);
    return to_response(why);
}

Handling carry_out(HttpRequest request, Parsed<Writing> writing, const Api* api) {
    if (!writing) co_return refused(request, writing.error());
    const Duration deadline = api->directory->line_of(writing->station).deadline;
    const Patience patience(deadline, api->providers.now);
    boost::asio::awaitable<Parsed<json::object>> writes =
        write(request.caller, &*writing, patience);
    const Parsed<json::object> result = co_await std::move(writes);
    if (!result) co_return to_response(result.error());
    co_return json_response(200, *result);
}

Handling put_items(HttpRequest request, Parsed<Items> items, const Api* api) {
    if (!items) co_return refused(request, items.error());
    auto writing = write_of(*items, parse_object(request.body, {"values", "value", "type", "order",
                                                                "length", "verify"}));
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), std::move(writing), api);
    co_return co_await std::move(done);
}

}  // namespace

Handling put_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return put_items(std::move(request), std::move(items), api);
}

Handling put_device(HttpRequest request, const Api* api) {
    auto items = made_writable(items_of_device_path(request, *api->directory));
    return put_items(std::move(request), std::move(items), api);
}

Handling put_point(HttpRequest request, const Api* api) {
    const auto to = find_point(*api->directory, request.arguments[0], request.arguments[1]);
    if (!to) co_return to_response(to.error());
    auto writing =
        write_of(*to, parse_object(request.body, {"value", "verify"}), rounding_of(request));
    boost::asio::awaitable<HttpResponse> done =
        carry_out(std::move(request), std::move(writing), api);
    co_return co_await std::move(done);
}

namespace {

constexpr Members kOfPoints = {"value", "round", "verify"};
constexpr Members kOfItems = {"values", "value", "type", "order", "length", "verify"};

/// One write of a list, and its result.
struct BatchWrite {
    json::object item;  ///< the entry as sent
    std::optional<Writing> writing;
    json::object result;
};

json::object ended(const Parsed<json::object>& written) {
    if (!written) return json_of(written.error());
    json::object result;
    result["status"] = 200;
    for (const auto& [name, value] : *written) result[name] = value;
    return result;
}

Parsed<Writing> write_of(const json::object& entry, const Directory& directory) {
    const auto known = check_members(entry, kOfPoints, kOfItems);
    if (!known) return known.error();
    if (!names_point(entry)) {
        const auto items = made_writable(item_of(entry, directory));
        if (!items) return items.error();
        return write_of(*items, entry);
    }
    const auto to = point_of(entry, directory);
    if (!to) return to.error();
    const auto round = flag_member(entry, "round");
    if (!round) return round.error();
    return write_of(*to, entry, *round ? points::Rounding::nearest : points::Rounding::exact);
}

/// The target as the entry names it: "press/setpoint", "press/GDT108".
std::string place_of(const json::object& entry) {
    std::string place;
    for (const char* name : {"point", "station", "device", "table", "address"}) {
        const json::value* part = entry.if_contains(name);
        if (part == nullptr) continue;
        if (!place.empty()) place += '/';
        place += part->is_string() ? std::string(part->as_string()) : json_text(*part);
    }
    return place;
}

/// A malformed entry fails the whole list before anything is sent; one that cannot be written is
/// reported in its place.
Parsed<std::vector<BatchWrite>> writes_of(const HttpRequest& request, const Api& api) {
    const auto entries = entries_of(request.body, api.providers.settings.max_items);
    if (!entries) return entries.error();
    std::vector<BatchWrite> writes;
    for (const json::object& entry : *entries) {
        auto writing = write_of(entry, *api.directory);
        if (!writing)
            writing = told_of(entry, writing.error(), request.caller->who(), *api.directory);
        if (!writing && writing.error().status == 400)
            return in_entry(writes.size(), writing.error());
        BatchWrite& write = writes.emplace_back();
        write.item = entry;
        if (writing) {
            write.writing = std::move(*writing);
        } else {
            log_refused(*request.caller, place_of(entry), writing.error());
            write.result = json_of(writing.error());
        }
    }
    return writes;
}

/// Writes the entries of one line, one after the other, in their order.
boost::asio::awaitable<void> write_line(std::shared_ptr<Caller> caller,
                                        std::vector<BatchWrite*> writes, Patience patience) {
    for (BatchWrite* one : writes) {
        boost::asio::awaitable<Parsed<json::object>> pending =
            write(caller, &*one->writing, patience);
        const Parsed<json::object> result = co_await std::move(pending);
        one->result = ended(result);
    }
}

const std::string* line_of(const BatchWrite& write) {
    return write.writing ? &write.writing->station.line : nullptr;
}

}  // namespace

Handling post_write(HttpRequest request, const Api* api) {
    auto writes = writes_of(request, *api);
    if (!writes) co_return to_response(writes.error());
    std::vector<boost::asio::awaitable<void>> lines;
    for (auto& [name, entries] : by_line(*writes, line_of)) {
        const Duration deadline = api->directory->find_line(name)->deadline;
        const Patience patience(deadline, api->providers.now);
        lines.push_back(write_line(request.caller, std::move(entries), patience));
    }
    boost::asio::awaitable<void> all = gather(std::move(lines));
    co_await std::move(all);
    json::array results;
    for (BatchWrite& write : *writes) {
        write.result["item"] = std::move(write.item);
        results.push_back(std::move(write.result));
    }
    json::object body;
    body["results"] = std::move(results);
    co_return json_response(200, body);
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

/// `confirmed`: all listed stations of the line have the new values.
HttpResponse verified_answer(json::array stations, bool confirmed) {
    json::object body;
    body["transmitted"] = true;
    body["confirmed"] = confirmed;
    body["stations"] = std::move(stations);
    return json_response(200, body);
}

/// Reads back from each listed station of the line, one after the other, while there is time; the
/// rest is reported as not read.
Handling read_everywhere(HttpRequest request, const Api* api, const LineEntry* line,
                         Verification written, Patience patience) {
    json::array stations;
    bool all = true;
    for (const StationEntry& station : api->directory->stations) {
        if (station.line != line->name) continue;
        boost::asio::awaitable<ReadBack> reads =
            read_back(request.caller, &station, &written, patience);
        const ReadBack back = co_await std::move(reads);
        json::object result;
        result["station"] = station.name;
        add_read_back(result, back);
        all = all && back.holds.value_or(false);
        stations.push_back(std::move(result));
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
    // An invalid request is reported first; a valid one is for the bus to refuse, which counts and
    // logs it.
    auto planned = broadcast_request(*api->directory, **line, *body);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    const auto written = Verification::of(made.request);
    const Patience patience((*line)->deadline, api->providers.now);
    made.within = patience.left();
    const bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    if (!*verify || answer.refusal || !answer.pdu) co_return broadcast_answer(answer);
    boost::asio::awaitable<HttpResponse> reading =
        read_everywhere(std::move(request), api, *line, *written, patience);
    co_return co_await std::move(reading);
}

namespace {

/// The panel's notation of each item; none if the panel type is unknown.
json::array notations(const Items& items) {
    json::array names;
    if (items.station.unknown_panel) return names;
    for (unsigned i = 0; i < items.span.count; ++i) {
        const auto address = static_cast<std::uint16_t>(items.span.first + i);
        const bool within = items.area != nullptr && items.area->readable.contains(address, 1);
        names.emplace_back(
            within ? profile::format_notation(*items.area, address)
                   : profile::format_notation(*items.station.profile, items.span.table, address));
    }
    return names;
}

/// The frame as it would be sent, with functions translated that the panel lacks.
std::string frame_of(const StationEntry& station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return "";
    const auto translated = profile::translate(*station.profile, *request);
    const Bytes& sent = translated ? translated->pdu() : request->pdu();
    return upper_hex(modbus::encode_adu(station.id, sent, station.profile->crc_order), " ");
}

HttpResponse describe(const Items& items, Bytes pdu, unsigned requests) {
    json::object body;
    body["station"] = items.station.name;
    body["line"] = items.station.line;
    body["id"] = items.station.id;
    body["table"] = label(items.span.table);
    body["address"] = items.span.first;
    body["count"] = items.span.count;
    body["requests"] = requests;
    body["frame"] = frame_of(items.station, std::move(pdu));
    body["notations"] = notations(items);
    return json_response(200, body);
}

/// The plan of a read; if it takes several requests, the first of them.
HttpResponse plan_of_read(Items items) {
    if (items.area != nullptr) {
        const auto range = check_range(items, items.area->readable, "readable");
        if (!range) return to_response(range.error());
        const auto table = table_to_read(items);
        if (!table) return to_response(table.error());
        items.span.table = *table;
    }
    const unsigned limit = items.station.profile->max_count(read_function(items.span.table));
    const unsigned requests = (items.span.count + limit - 1) / limit;
    items.span.count = std::min(items.span.count, limit);
    return describe(items, modbus::encode_read(items.span), requests);
}

HttpResponse plan_of_write(Items items, const std::string& values) {
    auto writable = made_writable(std::move(items));
    if (!writable) return to_response(writable.error());
    const auto body = parse_object("{\"values\":[" + values + "]}", {"values"});
    const auto writing = write_of(*writable, body);
    if (!writing) return to_response(writing.error());
    const modbus::Request& made = writing->request.request;
    writable->span.count = made.access().write->count;
    return describe(*writable, made.pdu(), 1);
}

/// The request that would be sent; nothing is sent.
HttpResponse plan(const HttpRequest& request, Parsed<Items> items) {
    if (!items) return to_response(items.error());
    const auto values = request.query.find("values");
    if (values == request.query.end()) return plan_of_read(std::move(*items));
    return plan_of_write(std::move(*items), values->second);
}

}  // namespace

Handling get_table_plan(HttpRequest request, const Api* api) {
    co_return plan(request, items_of_table_path(request, *api->directory));
}

Handling get_device_plan(HttpRequest request, const Api* api) {
    co_return plan(request, items_of_device_path(request, *api->directory));
}

}  // namespace panelgate::web
