#include "once.hpp"

#include <algorithm>

#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

namespace {

/// A token and a certificate are clients of their own, from wherever they ask.
bool is_same_client(const Who& one, const Who& other) {
    const bool is_named = !one.token.empty() || !one.certificate.empty();
    return one.token == other.token && one.certificate == other.certificate &&
           (is_named || one.host == other.host);
}

}  // namespace

/// What a client has leaves three times as much free, so that no few clients fill the book.
bool KeyBook::has_room_for(const Who& client) const {
    constexpr std::size_t kLeft = 3;
    std::size_t own = 0;
    std::size_t own_bytes = 0;
    for (const auto& [key, entry] : entries_) {
        if (!is_same_client(*entry.who, client)) continue;
        ++own;
        own_bytes += entry.answer.body.size();
    }
    return kLeft * own + entries_.size() < settings_.max_keys &&
           kLeft * own_bytes + bytes_ < settings_.max_kept;
}

std::optional<HttpResponse> KeyBook::begin(TimePoint now, const Key& key, std::uint64_t request,
                                           std::shared_ptr<Caller> worker) {
    for (; !over_.empty() && now - over_.front().first >= settings_.keys_kept; over_.pop_front()) {
        const auto old = entries_.find(over_.front().second);
        bytes_ -= old->second.answer.body.size();
        entries_.erase(old);
    }
    const auto known = entries_.find(key);
    if (known != entries_.end()) {
        if (known->second.request != request)
            return to_response(problem(422, "this Idempotency-Key was that of another request"));
        if (known->second.worker)
            return to_response(passing_problem(
                409, "the first request with this Idempotency-Key is still under way", 1));
        HttpResponse again = known->second.answer;
        again.headers.emplace_back("Idempotency-Replayed", "true");
        return again;
    }
    const WhoRef who = worker->who();
    if (!has_room_for(*who))
        return to_response(passing_problem(503,
                                           "too many writes with an Idempotency-Key are "
                                           "remembered; send this one later, or without a key",
                                           60));
    entries_[key] = {request, who, std::move(worker)};
    return std::nullopt;
}

void KeyBook::end(const std::function<TimePoint()>& now, const Key& key,
                  const HttpResponse& answer) {
    const auto entry = entries_.find(key);
    const auto worker = std::move(entry->second.worker);
    // When the worker has left, the server is gone, and perhaps its clock.
    if (worker->has_left() || !worker->has_effect()) {
        entries_.erase(entry);
        return;
    }
    entry->second.answer = answer;
    bytes_ += answer.body.size();
    over_.emplace_back(now(), key);
}

void KeyBook::dismiss() {
    std::vector<std::shared_ptr<Caller>> workers;
    for (const auto& [key, entry] : entries_)
        if (entry.worker) workers.push_back(entry.worker);
    for (const auto& worker : workers) worker->leave();
}

namespace {

constexpr const char* kLost =
    "the gateway failed after something was sent: the outcome of the write is unknown";

/// The key without its quotes; a key without quotes means the same.
Parsed<std::string> key_of(std::string_view text) {
    constexpr std::size_t kMost = 255;
    if (text.size() >= 2 && text.starts_with('"') && text.ends_with('"'))
        text = text.substr(1, text.size() - 2);
    const bool printable =
        std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~' && c != '"'; });
    if (!text.empty() && text.size() <= kMost && printable) return std::string(text);
    return problem(400, "an Idempotency-Key has 1 to " + std::to_string(kMost) +
                            " printable characters, no blanks");
}

/// The client that a key belongs to.
std::string name_of(const Who& client) {
    if (!client.token.empty()) return "token " + client.token;
    if (!client.certificate.empty()) return "certificate " + client.certificate;
    return "address " + client.address;
}

/// A hash of the request; two requests have the same with a probability of 1 in 2^64.
std::uint64_t number_of(const HttpRequest& request) {
    std::string text = request.method;
    for (const std::string& segment : request.path) text += '\n' + segment;
    for (const auto& [name, value] : request.query) text += '\n' + name + '=' + value;
    text += "\n\n" + request.body;
    return std::hash<std::string>{}(text);
}

/// Asks the lines on behalf of the client for as long as the write runs. The client may leave: then
/// requests that still wait are not sent, and one that is on a wire is completed and remembered.
class WorkerScope {
  public:
    explicit WorkerScope(std::shared_ptr<Caller> client)
        : worker(std::make_shared<Caller>(client->id(), client->address())),
          client_(std::move(client)) {
        worker->acts_for(*client_);
        client_->at_leaving(worker.get(), [one = worker.get()] { one->hang_up(); });
    }
    /// Lines know the client by its worker's name until the client leaves.
    ~WorkerScope() {
        client_->forget(worker.get());
        if (!client_->has_left()) worker->hand_over(*client_);
    }
    WorkerScope(const WorkerScope&) = delete;
    WorkerScope& operator=(const WorkerScope&) = delete;

    const std::shared_ptr<Caller> worker;

  private:
    std::shared_ptr<Caller> client_;
};

}  // namespace

Handling once(std::shared_ptr<KeyBook> book, HttpRequest request, std::function<TimePoint()> now,
              std::function<Handling(HttpRequest)> work) {
    const auto header = request.headers.find("idempotency-key");
    if (header == request.headers.end()) {
        Handling plain = work(std::move(request));
        co_return co_await std::move(plain);
    }
    const auto text = key_of(header->second);
    if (!text) co_return to_response(text.error());
    const KeyBook::Key key{name_of(*request.caller->who()), *text};
    const WorkerScope scope(request.caller);
    const auto known = book->begin(now(), key, number_of(request), scope.worker);
    if (known) co_return *known;
    request.caller = scope.worker;
    HttpResponse answer;
    try {
        Handling working = work(std::move(request));
        answer = co_await std::move(working);
    } catch (...) {
        book->end(now, key, to_response(problem(500, kLost)));
        throw;
    }
    book->end(now, key, answer);
    co_return answer;
}

}  // namespace panelgate::web
