#include "keyed.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "costs.hpp"
#include "key_book.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {
namespace {

constexpr const char* kLost =
    "the gateway failed after something was sent: what came of the write is not known";

/// The text within its quotes, where it has some: a client that leaves them out means the same.
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

/// Another request has another number, but for one in 2^64.
std::uint64_t number_of(const HttpRequest& request) {
    std::string text = request.method;
    for (const std::string& segment : request.path) text += '\n' + segment;
    for (const auto& [name, value] : request.query) text += '\n' + name + '=' + value;
    text += "\n\n" + request.body;
    return std::hash<std::string>{}(text);
}

/// Asks the lines in place of the client, who may leave: then what still waits is not sent, and
/// what is on a wire comes to its end and is remembered.
std::shared_ptr<Caller> worker_for(Caller& client) {
    auto worker = std::make_shared<Caller>(client.id(), client.address());
    worker->uses_token(client.token());
    return worker;
}

/// For as long as somebody works for the client.
class Employment {
  public:
    Employment(std::shared_ptr<Caller> client, std::shared_ptr<Caller> worker)
        : client_(std::move(client)), worker_(std::move(worker)) {
        client_->at_leaving(worker_.get(), [worker = worker_.get()] { worker->hang_up(); });
    }
    /// Lines know the client by its worker's name until it leaves.
    ~Employment() {
        client_->forget(worker_.get());
        if (!client_->has_left()) worker_->hand_over(*client_);
    }
    Employment(const Employment&) = delete;
    Employment& operator=(const Employment&) = delete;

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
    const Employment employment(request.caller, worker);
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
    if (worker->has_left()) co_return answer;  // the server has ended, and its clock may have
    if (worker->has_effect()) {
        book->end(now(), key, answer);
    } else {
        book->drop(key);
    }
    co_return answer;
}

}  // namespace panelgate::web
