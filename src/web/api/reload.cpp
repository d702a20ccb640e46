#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <memory>
#include <string>
#include <utility>

#include "answer.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/web/api/reload_source.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
namespace json = boost::json;
namespace {

using Verdict = std::shared_ptr<const ReloadVerdict>;

/// Resumes the coroutine by post, never from inside the source.
struct StartReload {
    template <class Handler>
    void operator()(Handler handler, ReloadSource* source, ReloadWish wish,
                    std::string cause) const {
        auto shared = std::make_shared<Handler>(std::move(handler));
        source->reload(wish, std::move(cause), [shared](Verdict verdict) {
            const auto executor = asio::get_associated_executor(*shared);
            asio::post(executor, [shared, verdict = std::move(verdict)]() mutable {
                (std::move(*shared))(std::move(verdict));
            });
        });
    }
};

asio::awaitable<Verdict> reloaded(ReloadSource* source, ReloadWish wish, std::string cause) {
    return asio::async_initiate<const asio::use_awaitable_t<>, void(Verdict)>(
        StartReload{}, asio::use_awaitable, source, wish, std::move(cause));
}

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

/// By the query, or by a body.
Parsed<bool> flag_of(const HttpRequest& request, const json::object& body, const char* name) {
    const auto query = query_flag(request, name);
    if (!query) return query;
    const json::value* flag = body.if_contains(name);
    if (flag == nullptr) return query;
    if (!flag->is_bool()) return problem(400, std::string(name) + " must be true or false");
    return *query || flag->as_bool();
}

Parsed<ReloadWish> wish_of(const HttpRequest& request) {
    json::object body;
    if (!request.body.empty()) {
        auto given = parse_object(request.body, {"rollback", "weaker"});
        if (!given) return given.error();
        body = std::move(*given);
    }
    const auto rollback = flag_of(request, body, "rollback");
    if (!rollback) return rollback.error();
    const auto weaker = flag_of(request, body, "weaker");
    if (!weaker) return weaker.error();
    if (*weaker && !*rollback)
        return problem(400, "weaker goes with rollback: a file is served as it is");
    return ReloadWish{*rollback, *weaker};
}

HttpResponse answer_of(const ReloadVerdict& verdict) {
    switch (verdict.outcome) {
        case ReloadOutcome::applied:
        case ReloadOutcome::unchanged:
            break;
        case ReloadOutcome::invalid: {
            Problem made = problem(422, "the configuration has faults; nothing has changed",
                                   "invalid-configuration");
            made.extensions = describe(verdict);
            return to_response(made);
        }
        case ReloadOutcome::failed:
        case ReloadOutcome::refused: {
            const bool refused = verdict.outcome == ReloadOutcome::refused;
            Problem made = problem(409, verdict.why + "; nothing has changed",
                                   refused ? "reload-weaker" : "reload-failed");
            made.extensions = describe(verdict);
            return to_response(made);
        }
    }
    return json_response(200, describe(verdict));
}

}  // namespace

Handling get_reload(HttpRequest, const Api* api) {
    const Verdict last = api->providers.reload ? api->providers.reload->last() : nullptr;
    co_return json_response(200, last ? describe(*last) : json::object{{"outcome", "none"}});
}

Handling post_reload(HttpRequest request, const Api* api) {
    const auto wish = wish_of(request);
    if (!wish) co_return to_response(wish.error());
    ReloadSource* source = api->providers.reload;
    const std::string why =
        source ? source->barred(wish->rollback) : "this program serves a built-in configuration";
    if (!why.empty()) co_return to_response(problem(409, why));
    request.caller->take_effect();
    asio::awaitable<Verdict> reloading = reloaded(source, *wish, request.caller->name());
    const Verdict verdict = co_await std::move(reloading);
    co_return answer_of(*verdict);
}

}  // namespace panelgate::web
