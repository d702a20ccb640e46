#include "lists.hpp"

#include <algorithm>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json/array.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <utility>

#include "sight.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

bool has(const json::object& entry, std::string_view name) { return entry.contains(name); }

}  // namespace

Parsed<std::vector<json::object>> entries_of(std::string_view text, std::size_t most) {
    const auto body = parse_object(text, {"items"});
    if (!body) return body.error();
    const json::value* items = body->if_contains("items");
    if (items == nullptr || !items->is_array() || items->get_array().empty())
        return problem(400, R"(the body must be {"items": [...]} with at least one entry)");
    if (items->get_array().size() > most)
        return problem(422, "at most " + std::to_string(most) + " entries in one list", "too-many");
    std::vector<json::object> entries;
    for (const json::value& item : items->get_array()) {
        if (!item.is_object())
            return in_entry(entries.size(), problem(400, "an entry is a JSON object"));
        entries.push_back(item.get_object());
    }
    return entries;
}

bool names_point(const json::object& entry) { return has(entry, "point"); }

Parsed<void> check_members(const json::object& entry, Members of_points, Members of_items) {
    std::vector<std::string_view> known;
    if (names_point(entry)) {
        known = {"id", "point"};
        known.insert(known.end(), of_points);
    } else {
        if (!has(entry, "device") && !has(entry, "table"))
            return problem(400, R"(an entry has "point", "device" or "table")");
        known = {"id", "station"};
        if (has(entry, "device")) {
            known.emplace_back("device");
        } else {
            known.insert(known.end(), {"table", "address"});
        }
        known.insert(known.end(), of_items);
    }
    for (const auto& [name, value] : entry) {
        if (std::find(known.begin(), known.end(), std::string_view(name)) == known.end())
            return unknown_name("member", name, known);
    }
    return {};
}

Parsed<PointOfStation> point_of(const json::object& entry, const Directory& directory) {
    const auto name = string_member(entry, "point");
    if (!name) return name.error();
    return find_point(directory, *name);
}

Parsed<Items> item_of(const json::object& entry, const Directory& directory) {
    const auto name = string_member(entry, "station");
    if (!name) return name.error();
    if (has(entry, "device")) {
        const auto notation = string_member(entry, "device");
        if (!notation) return notation.error();
        auto station = find_station(directory, *name);
        if (!station) return station.error();
        return item_of_notation(std::move(*station), *notation);
    }
    const auto word = string_member(entry, "table");
    if (!word) return word.error();
    const auto table = parse_table(*word, 400);
    if (!table) return table.error();
    const auto address = number_member(entry, "address", 0, 0xFFFF);
    if (!address) return address.error();
    auto station = find_station(directory, *name);
    if (!station) return station.error();
    return item_of_table(std::move(*station), *table, static_cast<std::uint16_t>(*address));
}

Problem told_of(const json::object& entry, Problem why, const WhoRef& who,
                const Directory& directory) {
    const json::value* named = entry.if_contains(names_point(entry) ? "point" : "station");
    if (named == nullptr || !named->is_string()) return why;
    const std::string name(named->as_string());
    const std::size_t slash = std::min(name.find('/'), name.size());
    const std::string point = slash == name.size() ? "" : name.substr(slash + 1);
    return instead_of_telling(name.substr(0, slash), point, who, directory)
        .value_or(std::move(why));
}

Problem in_entry(std::size_t index, Problem problem) {
    problem.detail = "items[" + std::to_string(index) + "]: " + problem.detail;
    return problem;
}

namespace asio = boost::asio;
namespace {

template <class Handler>
struct Gathering {
    explicit Gathering(Handler with) : handler(std::move(with)) {}

    Handler handler;
    std::size_t open = 0;
    std::exception_ptr failed;
};

struct StartAll {
    template <class Handler>
    void operator()(Handler handler, std::vector<asio::awaitable<void>> all) const {
        const auto executor = asio::get_associated_executor(handler);
        auto gathering = std::make_shared<Gathering<Handler>>(std::move(handler));
        gathering->open = all.size();
        for (asio::awaitable<void>& one : all) {
            asio::co_spawn(
                executor, std::move(one), [gathering, executor](std::exception_ptr failed) {
                    if (!gathering->failed) gathering->failed = failed;
                    if (--gathering->open > 0) return;
                    asio::post(executor,
                               [gathering] { std::move(gathering->handler)(gathering->failed); });
                });
        }
    }
};

}  // namespace

asio::awaitable<void> gather(std::vector<asio::awaitable<void>> all) {
    if (all.empty()) co_return;
    asio::awaitable<void> pending =
        asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr)>(
            StartAll{}, asio::use_awaitable, std::move(all));
    co_await std::move(pending);
}

}  // namespace panelgate::web
