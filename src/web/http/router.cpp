#include "router.hpp"

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/error_code.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "access.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/client_log.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
namespace {

/// What the pattern's {} stand for in this path, or nothing when it does not match.
std::optional<std::vector<std::string>> match(std::string_view pattern,
                                              const std::vector<std::string>& path) {
    std::vector<std::string> arguments;
    pattern.remove_prefix(1);
    for (const std::string& segment : path) {
        if (pattern.empty()) return std::nullopt;
        const auto end = pattern.find('/');
        const std::string_view wanted = pattern.substr(0, end);
        pattern = end == pattern.npos ? std::string_view() : pattern.substr(end + 1);
        if (wanted == "{}") {
            arguments.push_back(segment);
        } else if (wanted != segment) {
            return std::nullopt;
        }
    }
    if (!pattern.empty()) return std::nullopt;
    return arguments;
}

struct Found {
    const Route* route = nullptr;
    std::vector<std::string> arguments;
    std::string allow;  ///< methods of the path; empty: no such path
};

void add_verb(std::string& allow, std::string_view verb) {
    if (allow.find(verb) != std::string::npos) return;
    if (!allow.empty()) allow += ", ";
    allow += verb == "GET" ? "GET, HEAD" : verb;
}

Found find_route(const HttpRequest& request, const std::vector<Route>& routes) {
    std::string_view verb = request.method;
    if (verb == "HEAD") verb = "GET";
    Found found;
    for (const Route& route : routes) {
        auto arguments = match(route.pattern, request.path);
        if (!arguments) continue;
        if (route.verb == verb) {
            found.route = &route;
            found.arguments = std::move(*arguments);
            return found;
        }
        add_verb(found.allow, route.verb);
    }
    return found;
}

Problem not_found(const Found& found) {
    if (found.allow.empty()) return problem(404, "there is nothing at this path");
    Problem made = problem(405, "this path understands " + found.allow);
    made.headers.emplace_back("Allow", found.allow);
    return made;
}

/// What the path can be asked; of the whole server, of each of its paths (RFC 9110 9.3.7).
HttpResponse options(const Found& found, const HttpRequest& request, const Site& site) {
    std::string allow = found.allow;
    if (request.path == std::vector<std::string>{"*"}) {
        for (const Route& route : site.routes) add_verb(allow, route.verb);
    }
    if (allow.empty()) return to_response(not_found(found));
    HttpResponse response;
    response.status = 204;
    response.headers.emplace_back("Allow", allow + ", OPTIONS");
    return response;
}

asio::awaitable<void> hold_up(Duration hold) {
    if (hold == Duration::zero()) co_return;
    asio::steady_timer timer(co_await asio::this_coro::executor, hold);
    boost::system::error_code ignored;
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
}

void judge_login(const HttpRequest& request, bool failed, Shared& shared) {
    const std::string& address = request.caller->address();
    if (!failed) return shared.logins.succeeded(address);
    ++shared.counters.login_failures;
    shared.logins.failed(shared.site->now(), address);
    rt::log(rt::LogLevel::warn, "login failed",
            {{"listener", shared.site->settings.name()}, {"client", address}});
}

/// Whoever has a token, but none for this; other refusals of tokens are failed logins.
void tell_refused(const HttpRequest& request, const Problem& why) {
    if (why.status != 403) return;
    std::string path;
    for (const std::string& segment : request.path) path += '/' + segment;
    log_client(*request.caller, "http request refused",
               {{"path", path}, {"method", request.method}, {"why", why.detail}});
}

/// check_access(), and what comes of a token.
asio::awaitable<std::optional<Problem>> admit(const HttpRequest* request, Role needed,
                                              Shared* shared) {
    const Settings& settings = shared->site->settings;
    if (needed == Role::none || !carries_token(*request))
        co_return check_access(*request, needed, settings);
    const std::string& address = request->caller->address();
    const Duration turn = shared->logins.turn(shared->site->now(), address);
    if (turn > Duration::zero()) shared->places.suspect(request->caller->id());
    asio::awaitable<void> waiting_for_turn = hold_up(turn);
    co_await std::move(waiting_for_turn);
    // Whoever hangs up is told nothing by that.
    if (request->caller->has_left()) co_return std::nullopt;
    shared->places.busy(request->caller->id());
    const auto refused = check_access(*request, needed, settings);
    // With a token, nothing but one that nobody has is a 401.
    const bool failed = refused && refused->status == 401;
    const Duration hold = shared->logins.hold(shared->site->now(), address);
    judge_login(*request, failed, *shared);
    if (failed && hold > Duration::zero()) {
        shared->places.wrong(request->caller->id());
        asio::awaitable<void> waiting = hold_up(hold);
        co_await std::move(waiting);
    }
    co_return refused;
}

}  // namespace

Handling dispatch(HttpRequest request, Shared* shared, std::optional<Problem> barred) {
    const std::shared_ptr<const Site> site = shared->site;
    Found found = find_route(request, site->routes);
    const bool probe = found.route != nullptr && found.route->probe;
    if (barred && !probe) {
        // At once, it would come again at once: that is no slower than to guess.
        Duration hold = Duration::zero();
        if (barred->status == 503 && request.caller)
            hold = shared->logins.hold(site->now(), request.caller->address());
        asio::awaitable<void> waiting = hold_up(hold);
        co_await std::move(waiting);
        co_return to_response(*barred);
    }
    if (request.method == "OPTIONS") co_return options(found, request, *site);
    if (found.route == nullptr) co_return to_response(not_found(found));
    const auto refused = co_await admit(&request, found.route->needed, shared);
    if (request.caller->has_left()) co_return HttpResponse();
    if (request.caller) request.caller->uses_token(token_name(request, site->settings));
    if (refused) {
        tell_refused(request, *refused);
        co_return to_response(*refused);
    }
    // Probes are answered whatever their makers add.
    auto mistaken = probe ? std::nullopt : check_queries(request, found.route->queries);
    if (!mistaken) mistaken = check_encoding(request);
    if (mistaken) co_return to_response(*mistaken);
    request.role = role_of(request, site->settings);
    request.arguments = std::move(found.arguments);
    Handling handling = found.route->handler(std::move(request));
    HttpResponse response = co_await std::move(handling);
    co_return response;
}

}  // namespace panelgate::web
