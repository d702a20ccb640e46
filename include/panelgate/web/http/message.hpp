#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/web/http/caller.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// A request as handlers see it; nothing of Beast.
struct HttpRequest {
    std::string method;
    std::string host;                               ///< lower case; empty: HTTP/1.0 without one
    std::string port;                               ///< of the Host; empty where it names none
    std::vector<std::string> path;                  ///< segments, percent-decoded
    std::multimap<std::string, std::string> query;  ///< decoded, repetitions included
    std::map<std::string, std::string> headers;     ///< those that are read, names in lower case
    std::string body;
    std::vector<std::string> arguments;  ///< what the route's {} stood for
    std::shared_ptr<Caller> caller;
    Role role = Role::none;  ///< of whoever asks
};
/// The request headers that anything here looks at; each may come once.
inline constexpr const char* kHeadersRead[] = {
    "authorization",  "origin",         "content-type",    "content-encoding", "sec-fetch-site",
    "sec-fetch-mode", "sec-fetch-dest", "idempotency-key", "last-event-id"};
/// … and those that are lists: of several fields the values follow each other (RFC 9110 5.3).
inline constexpr const char* kListsRead[] = {"accept", "accept-encoding", "if-none-match",
                                             "prefer"};

/// A body that several are sent, so that it is in memory once.
using SharedText = std::shared_ptr<const std::string>;

struct HttpResponse {
    unsigned status = 200;
    std::string content_type = "application/json";
    std::string body;
    SharedText shared_body;  ///< not null: sent in place of `body`
    std::size_t made = 0;    ///< bytes that were packed to make it
    bool probe = false;      ///< of the program's health: waits for nothing
    std::vector<std::pair<std::string, std::string>> headers;  ///< further ones
    /// Not null: there is no body, events follow for as long as the client listens.
    std::shared_ptr<EventHub::Listener> events;
};

}  // namespace panelgate::web
