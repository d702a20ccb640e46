#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// Writes with an Idempotency-Key, by client and key: the running ones, and for a time the answers
/// of finished ones that may have changed something, so that a repeated request does not write
/// again (P2). No entry is dropped before its time: a new request is refused when its client has
/// used up its share. One thread.
class KeyBook {
  public:
    using Key = std::pair<std::string, std::string>;  ///< client and key

    explicit KeyBook(const ApiSettings& settings) : settings_(settings) {}

    /// Registers a request, of which `request` is a hash: then it is to be carried out, and end()
    /// called. Or returns what is answered instead: the first request's answer, 422 for a different
    /// request with this key, 409 while the first one is running, 503 if its client has no room.
    /// `worker` asks the lines for the request.
    std::optional<HttpResponse> begin(TimePoint now, const Key& key, std::uint64_t request,
                                      std::shared_ptr<Caller> worker);
    /// Remembers the answer if the request may have had an effect; else the key may be used again.
    void end(const std::function<TimePoint()>& now, const Key& key, const HttpResponse& answer);
    /// Makes the workers of all running requests leave, which drops their work.
    void dismiss();

  private:
    struct Entry {
        std::uint64_t request = 0;
        WhoRef who{};
        std::shared_ptr<Caller> worker;  ///< null: finished
        HttpResponse answer{};
    };

    bool has_room_for(const Who& client) const;

    ApiSettings settings_;
    std::map<Key, Entry> entries_;
    std::deque<std::pair<TimePoint, Key>> over_;  ///< finished keys, ordered by end time
    std::size_t bytes_ = 0;                       ///< of the remembered bodies
};

/// Does the work of a write at most once: if its client has sent the Idempotency-Key
/// (draft-ietf-httpapi-idempotency-key-header) of this request before, the write is not repeated
/// and gets the first answer, even if the client had left by then.
Handling once(std::shared_ptr<KeyBook> book, HttpRequest request, std::function<TimePoint()> now,
              std::function<Handling(HttpRequest)> work);

}  // namespace panelgate::web
