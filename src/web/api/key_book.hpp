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
#include "panelgate/web/api/settings.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// Writes that carry an Idempotency-Key, by client and key: those under way, and for a time what
/// became of the others, so that a request that is sent again changes nothing again (P2). Nothing
/// is forgotten before its time: who has no more room is refused. Pure; one thread.
class KeyBook {
  public:
    using Key = std::pair<std::string, std::string>;  ///< the client, and what it said
    struct Fresh {};

    explicit KeyBook(const ApiSettings& settings) : settings_(settings) {}

    /// To be carried out (then end() or drop() follows), the answer that the first one got, or why
    /// neither: 422 for another request with this key, 409 while the first is under way, 503.
    /// `request` tells requests apart. `worker` asks the lines for it.
    std::variant<Fresh, HttpResponse, Problem> begin(TimePoint now, const Key& key,
                                                     std::uint64_t request,
                                                     std::shared_ptr<Caller> worker);
    /// This is what came of it.
    void end(TimePoint now, const Key& key, const HttpResponse& answer);
    /// Nothing came of it: it may be tried again.
    void drop(const Key& key);
    /// Whoever works for one that is under way leaves: what it works on goes away.
    void dismiss();

    std::size_t size() const { return entries_.size(); }

  private:
    struct Entry {
        std::uint64_t request = 0;
        std::shared_ptr<Caller> worker;  ///< null: it is over
        HttpResponse answer{};
    };

    /// Of one client, or, null, of any. None is over: no time.
    Duration until_one_ends(TimePoint now, const std::string* client) const;
    void forget_old(TimePoint now);
    void erase(std::map<Key, Entry>::iterator entry);

    ApiSettings settings_;
    std::map<Key, Entry> entries_;
    std::map<std::string, std::size_t> of_client_;
    std::deque<std::pair<TimePoint, Key>> over_;  ///< by when they ended
    std::size_t bytes_ = 0;                       ///< of the answers
};

/// N of "Prefer: wait=N" (RFC 7240 4.3): a whole number of seconds. Nothing for anything else,
/// which is no error there.
std::optional<Duration> wait_of(std::string_view prefer);
/// The same of a request's header.
std::optional<Duration> wait_of(const HttpRequest& request);

/// Until when a request is to be answered, however many transactions it takes: by its line's
/// deadline, or when its client stops waiting, where that is sooner (P3).
class Patience {
  public:
    /// `now` is called whenever it is asked.
    Patience(const HttpRequest& request, Duration deadline, const std::function<TimePoint()>& now);

    /// Zero when the time is over.
    Duration left() const;

  private:
    const std::function<TimePoint()>* now_;
    TimePoint end_;
};

}  // namespace panelgate::web
