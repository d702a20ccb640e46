// read and write: one question to a running gateway.
#include <algorithm>
#include <cstddef>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "gateway_client.hpp"
#include "output.hpp"

namespace panelgate::commands {

namespace {

ExitCode wrong_usage(const std::string& what) {
    std::cerr << "panelgate: " << what << '\n';
    return kUsage;
}

std::string query_of(const ReadOptions& options) {
    std::string query;
    const auto add = [&](const char* name, const std::string& value) {
        if (!value.empty())
            query += (query.empty() ? '?' : '&') + std::string(name) + '=' + escaped(value);
    };
    add("type", options.type);
    add("order", options.order);
    add("count", options.count == 0 ? "" : std::to_string(options.count));
    return query;
}

}  // namespace

ExitCode read(const GatewayOptions& at, const ReadOptions& options) {
    const Places places = places_of(options.words);
    if (!places.wrong.empty()) return wrong_usage(places.wrong);
    if (places.list.size() > 1)
        return wrong_usage("read takes one place, `panelgate watch` several");
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    const auto place = find_place(*gateway, places.list.front(), code);
    if (!place) return code;
    const std::string query = query_of(options);
    if (!may_have_type(*place, !query.empty())) return kUsage;
    const GatewayAnswer answer = gateway->get(place->target.path + query);
    if (!answer.is_ok()) return explain_place(*gateway, *place, answer, "read");
    const bool is_point = place->target.kind == PlaceKind::point;
    if (options.json)
        std::cout << answer.body << (answer.body.ends_with('\n') ? "" : "\n");
    else if (is_point)
        std::cout << point_line(place->target.shown, answer.json);
    else
        std::cout << reading_text(answer.json, options.type);
    return is_point && !is_good(answer.json) ? kNotReady : kFine;
}

ExitCode write(const GatewayOptions& at, const WriteOptions& options) {
    std::vector<std::string> values = options.words;
    const std::size_t place_words = !values.empty() && holds_place(values.front()) ? 1 : 2;
    std::vector<std::string> words(
        values.begin(),
        values.begin() + static_cast<std::ptrdiff_t>(std::min(place_words, values.size())));
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(words.size()));
    const Places places = places_of(words);
    if (!places.wrong.empty()) return wrong_usage(places.wrong);
    if (values.empty())
        return wrong_usage("VALUE is missing: write STATION PLACE VALUE, such as oven/mode 1");
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    const auto place = find_place(*gateway, places.list.front(), code);
    if (!place) return code;
    if (!may_have_type(*place, !options.type.empty() || !options.order.empty())) return kUsage;
    if (place->target.kind == PlaceKind::point && values.size() > 1)
        return wrong_usage(place->target.shown + " is a point, which takes one value, not " +
                           std::to_string(values.size()));
    const std::string typed = place->type.empty() ? options.type : place->type;
    const std::string json = json_of_values(values, typed == "string");
    if (json.empty()) return wrong_usage("a decimal number is written with a point, such as 21.5");
    std::string body =
        std::string("{\"") + (values.size() == 1 ? "value" : "values") + "\":" + json;
    for (const auto& [name, value] : {std::pair("type", options.type), {"order", options.order}})
        if (!value.empty()) body += std::string(",\"") + name + "\":" + json_of_value(value, true);
    const GatewayAnswer answer = gateway->put(place->target.path, body + '}');
    if (!answer.is_ok()) return explain_place(*gateway, *place, answer, "written");
    std::string shown;
    for (const std::string& value : values) shown += (shown.empty() ? "" : " ") + value;
    print_done(written_text(place->target.shown, shown, answer.json));
    return is_confirmed(answer.json) ? kFine : kNotReady;
}

}  // namespace panelgate::commands
