#include <boost/json/array.hpp>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "key_book.hpp"
#include "lists.hpp"
#include "panelgate/points/station_points.hpp"
#include "points.hpp"
#include "reading.hpp"
#include "routes.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace {

Handling read_items(HttpRequest request, Parsed<Items> items, const Api* api) {
    if (!items) co_return to_response(items.error());
    auto format = format_of(request);
    if (!format) co_return to_response(format.error());
    format->count = items->span.count;
    const auto view = prepare_read(*items, *format, api->providers.settings.max_transactions);
    if (!view) co_return to_response(view.error());
    const Duration deadline = api->directory->line_of(items->station).deadline;
    const Patience patience(deadline, api->providers.now);
    boost::asio::awaitable<Parsed<Reading>> reads =
        read_all(request.caller, &items->station, items->span, patience);
    Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) co_return to_response(reading.error());
    co_return json_response(200, describe(*items, *view, *reading));
}

}  // namespace

Handling get_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return read_items(std::move(request), std::move(items), api);
}

Handling get_device(HttpRequest request, const Api* api) {
    auto items = items_of_device_path(request, *api->directory);
    return read_items(std::move(request), std::move(items), api);
}

namespace json = boost::json;
namespace {

constexpr Members kOfPoints = {"raw"};
constexpr Members kOfItems = {"count", "type", "order", "length", "raw"};

Parsed<BatchRead> point_read(const json::object& entry, const Directory& directory) {
    const auto raw = flag_member(entry, "raw");
    if (!raw) return raw.error();
    auto found = point_of(entry, directory);
    if (!found) return found.error();
    BatchRead read;
    read.items.station = found->station;
    const points::Point& point = *found->point;
    read.items.span = {point.table, point.address, point.count()};
    read.view = {.value = point, .items = point.count(), .raw = *raw};
    read.point = std::move(*found);
    return read;
}

Parsed<BatchRead> read_of(const json::object& entry, const Api& api) {
    const auto known = check_members(entry, kOfPoints, kOfItems);
    if (!known) return known.error();
    if (names_point(entry)) return point_read(entry, *api.directory);
    const auto format = format_of(entry);
    if (!format) return format.error();
    auto items = item_of(entry, *api.directory);
    if (!items) return items.error();
    BatchRead read;
    read.items = std::move(*items);
    auto view = prepare_read(read.items, *format, api.providers.settings.max_transactions);
    if (!view) return view.error();
    read.view = std::move(*view);
    return read;
}

/// A malformed entry fails the whole list; one that cannot be read is reported in its place.
Parsed<std::vector<BatchRead>> reads_of(std::string_view body, const WhoRef& who, const Api& api) {
    const auto entries = entries_of(body, api.providers.settings.max_items);
    if (!entries) return entries.error();
    std::vector<BatchRead> reads;
    std::size_t values = 0;
    const std::size_t most = api.providers.settings.max_values;
    for (const json::object& entry : *entries) {
        auto read = read_of(entry, api);
        if (!read) read = told_of(entry, read.error(), who, *api.directory);
        if (!read && read.error().status == 400) return in_entry(reads.size(), read.error());
        if (read) {
            values += read->items.span.count;
            if (values > most)
                return problem(
                    422, "at most " + std::to_string(most) + " registers and bits in one list",
                    "too-many");
            reads.push_back(std::move(*read));
        } else {
            reads.emplace_back().problem = read.error();
        }
        reads.back().item = entry;
    }
    return reads;
}

json::object point_result(const BatchRead& read) {
    const points::Point& point = *read.point->point;
    const points::PointReading reading = point_reading(point, read.reading);
    json::object result;
    result["station"] = read.items.station.name;
    for (const auto& [name, value] : point_json(point, reading)) result[name] = value;
    if (read.view.raw)
        result["raw"] = json::array(read.reading.items.begin(), read.reading.items.end());
    result["source"] = read.reading.cached ? "cache" : "bus";
    return result;
}

json::object outcome_of(const BatchRead& read) {
    if (read.problem) return json_of(*read.problem);
    json::object result;
    result["status"] = 200;
    const json::object rest =
        read.point ? point_result(read) : describe(read.items, read.view, read.reading);
    for (const auto& [name, value] : rest) result[name] = value;
    return result;
}

json::object result_of(const BatchRead& read) {
    json::object result = outcome_of(read);
    result["item"] = read.item;
    return result;
}

const std::string* line_of(const BatchRead& read) {
    return read.problem ? nullptr : &read.items.station.line;
}

}  // namespace

Handling post_read(HttpRequest request, const Api* api) {
    auto reads = reads_of(request.body, request.caller->who(), *api);
    if (!reads) co_return to_response(reads.error());
    unsigned transactions = 0;
    std::vector<boost::asio::awaitable<void>> lines;
    for (auto& [name, entries] : by_line(*reads, line_of)) {
        const LineEntry* line = api->directory->find_line(name);
        const Patience patience(line->deadline, api->providers.now);
        lines.push_back(
            read_line(request.caller, line, std::move(entries), patience, &transactions));
    }
    boost::asio::awaitable<void> all = gather(std::move(lines));
    co_await std::move(all);
    if (request.caller->has_left()) co_return HttpResponse{};
    LongAnswer body;
    body.begin_list("results");
    for (const BatchRead& read : *reads) {
        body.add(result_of(read));
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = yield_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list().member("transactions", transactions);
    co_return body.response();
}

}  // namespace panelgate::web
