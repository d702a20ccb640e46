#include "conduct.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "answer.hpp"
#include "key_book.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "routes.hpp"
#include "sight.hpp"

namespace panelgate::web {

/// The handler's answer, with a Panelgate-Transactions header if it asked lines: "17, 18", or
/// "floor1:17, floor2:3" for several lines.
Handling costed(HttpRequest request, const Api* api, Handler handler);

/// Handles a write at most once: if its client has sent this Idempotency-Key
/// (draft-ietf-httpapi-idempotency-key-header) before, the write is not repeated and gets the first
/// one's answer, even if the client had left by then. Only writes that may have changed something
/// are remembered.
Handling keyed(HttpRequest request, const Api* api, Handler handler);

namespace {

constexpr std::size_t kLongest = 4000;  ///< characters: clients accept headers of 8,192

std::string name_of(const void* line, const Directory& directory) {
    for (const LineEntry& entry : directory.lines) {
        if (entry.bus == line) return entry.name + ':';
    }
    return {};
}

bool of_one_line(const std::vector<Caller::Cost>& costs) {
    return std::ranges::all_of(
        costs, [&](const Caller::Cost& cost) { return cost.line == costs.front().line; });
}

/// A transaction that several parts of a request share is listed once.
std::string text_of(const std::vector<Caller::Cost>& costs, const Directory& directory) {
    const bool plain = of_one_line(costs);
    std::string text;
    for (auto cost = costs.begin(); cost != costs.end(); ++cost) {
        if (std::find(costs.begin(), cost, *cost) != cost) continue;
        const std::string one = (plain ? std::string() : name_of(cost->line, directory)) +
                                std::to_string(cost->transaction);
        if (text.size() + one.size() + 2 > kLongest) break;
        if (!text.empty()) text += ", ";
        text += one;
    }
    return text;
}

}  // namespace

Handling costed(HttpRequest request, const Api* api, Handler handler) {
    const std::shared_ptr<Caller> caller = request.caller;
    caller->take_costs();
    Handling work = handler(std::move(request), api);
    HttpResponse response = co_await std::move(work);
    if (caller->has_left()) co_return response;
    const std::vector<Caller::Cost> costs = caller->take_costs();
    if (!costs.empty())
        response.headers.emplace_back("Panelgate-Transactions", text_of(costs, *api->directory));
    co_return response;
}

namespace {

constexpr const char* kLost =
    "the gateway failed after something was sent: the outcome of the write is unknown";

/// The key without its quotes; a key without quotes means the same.
Parsed<std::string> key_of(std::string_view text, std::size_t most) {
    if (text.size() >= 2 && text.starts_with('"') && text.ends_with('"'))
        text = text.substr(1, text.size() - 2);
    const bool printable =
        std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~' && c != '"'; });
    if (!text.empty() && text.size() <= most && printable) return std::string(text);
    return problem(400, "an Idempotency-Key has 1 to " + std::to_string(most) +
                            " printable characters, no blanks");
}

std::string client_of(const Caller& caller) {
    return caller.token().empty() ? "address " + caller.address() : "token " + caller.token();
}

/// A hash of the request; two requests have the same with a probability of 1 in 2^64.
std::uint64_t number_of(const HttpRequest& request) {
    std::string text = request.method;
    for (const std::string& segment : request.path) text += '\n' + segment;
    for (const auto& [name, value] : request.query) text += '\n' + name + '=' + value;
    text += "\n\n" + request.body;
    return std::hash<std::string>{}(text);
}

/// Asks the lines on behalf of the client, which may leave: then requests that still wait are not
/// sent, and one that is on a wire is completed and remembered.
std::shared_ptr<Caller> worker_for(Caller& client) {
    auto worker = std::make_shared<Caller>(client.id(), client.address());
    worker->acts_for(client);
    return worker;
}

/// Ties a worker to its client for as long as the write runs.
class IdempotencyScope {
  public:
    IdempotencyScope(std::shared_ptr<Caller> client, std::shared_ptr<Caller> worker)
        : client_(std::move(client)), worker_(std::move(worker)) {
        client_->at_leaving(worker_.get(), [worker = worker_.get()] { worker->hang_up(); });
    }
    /// Lines know the client by its worker's name until the client leaves.
    ~IdempotencyScope() {
        client_->forget(worker_.get());
        if (!client_->has_left()) worker_->hand_over(*client_);
    }
    IdempotencyScope(const IdempotencyScope&) = delete;
    IdempotencyScope& operator=(const IdempotencyScope&) = delete;

  private:
    std::shared_ptr<Caller> client_;
    std::shared_ptr<Caller> worker_;
};

HttpResponse again(HttpResponse first) {
    first.headers.emplace_back("Idempotency-Replayed", "true");
    return first;
}

}  // namespace

Handling keyed(HttpRequest request, const Api* api, Handler handler) {
    const auto header = request.headers.find("idempotency-key");
    if (header == request.headers.end()) {
        Handling plain = costed(std::move(request), api, handler);
        co_return co_await std::move(plain);
    }
    const auto text = key_of(header->second, api->providers.settings.max_key);
    if (!text) co_return to_response(text.error());
    const KeyBook::Key key{client_of(*request.caller), *text};
    const auto worker = worker_for(*request.caller);
    const std::shared_ptr<KeyBook> book = api->keys;
    const auto now = api->providers.now;
    auto begun = book->begin(now(), key, number_of(request), worker);
    if (const auto* refused = std::get_if<Problem>(&begun)) co_return to_response(*refused);
    if (auto* first = std::get_if<HttpResponse>(&begun)) co_return again(std::move(*first));
    const IdempotencyScope scope(request.caller, worker);
    request.caller = worker;
    HttpResponse answer;
    try {
        Handling work = costed(std::move(request), api, handler);
        answer = co_await std::move(work);
    } catch (...) {
        if (worker->has_left() || !worker->has_effect()) {
            book->drop(key);
        } else {
            book->end(now(), key, to_response(problem(500, kLost)));
        }
        throw;
    }
    if (worker->has_left()) co_return answer;  // the server is gone, and perhaps its clock
    if (worker->has_effect()) {
        book->end(now(), key, answer);
    } else {
        book->drop(key);
    }
    co_return answer;
}

namespace {

std::string header(const HttpRequest& request, const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string() : found->second;
}

/// The end of the value of a member that ends in _ms, or of `time`; `at` if neither begins there.
std::size_t end_of_age(std::string_view body, std::size_t at) {
    constexpr std::string_view kAge = "_ms\":";
    constexpr std::string_view kTime = "\"time\":\"";
    if (body.substr(at).starts_with(kTime))
        return std::min(body.find('"', at + kTime.size()), body.size() - 1) + 1;
    if (!body.substr(at).starts_with(kAge)) return at;
    at += kAge.size();
    while (at < body.size() && body[at] != ',' && body[at] != '}') ++at;
    return at;
}

/// True if its body may be packed with gzip and is large enough.
bool is_packable(const HttpResponse& response, std::size_t from) {
    if (response.events || response.shared_body || response.status == 304) return false;
    for (const auto& [name, value] : response.headers)
        if (name == "Content-Encoding") return false;
    return response.body.size() >= from;
}

void set_tag(HttpResponse& response, const std::string& if_none_match) {
    if (add_etag(response, if_none_match, tag_of(response.body))) response.body.clear();
}

Handling handled(HttpRequest request, const Api* api, Handler handler, RoutePolicy policy) {
    if (policy.once) return keyed(std::move(request), api, handler);
    if (policy.asks) return costed(std::move(request), api, handler);
    return handler(std::move(request), api);
}

}  // namespace

std::string tag_of(std::string_view body) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (std::size_t at = 0; at < body.size();) {
        const std::size_t behind = end_of_age(body, at);
        if (behind != at) {
            at = behind;
            continue;
        }
        hash = (hash ^ static_cast<unsigned char>(body[at])) * 1099511628211u;
        ++at;
    }
    std::array<char, 32> text{};
    const int size = std::snprintf(text.data(), text.size(), "W/\"%016llx\"",
                                   static_cast<unsigned long long>(hash));
    return std::string(text.data(), static_cast<std::size_t>(size));
}

bool names_tag(std::string_view if_none_match, std::string_view tag) {
    constexpr std::string_view kWeak = "W/";
    if (if_none_match == "*") return true;
    tag.remove_prefix(kWeak.size());
    for (auto at = if_none_match.find(tag); at != if_none_match.npos;
         at = if_none_match.find(tag, at + 1)) {
        const std::string_view rest = if_none_match.substr(at + tag.size());
        if (rest.empty() || rest.front() == ',' || rest.front() == ' ') return true;
    }
    return false;
}

bool add_etag(HttpResponse& response, std::string_view if_none_match, const std::string& tag) {
    response.headers.emplace_back("ETag", tag);
    const bool known = names_tag(if_none_match, tag);
    if (known) response.status = 304;
    return known;
}

namespace {

/// True if it is no bus that found something wrong: that has judged who asks.
bool is_found_wrong_here(const HttpResponse& response) {
    const bool wrong = response.status >= 400 && response.status < 500 && response.status != 403;
    const bool asked = std::ranges::any_of(response.headers, [](const auto& header) {
        return header.first == "Panelgate-Transactions";
    });
    return wrong && !asked && response.body.find("\"modbus_exception\":") == std::string::npos;
}

}  // namespace

Handling conduct(HttpRequest request, const Api* api, Handler handler, RoutePolicy policy) {
    const std::shared_ptr<Caller> caller = request.caller;
    const std::size_t gzip_from = api->providers.settings.gzip_from;
    const bool takes_gzip = accepts_gzip(header(request, "accept-encoding"));
    const std::string if_none_match = header(request, "if-none-match");
    if (api->directory != nullptr) {
        if (const auto hidden = check_sight(request, *api->directory))
            co_return to_response(*hidden);
    }
    const std::vector<std::string> path = request.path;
    Handling work = handled(std::move(request), api, handler, policy);
    HttpResponse response = co_await std::move(work);
    if (caller->has_left()) co_return response;
    if (api->directory != nullptr && is_found_wrong_here(response)) {
        if (const auto hidden = instead_of_telling(path, caller->who(), *api->directory))
            co_return to_response(*hidden);
    }
    if (policy.tagged && response.status == 200) set_tag(response, if_none_match);
    if (!is_packable(response, gzip_from)) co_return response;
    add_vary(response, "Accept-Encoding");
    if (!takes_gzip) co_return response;
    response.made = response.body.size();
    boost::asio::awaitable<std::string> packing = packed(std::move(response.body));
    response.body = co_await std::move(packing);
    response.headers.emplace_back("Content-Encoding", "gzip");
    co_return response;
}

}  // namespace panelgate::web
