#include <boost/asio/awaitable.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "handlers.hpp"
#include "long_answer.hpp"
#include "panelgate/web/http/query.hpp"
#include "station_path.hpp"
#include "trace_file.hpp"
#include "trace_json.hpp"
#include "trace_pcapng.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr std::string_view kCapture = ".pcapng";

/// Of "7" and "7.pcapng".
struct Wanted {
    std::uint64_t id = 0;
    bool capture = false;
};
std::optional<Wanted> wanted_of(std::string_view text) {
    Wanted wanted;
    wanted.capture = text.ends_with(kCapture);
    if (wanted.capture) text.remove_suffix(kCapture.size());
    const auto id = to_number<std::uint64_t>(text);
    if (!id) return std::nullopt;
    wanted.id = *id;
    return wanted;
}

}  // namespace

Handling get_incidents(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    json::array list;
    for (const bus::IncidentHead& head : (*line)->bus->incidents()) list.push_back(describe(head));
    co_return json_response(200, json::object{{"incidents", std::move(list)}});
}

Handling get_incident(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string name = (*line)->name;
    const auto wanted = wanted_of(request.arguments[1]);
    const auto found = wanted ? (*line)->bus->incident(wanted->id) : std::nullopt;
    if (!found)
        co_return to_response(
            problem(404, "line '" + name + "' keeps no incident '" + request.arguments[1] + "'"));
    if (wanted->capture) {
        TracePcapng file(api->providers.version, name);
        file.add(found->part);
        std::string body = file.take();
        body += file.finish();
        co_return pcapng_response(std::move(body), name + '-' + request.arguments[1]);
    }
    LongAnswer body;
    for (const auto& [member, value] : describe(found->head)) body.member(member, value);
    boost::asio::awaitable<void> all = add_part(&body, &found->part);
    co_await std::move(all);
    co_return body.response();
}

}  // namespace panelgate::web
