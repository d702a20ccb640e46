#include "key_book.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/web/http/query.hpp"

namespace panelgate::web {

namespace {

std::size_t size_of(const HttpResponse& answer) {
    std::size_t size = answer.body.size();
    for (const auto& [name, value] : answer.headers) size += name.size() + value.size();
    return size;
}

Problem full(Duration wait) {
    const std::int64_t seconds = std::chrono::ceil<std::chrono::seconds>(wait).count();
    return passing_problem(503,
                           "too many writes with an Idempotency-Key are remembered; send this "
                           "one later, or without a key",
                           std::max<std::int64_t>(seconds, 1));
}

Problem under_way() {
    return passing_problem(409, "the first request with this Idempotency-Key is still under way",
                           1);
}

}  // namespace

std::variant<KeyBook::Fresh, HttpResponse, Problem> KeyBook::begin(TimePoint now, const Key& key,
                                                                   std::uint64_t request,
                                                                   std::shared_ptr<Caller> worker) {
    forget_old(now);
    const auto known = entries_.find(key);
    if (known != entries_.end()) {
        if (known->second.request != request)
            return problem(422, "this Idempotency-Key was that of another request");
        if (known->second.worker) return under_way();
        return known->second.answer;
    }
    const auto count = of_client_.find(key.first);
    const std::size_t own = count == of_client_.end() ? 0 : count->second;
    if (entries_.size() >= settings_.max_keys || own >= settings_.max_keys_of_client ||
        bytes_ >= settings_.max_kept)
        return full(
            until_one_ends(now, own >= settings_.max_keys_of_client ? &key.first : nullptr));
    ++of_client_[key.first];
    entries_[key] = {request, std::move(worker)};
    return Fresh{};
}

void KeyBook::end(TimePoint now, const Key& key, const HttpResponse& answer) {
    const auto entry = entries_.find(key);
    if (entry == entries_.end()) return;
    entry->second.worker.reset();
    entry->second.answer = answer;
    bytes_ += size_of(answer);
    over_.emplace_back(now, key);
}

void KeyBook::drop(const Key& key) {
    const auto entry = entries_.find(key);
    if (entry != entries_.end()) erase(entry);
}

void KeyBook::dismiss() {
    std::vector<std::shared_ptr<Caller>> workers;
    for (const auto& [key, entry] : entries_)
        if (entry.worker) workers.push_back(entry.worker);
    for (const auto& worker : workers) worker->leave();
}

Duration KeyBook::until_one_ends(TimePoint now, const std::string* client) const {
    const auto first = std::ranges::find_if(over_, [&](const auto& entry) {
        return client == nullptr || entry.second.first == *client;
    });
    return first == over_.end() ? Duration::zero() : first->first + settings_.keys_kept - now;
}

void KeyBook::forget_old(TimePoint now) {
    while (!over_.empty() && now - over_.front().first >= settings_.keys_kept) {
        erase(entries_.find(over_.front().second));
        over_.pop_front();
    }
}

void KeyBook::erase(std::map<Key, Entry>::iterator entry) {
    bytes_ -= size_of(entry->second.answer);
    const auto count = of_client_.find(entry->first.first);
    if (--count->second == 0) of_client_.erase(count);
    entries_.erase(entry);
}

Duration Patience::left() const { return std::max(Duration::zero(), end_ - (*now_)()); }

}  // namespace panelgate::web
