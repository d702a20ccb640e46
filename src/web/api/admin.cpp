#include <boost/json/parse.hpp>

#include "answer.hpp"
#include "exchange.hpp"
#include "page.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace asio = boost::asio;
namespace json = boost::json;
namespace {

using Verdict = std::shared_ptr<const ReloadVerdict>;

json::array texts(const std::vector<std::string>& list) {
    return json::array(list.begin(), list.end());
}

json::array faults_of(const ReloadVerdict& verdict) {
    json::array faults;
    for (const ReloadVerdict::Fault& fault : verdict.faults) {
        json::object one{{"file", fault.file}, {"detail", fault.text}};
        if (fault.line > 0) {
            one["line"] = fault.line;
            one["column"] = fault.column;
        }
        faults.push_back(std::move(one));
    }
    return faults;
}

json::object describe(const ReloadVerdict& verdict) {
    json::object object{{"outcome", label(verdict.outcome)}, {"at", rfc3339(verdict.at)},
                        {"rollback", verdict.rollback},      {"cause", verdict.cause},
                        {"changes", texts(verdict.changes)}, {"warnings", texts(verdict.warnings)}};
    if (!verdict.weaker.empty()) object["weaker"] = texts(verdict.weaker);
    if (!verdict.later.empty()) object["restart_needed"] = texts(verdict.later);
    if (!verdict.faults.empty()) object["errors"] = faults_of(verdict);
    if (!verdict.why.empty()) object["why"] = verdict.why;
    return object;
}

/// The flag from the query or from the body.
bool flag_of(const HttpRequest& request, const json::object& body, const char* name) {
    const bool query = query_flag(request, name).value();
    return flag_member(body, name).value() || query;
}

ReloadWish wish_of(const HttpRequest& request) {
    json::object body;
    if (!request.body.empty()) body = parse_object(request.body, {"rollback", "weaker"}).value();
    const ReloadWish wish{flag_of(request, body, "rollback"), flag_of(request, body, "weaker")};
    if (wish.weaker && !wish.rollback)
        refuse(400, "weaker goes with rollback: a file is served as it is");
    return wish;
}

/// Texts of a verdict may be about any station.
json::object describe_to(const ReloadVerdict& verdict, bool sees_everything) {
    json::object object = describe(verdict);
    if (sees_everything) return object;
    for (const char* key : {"weaker", "restart_needed", "errors", "why"}) object.erase(key);
    object["changes"] = object["warnings"] = json::array();
    return object;
}

HttpResponse answer_of(const ReloadVerdict& verdict, bool sees_everything) {
    json::object told = describe_to(verdict, sees_everything);
    if (verdict.outcome == ReloadOutcome::applied || verdict.outcome == ReloadOutcome::unchanged)
        return json_response(200, told);
    const std::string why = sees_everything ? verdict.why
                                            : "what is wrong is not told to a role that does not "
                                              "see all of the plant";
    Problem made = problem(409, why + "; nothing has changed", "reload-failed");
    if (verdict.outcome == ReloadOutcome::refused) made.kind = "reload-weaker";
    if (verdict.outcome == ReloadOutcome::invalid)
        made = problem(422, "the configuration has faults; nothing has changed",
                       "invalid-configuration");
    made.extensions = std::move(told);
    return to_response(made);
}

}  // namespace

Handling get_reload(HttpRequest request, const Api* api) {
    const Verdict last = api->providers.reload ? api->providers.reload->last() : nullptr;
    if (!last) co_return json_response(200, json::object{{"outcome", "none"}});
    const bool all = Sight(*api->directory, request.caller->who()).everything();
    co_return json_response(200, describe_to(*last, all));
}

Handling post_reload(HttpRequest request, const Api* api) {
    const auto wish = wish_of(request);
    ReloadSource* source = api->providers.reload;
    const std::string why =
        source ? source->barred(wish.rollback) : "this program serves a built-in configuration";
    if (!why.empty()) co_return to_response(problem(409, why));
    request.caller->take_effect();
    // By the rules before the reload: a client that sees nothing now is not told the new state.
    const bool sees_everything = Sight(*api->directory, request.caller->who()).everything();
    std::function<void(std::function<void(Verdict)>)> start =
        [&](std::function<void(Verdict)> done) {
            source->reload(wish, request.caller->name(), std::move(done));
        };
    asio::awaitable<Verdict> reloading = result_of<Verdict>(std::move(start));
    const Verdict verdict = co_await std::move(reloading);
    co_return answer_of(*verdict, sees_everything);
}

namespace {

/// Rendered and kept; beyond, all are rendered anew.
constexpr std::size_t kKeptConfigurations = 64;

json::array rights_list(const Who& who) {
    json::array list;
    for (const Right right : kAllRights)
        if (who.standing.may(right)) list.emplace_back(label(right));
    return list;
}

/// For who may write the text: whether and why not.
std::string text_state(const Api& api, const Who& who) {
    if (api.providers.text == nullptr || !who.standing.may(Right::configure)) return {};
    const std::string why = api.providers.text->read_only();
    json::object text{{"writable", why.empty()}};
    if (!why.empty()) text["why"] = why;
    return ",\"text\":" + json_text(text);
}

/// What stands before the configuration itself.
std::string configuration_head(const Api& api, const Who& who) {
    return "{\"version\":" + json_text(boost::json::value(api.providers.version)) +
           ",\"role\":" + json_text(boost::json::value(who.standing.name())) +
           ",\"rights\":" + json_text(rights_list(who)) + text_state(api, who) +
           ",\"configuration\":";
}

/// The configuration of the stations that may be seen. "whole": traces of the line may be, too.
std::string seen_configuration(const std::string& text, const Directory& directory,
                               const Sight& sight) {
    json::value whole = json::parse(text);
    json::array lines;
    for (json::value& line : whole.as_object()["lines"].as_array()) {
        json::object& object = line.as_object();
        const std::string name(object["name"].as_string());
        const auto seen = [&](const char* list, const char* key) {
            json::array kept;
            for (const json::value& one : object[list].as_array())
                if (sight.named(name, std::string(one.at(key).as_string()), ""))
                    kept.push_back(one);
            return kept;
        };
        json::object shown{{"stations", seen("stations", "name")},
                           {"polls", seen("polls", "station")}};
        if (shown["stations"].as_array().empty()) continue;
        const auto entry = find_line(directory, name);
        shown["whole"] = entry && sight.whole(**entry);
        for (const char* key : {"name", "device", "mode", "serial", "unlisted_stations"})
            if (const json::value* own = object.if_contains(key)) shown[key] = *own;
        lines.push_back(std::move(shown));
    }
    return json_text(json::object{{"lines", std::move(lines)}, {"partial", true}});
}

/// A sign for each station, in the order of the directory.
std::string stations_seen(const Directory& directory, const Sight& sight) {
    std::string signs = " ";  // no name of a role has one
    for (const StationEntry& one : directory.stations) signs += sight.station(one) ? '1' : '0';
    return signs;
}

}  // namespace

/// The configuration is rendered once for all clients of a role that see the same stations.
Handling get_configuration(HttpRequest request, const Api* api) {
    if (!api->providers.configuration)
        co_return to_response(problem(404, "this program shows no configuration"));
    const Who& who = *request.caller->who();
    const Sight sight(*api->directory, request.caller->who());
    const bool all = sight.everything();
    std::string key(who.standing.name());
    if (!all) key += stations_seen(*api->directory, sight);
    if (api->configuration->size() >= kKeptConfigurations) api->configuration->clear();
    std::shared_ptr<KeptAnswer>& kept = (*api->configuration)[key];
    if (!kept) {
        const auto make = [head = configuration_head(*api, who), whole = all,
                           render = api->providers.configuration, directory = api->lent,
                           caller = request.caller->who()] {
            std::string seen = render();
            if (!whole) seen = seen_configuration(seen, *directory, Sight(*directory, caller));
            return head + seen + ",\"rest\":" + json_text(offered()) + "}\n";
        };
        kept = std::make_shared<KeptAnswer>(make, "application/json");
    }
    HttpResponse response = KeptAnswer::give(kept, request);
    response.is_long = true;
    co_return response;
}

Handling get_openapi(HttpRequest request, const Api*) {
    static const auto kept = std::make_shared<KeptAnswer>(openapi_text, "application/json");
    co_return KeptAnswer::give(kept, request);
}

Handling get_version(HttpRequest, const Api* api) {
    const Providers& providers = api->providers;
    boost::json::object libraries;
    for (const auto& [name, version] : providers.libraries) libraries[name] = version;
    boost::json::object body;
    body["version"] = providers.version;
    body["commit"] = providers.commit;
    body["compiler"] = providers.compiler;
    body["libraries"] = std::move(libraries);
    co_return json_response(200, body);
}

Handling get_healthz(HttpRequest, const Api*) { co_return text_response(200, "ok\n"); }

namespace {

StandbyView standby_of(const Api* api) {
    return api->providers.standby ? api->providers.standby() : StandbyView{};
}

/// Of a whole box: the line that has changed last tells why, and since when.
boost::json::object describe(const StandbyView& view, WallTime now) {
    boost::json::object object{{"role", view.is_active() ? "active" : "standby"}};
    object["since"] = nullptr;
    object["why"] = view.is_on ? "" : "there is no other box";
    object["peer"] =
        view.peer.empty() ? boost::json::value(nullptr) : boost::json::value(view.peer);
    boost::json::array lines;
    const StandbyView::Line* latest = nullptr;
    for (const StandbyView::Line& line : view.lines) {
        if (latest == nullptr || line.since < latest->since) latest = &line;
        const WallTime since = now - std::chrono::duration_cast<WallTime::duration>(line.since);
        lines.push_back(boost::json::object{{"line", line.name},
                                            {"role", line.role},
                                            {"since", rfc3339(since)},
                                            {"why", line.why},
                                            {"deaf", line.deaf}});
        if (latest == &line) object["since"] = rfc3339(since);
    }
    if (latest != nullptr) object["why"] = latest->why;
    object["lines"] = std::move(lines);
    return object;
}

}  // namespace

Handling get_standby(HttpRequest, const Api* api) {
    co_return json_response(200, describe(standby_of(api), api->providers.wall()));
}

Handling get_readyz(HttpRequest request, const Api* api) {
    const auto only_active = query_flag(request, "active").value();
    if (only_active && !standby_of(api).is_active())
        co_return text_response(503, "standby: another box drives the lines\n");
    if (api->providers.ready()) co_return text_response(200, "ready\n");
    const std::string missing = api->providers.missing();
    co_return text_response(503, missing.empty() ? "not ready\n" : "not ready: " + missing + '\n');
}

Handling get_metrics(HttpRequest request, const Api* api) {
    HttpResponse response = text_response(200, {}, api->providers.metrics_type);
    response.is_long = true;
    response.finish = [text = api->providers.figures(), directory = api->lent,
                       who = request.caller->who()](HttpResponse& made) {
        const Sight sight(*directory, who);
        made.body = sight.everything() ? text() : seen_metrics(text(), sight);
    };
    co_return response;
}

}  // namespace panelgate::web
