#include <boost/json/array.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "entries.hpp"
#include "gather.hpp"
#include "handlers.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "writing.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr Members kOfPoints = {"value", "round", "verify"};
constexpr Members kOfItems = {"values", "value", "type", "order", "length", "verify"};

/// One of many writes, and what came of it.
struct BatchWrite {
    json::object item;  ///< as it was asked
    std::optional<Writing> writing;
    json::object result;
};

json::object ended(const Parsed<json::object>& told) {
    if (!told) return json_of(told.error());
    json::object result;
    result["status"] = 200;
    for (const auto& [name, value] : *told) result[name] = value;
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

/// As the entry names it: "press/setpoint", "press/GDT108".
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

/// What is malformed fails all of them, before anything goes out; what cannot be written is told in
/// its place.
Parsed<std::vector<BatchWrite>> writes_of(const HttpRequest& request, const Api& api) {
    const auto entries = entries_of(request.body, api.providers.settings.max_items);
    if (!entries) return entries.error();
    std::vector<BatchWrite> writes;
    for (const json::object& entry : *entries) {
        auto writing = write_of(entry, *api.directory);
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

/// Those of one line, one after the other, in their order.
boost::asio::awaitable<void> write_line(std::shared_ptr<Caller> caller,
                                        std::vector<BatchWrite*> writes, Patience patience) {
    for (BatchWrite* one : writes) {
        boost::asio::awaitable<Parsed<json::object>> pending =
            write(caller, &*one->writing, patience);
        const Parsed<json::object> told = co_await std::move(pending);
        one->result = ended(told);
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
        const Patience patience(request, deadline, api->providers.now);
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

}  // namespace panelgate::web
