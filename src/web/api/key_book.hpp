#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "panelgate/base/time.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Writes with an Idempotency-Key, by client and key: the running ones, and for a time the results
/// of finished ones, so that a repeated request does not write again (P2). No entry is dropped
/// before its time: a new request is refused when there is no room. Pure; one thread.
class KeyBook {
  public:
    using Key = std::pair<std::string, std::string>;  ///< client and key
    struct Fresh {};

    explicit KeyBook(const ApiSettings& settings) : settings_(settings) {}

    /// Registers a request. Returns Fresh: carry it out, then call end() or drop(); the first
    /// request's answer; or a problem: 422 for a different request with this key, 409 while the
    /// first is running, 503 if there is no room. `request` is a hash of the request. `worker` asks
    /// the lines for it.
    std::variant<Fresh, HttpResponse, Problem> begin(TimePoint now, const Key& key,
                                                     std::uint64_t request,
                                                     std::shared_ptr<Caller> worker);
    /// Stores the answer of a finished request.
    void end(TimePoint now, const Key& key, const HttpResponse& answer);
    /// Forgets a request that has had no effect: it may be tried again.
    void drop(const Key& key);
    /// Makes the workers of all running requests leave, which drops their work.
    void dismiss();

    std::size_t size() const { return entries_.size(); }

  private:
    struct Entry {
        std::uint64_t request = 0;
        std::shared_ptr<Caller> worker;  ///< null: finished
        HttpResponse answer{};
    };

    /// Time until the first entry of a client (null: of any client) expires; zero if none is
    /// finished.
    Duration until_one_ends(TimePoint now, const std::string* client) const;
    void forget_old(TimePoint now);
    void erase(std::map<Key, Entry>::iterator entry);

    ApiSettings settings_;
    std::map<Key, Entry> entries_;
    std::map<std::string, std::size_t> of_client_;
    std::deque<std::pair<TimePoint, Key>> over_;  ///< finished keys, ordered by end time
    std::size_t bytes_ = 0;                       ///< of the answers
};

/// The time limit of a request over all its transactions: the deadline of its line (P3).
class Patience {
  public:
    /// `now` must outlive it.
    Patience(Duration deadline, const std::function<TimePoint()>& now)
        : now_(&now), end_(now() + deadline) {}

    /// Time left; zero if it is over.
    Duration left() const;

  private:
    const std::function<TimePoint()>* now_;
    TimePoint end_;
};

}  // namespace panelgate::web
