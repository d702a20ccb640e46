#include "router.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/sha256.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/crossing.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

namespace {

constexpr std::string_view kHashOf = "sha256:";

/// Takes "18:30:00" off; nullopt if it is none.
std::optional<std::chrono::seconds> take_clock(std::string_view& text) {
    constexpr std::array<int, 3> kMost{23, 59, 59};
    std::chrono::seconds seconds{};
    for (std::size_t i = 0; i < kMost.size(); ++i) {
        if (i > 0 && !text.starts_with(':')) return std::nullopt;
        if (i > 0) text.remove_prefix(1);
        const auto number = take_number(text, 2);
        if (!number || *number > kMost[i]) return std::nullopt;
        seconds = seconds * 60 + std::chrono::seconds(*number);
    }
    return seconds;
}

}  // namespace

std::string hash_of(std::string_view token) {
    thread_local Sha256 sha256;
    return std::string(kHashOf) + std::string(text_of(sha256.of(token)));
}

bool is_token_hash(std::string_view text) {
    if (!text.starts_with(kHashOf)) return false;
    text.remove_prefix(kHashOf.size());
    return text.size() == HexDigest().size() && std::ranges::all_of(text, [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

std::optional<WallTime> parse_expiry(std::string_view text) {
    const auto day = take_day(text);
    if (!day) return std::nullopt;
    if (text.empty()) return WallTime(*day + std::chrono::days(1));
    if (!text.starts_with('T')) return std::nullopt;
    text.remove_prefix(1);
    const auto time = take_clock(text);
    if (!time || text != "Z") return std::nullopt;
    return WallTime(*day + *time);
}

std::string expiry_text(WallTime expires) {
    using namespace std::chrono;
    const auto day = floor<days>(expires);
    if (expires == day) return rfc3339(day - days(1)).substr(0, 10);
    return rfc3339(expires).substr(0, 19) + 'Z';
}

namespace {

/// Compares in a time independent of where the hashes differ.
bool same_hash(std::string_view given, std::string_view known) {
    if (given.size() != known.size()) return false;  // all have one length
    unsigned difference = 0;
    for (std::size_t i = 0; i < given.size(); ++i)
        difference |= static_cast<unsigned char>(given[i] ^ known[i]);
    return difference == 0;
}

/// Returns the token after "Bearer" and blanks (RFC 9110 11.4; schemes are case-insensitive, 11.1).
std::optional<std::string_view> bearer_token(std::string_view authorization) {
    constexpr std::string_view kScheme = "bearer ";
    if (to_lower(authorization.substr(0, kScheme.size())) != kScheme) return std::nullopt;
    authorization.remove_prefix(kScheme.size());
    while (authorization.starts_with(' ')) authorization.remove_prefix(1);
    return authorization;
}

/// Returns the request's token, null if unknown. Always compares all tokens.
const Token* token_of(const HttpRequest& request, const Settings& settings) {
    const auto given = bearer_token(header(request, "authorization"));
    if (!given) return nullptr;
    const std::string hash = hash_of(*given);
    const Token* found = nullptr;
    for (const Token& known : settings.tokens) {
        if (same_hash(hash, known.hash)) found = &known;
    }
    return found;
}

/// The same; null too if it has expired.
const Token* valid_token_of(const HttpRequest& request, const Settings& settings) {
    const Token* token = token_of(request, settings);
    return token == nullptr || token->has_expired(request.at) ? nullptr : token;
}

Problem unauthorized(std::string detail) {
    Problem made = problem(401, std::move(detail));
    made.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"panelgate\"");
    return made;
}

/// True for a type that no form can send. Media types are case-insensitive (RFC 9110 8.3.1).
bool is_of_script(std::string_view content_type) {
    std::string_view type = content_type.substr(0, content_type.find(';'));
    while (type.ends_with(' ') || type.ends_with('\t')) type.remove_suffix(1);
    return to_lower(type) == "application/json" || to_lower(type) == "text/yaml";
}

/// True for what a form of any site could send. Forms have no DELETE.
bool is_foreign_form(const HttpRequest& request) {
    if (request.method == "GET" || request.method == "HEAD" || request.method == "DELETE")
        return false;
    return !header(request, "origin").empty() && !is_of_script(header(request, "content-type"));
}

/// A default role has the rights of the least role that is needed; a role of the configuration has
/// the rights that its list names.
bool suffices(const Standing& standing, Role needed, Right right, std::optional<Right> or_right) {
    if (!standing.own) return standing.role >= needed;
    return standing.may(right) || (or_right && standing.may(*or_right));
}

Problem insufficient(const Standing& standing, Role needed, Right right) {
    if (!standing.own) return problem(403, "this needs the role " + std::string(label(needed)));
    return problem(403, "this needs the right " + std::string(label(right)) + ", which the role '" +
                            standing.own->name + "' does not have");
}

/// Of a client's certificate.
Problem insufficient(const Standing& certified, const std::string& word, Role needed) {
    return problem(403, "this needs the role " + std::string(label(needed)) +
                            ", and the client's certificate has " + word +
                            (certified.role == Role::none ? ", which no role here is called" : ""));
}

/// By its certificate, where the listener goes by that.
std::optional<Standing> certified_standing(const HttpRequest& request) {
    return request.caller ? request.caller->certificate_role() : std::nullopt;
}

}  // namespace

std::optional<Problem> check_access(const HttpRequest& request, Role needed,
                                    const Settings& settings, Right right,
                                    std::optional<Right> or_right) {
    if (needed == Role::none) return std::nullopt;
    if (is_foreign_form(request)) return problem(415, "send the body as application/json");
    if (header(request, "authorization").empty()) {
        const Standing standing = standing_of(request, settings);
        if (suffices(standing, needed, right, or_right)) return std::nullopt;
        // Who has shown a role is known: another role would help.
        const auto certified = certified_standing(request);
        if (certified && certified->own) return insufficient(standing, needed, right);
        if (certified && !request.caller->who()->certificate_role.empty())
            return insufficient(*certified, request.caller->who()->certificate_role, needed);
        return unauthorized("this needs a token");
    }
    // Do not echo the value: without a scheme it may be the token.
    if (!carries_token(request))
        return unauthorized("this gateway knows tokens only; send 'Authorization: Bearer TOKEN'");
    const Token* token = token_of(request, settings);
    if (token == nullptr) return unauthorized("this token is not known");
    if (token->has_expired(request.at))
        return unauthorized("this token has expired, on " + rfc3339(*token->expires));
    if (!suffices(token->standing, needed, right, or_right))
        return insufficient(token->standing, needed, right);
    return std::nullopt;
}

bool carries_token(const HttpRequest& request) {
    return bearer_token(header(request, "authorization")).has_value();
}

std::optional<Problem> check_encoding(const HttpRequest& request) {
    const std::string_view coding = header(request, "content-encoding");
    if (request.body.empty() || coding.empty() || to_lower(coding) == "identity")
        return std::nullopt;
    Problem made = problem(415, "send the body as it is, without a Content-Encoding");
    made.headers.emplace_back("Accept-Encoding", "identity");  // RFC 9110 15.5.16
    return made;
}

Standing standing_of(const HttpRequest& request, const Settings& settings) {
    if (header(request, "authorization").empty()) {
        const auto certified = certified_standing(request);
        if (!certified) return settings.anonymous;
        if (certified->own || certified->role != Role::none) return *certified;
        return only_reading(settings.anonymous);
    }
    const Token* token = valid_token_of(request, settings);
    return token == nullptr ? Standing{} : token->standing;
}

std::string token_name(const HttpRequest& request, const Settings& settings) {
    const Token* token = valid_token_of(request, settings);
    return token == nullptr ? std::string() : token->name;
}

Duration time_of_token(const std::string& name, const Site& site, Duration most) {
    const auto token = std::ranges::find(site.settings.tokens, name, &Token::name);
    if (token == site.settings.tokens.end() || !token->expires || !site.wall) return most;
    const std::chrono::microseconds left = *token->expires - site.wall();  // may be years
    if (left >= std::chrono::ceil<std::chrono::microseconds>(most)) return most;
    return std::max(Duration(left), Duration::zero());
}

namespace {

/// Returns the segments matched by the pattern's {}; nullopt if the path does not match.
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
    std::string allow;  ///< methods of the path; empty: unknown path
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

/// Answers OPTIONS for a path, or for the whole server with all its paths' methods (RFC 9110
/// 9.3.7).
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

void record_failed_login(const HttpRequest& request, Shared& shared) {
    ++shared.counters.login_failures;
    shared.wrong_tokens.add(shared.site->now(), request.caller->host());
    rt::log(rt::LogLevel::warn, "login failed",
            {{"listener", shared.site->settings.name()}, {"client", request.caller->address()}});
}

/// When each token was used last, for metrics; those that are gone are forgotten.
void record_use(const Caller& caller, Shared& shared) {
    if (caller.token().empty() || !shared.site->wall) return;
    auto& uses = shared.counters.token_uses;
    uses[caller.token()] = wall_seconds_of(shared.site->wall());
    if (uses.size() <= shared.site->settings.tokens.size()) return;
    std::erase_if(uses, [&](const auto& use) {
        return std::ranges::find(shared.site->settings.tokens, use.first, &Token::name) ==
               shared.site->settings.tokens.end();
    });
}

std::string path_of(const HttpRequest& request) {
    std::string path;
    for (const std::string& segment : request.path) path += '/' + segment;
    return path;
}

/// Logs a token or a certificate with insufficient rights; unknown tokens are logged as failed
/// logins.
void count_refused(const HttpRequest& request, const Problem& why) {
    const bool by_certificate =
        why.status == 401 && !carries_token(request) && !request.caller->who()->certificate.empty();
    if (why.status != 403 && !by_certificate) return;
    log_client(*request.caller, "http request refused",
               {{"path", path_of(request)}, {"method", request.method}, {"why", why.detail}});
}

/// 429 while no token of the request's address is judged.
std::optional<Problem> too_many_wrong_tokens(const HttpRequest& request, const Shared& shared) {
    const Duration left =
        shared.wrong_tokens.barred_for(shared.site->now(), request.caller->host());
    if (left == Duration::zero()) return std::nullopt;
    const auto seconds = std::chrono::ceil<std::chrono::seconds>(left).count();
    return passing_problem(429, "too many wrong tokens came from this address", seconds);
}

/// check_access() with the limit of wrong tokens.
std::optional<Problem> admit(const HttpRequest& request, const Route& route, Shared& shared) {
    const bool shows_token = route.needed != Role::none && carries_token(request);
    auto barred = shows_token ? too_many_wrong_tokens(request, shared) : std::nullopt;
    if (barred) return barred;
    auto refused =
        check_access(request, route.needed, shared.site->settings, route.right, route.or_right);
    // With a token, only an unknown one gives 401.
    if (!shows_token || !refused || refused->status != 401) return refused;
    record_failed_login(request, shared);
    barred = too_many_wrong_tokens(request, shared);
    return barred ? barred : refused;
}

/// Who makes the request, by what it has shown.
void identify(HttpRequest& request, const Site& site) {
    Standing standing = standing_of(request, site.settings);
    request.role = standing.role;
    request.caller->identify(token_name(request, site.settings), std::move(standing),
                             site.settings.name());
}

/// What an audit needs of a request that its handler takes away. Records in the plant's loop.
class Witness {
  public:
    using Record = std::function<void(const Deed&)>;

    /// `told`: recorded whatever it does.
    Witness(const HttpRequest& request, Record record, bool told = false)
        : record_(std::move(record)),
          changes_(told || (request.method != "GET" && request.method != "HEAD")),
          who_(request.caller->who()) {
        if (!record_) return;
        method_ = request.method;
        path_ = path_of(request);
        if (changes_) body_ = request.body.substr(0, Deed::kMostOfBody);
        shown_token_ = carries_token(request);
    }
    /// Refusals are recorded whatever was asked for.
    void record(const HttpResponse& response) const {
        const bool is_refusal =
            response.status == 401 || response.status == 403 || response.status == 429;
        if (!record_ || (!changes_ && !is_refusal)) return;
        record_({who_, method_, path_, body_, response.status, response.body, shown_token_});
    }

  private:
    Record record_;
    bool changes_;
    WhoRef who_;
    std::string method_;
    std::string path_;
    std::string body_;
    bool shown_token_ = false;
};

/// Carries out a request, and records what it has changed. Of the plant's loop.
Handling witnessed(HttpRequest request, Crossing::Handler handler, Witness::Record record,
                   bool told) {
    const Witness witness(request, std::move(record), told);
    Handling handling = handler(std::move(request));
    HttpResponse response = co_await std::move(handling);
    witness.record(response);
    co_return response;
}

/// Takes what the faces have counted along to the plant, which answers a scrape.
void take_figures(const std::shared_ptr<const Site>& site, const Shared& shared) {
    if (site->keep_figures && shared.figures)
        site->crossing->tell([site, figures = shared.figures()] { site->keep_figures(figures); });
    auto others = site->collect ? site->collect() : nullptr;
    if (others) site->crossing->tell(std::move(others));
}

/// Carries out a request where its handler belongs.
Handling carry_out(HttpRequest request, const Route* route, Shared* shared) {
    const std::shared_ptr<const Site> site = shared->site;
    if (route->face || !site->crossing)
        return witnessed(std::move(request), route->handler, site->record, route->configures);
    if (route->figures) take_figures(site, *shared);
    return site->crossing->ask(
        std::move(request),
        [handler = route->handler, record = site->record, told = route->configures](
            HttpRequest asked) { return witnessed(std::move(asked), handler, record, told); },
        route->probe);
}

/// Records a refusal of the faces.
void record_refusal(const HttpRequest& request, const HttpResponse& response, const Site& site) {
    Witness witness(request, site.record);
    if (!site.crossing) return witness.record(response);
    if (!site.record) return;
    HttpResponse told;
    told.status = response.status;
    told.body = response.body;
    site.crossing->tell(
        [witness = std::move(witness), told = std::move(told)] { witness.record(told); });
}

}  // namespace

std::size_t longest_body(HttpRequest head, Shared& shared) {
    const Route* route = find_route(head, shared.site->routes).route;
    if (shared.site->wall) head.at = shared.site->wall();
    const bool may = route != nullptr && route->configures && !admit(head, *route, shared);
    return may ? kLongBody : shared.site->settings.max_body;
}

Handling dispatch(HttpRequest request, Shared* shared, std::optional<Problem> barred) {
    const std::shared_ptr<const Site> site = shared->site;
    Found found = find_route(request, site->routes);
    const bool probe = found.route != nullptr && found.route->probe;
    if (barred && !probe) co_return to_response(*barred);
    if (request.method == "OPTIONS") co_return options(found, request, *site);
    if (found.route == nullptr) co_return to_response(not_found(found));
    if (site->wall) request.at = site->wall();
    const auto refused = admit(request, *found.route, *shared);
    identify(request, *site);
    record_use(*request.caller, *shared);
    if (refused) {
        count_refused(request, *refused);
        HttpResponse response = to_response(*refused);
        record_refusal(request, response, *site);
        co_return response;
    }
    // Probes are answered with any query.
    auto mistaken = probe ? std::nullopt : check_queries(request, found.route->queries);
    if (!mistaken) mistaken = check_encoding(request);
    if (mistaken) co_return to_response(*mistaken);
    request.arguments = std::move(found.arguments);
    const std::shared_ptr<Caller> caller = request.caller;
    Handling handling = carry_out(std::move(request), found.route, shared);
    HttpResponse response = co_await std::move(handling);
    const auto finish = std::exchange(response.finish, nullptr);
    if (finish && response.is_long && shared->site->crossing) {
        if (!shared->worker)
            shared->worker =
                std::make_unique<rt::Worker>(co_await boost::asio::this_coro::executor);
        Handling making = shared->site->crossing->made_by_worker(std::move(response), finish,
                                                                 caller, shared->worker.get());
        co_return co_await std::move(making);
    }
    if (finish) finish(response);
    co_return response;
}

}  // namespace panelgate::web
