#pragma once

#include <boost/asio/awaitable.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Who asks over one connection. Shared by the session and by what works for it; one thread.
class Caller {
  public:
    /// `id` is of this connection alone; `address` has no port, "" when it is not known.
    Caller(std::uint64_t id, std::string address) : id_(id), address_(std::move(address)) {}

    std::uint64_t id() const { return id_; }
    const std::string& address() const { return address_; }
    /// What people are told of it: "http 10.0.0.9", "http 10.0.0.9 token ops".
    std::string name() const {
        std::string text = "http";
        if (!address_.empty()) text += ' ' + address_;
        if (!token_.empty()) text += " token " + token_;
        return text;
    }
    /// The name of the token that its request of now carries; "" for none.
    void uses_token(std::string token) { token_ = std::move(token); }
    const std::string& token() const { return token_; }
    /// The connection is over: nobody waits for an answer, and what the site is made of may be
    /// gone.
    bool has_left() const { return left_; }
    /// What is called once when the connection is over. Of several for one `whom` the first counts;
    /// was this the first? Nothing may be asked of a caller that has left.
    bool at_leaving(const void* whom, std::function<void()> farewell) {
        return farewells_.emplace(whom, std::move(farewell)).second;
    }
    void forget(const void* whom) { farewells_.erase(whom); }
    /// Whoever is to be told when this one leaves is told when the other one does.
    void hand_over(Caller& to) { to.farewells_.merge(farewells_); }
    void leave() {
        left_ = true;
        hang_up();
    }
    /// Nobody waits for an answer, but what has begun is still wanted to its end: nothing that has
    /// not yet begun is.
    void hang_up() {
        hung_up_ = true;
        for (const auto& [whom, farewell] : std::exchange(farewells_, {})) farewell();
    }
    bool has_hung_up() const { return hung_up_; }
    /// Something came, or may have come, of what it asked for: asked again, it could come twice.
    void take_effect() { has_effect_ = true; }
    bool has_effect() const { return has_effect_; }
    /// A transaction was made for its request of now, by this line. Bounded: the first kMostCosts
    /// are known.
    struct Cost {
        const void* line = nullptr;
        std::uint64_t transaction = 0;
        friend bool operator==(const Cost&, const Cost&) = default;
    };
    static constexpr std::size_t kMostCosts = 1000;
    void add_cost(const Cost& cost) {
        if (costs_.size() < kMostCosts) costs_.push_back(cost);
    }
    /// Of its request of now, in their order; the next one begins with none.
    std::vector<Cost> take_costs() { return std::exchange(costs_, {}); }

  private:
    std::uint64_t id_;
    std::string address_;
    std::string token_;
    bool left_ = false;
    bool hung_up_ = false;
    bool has_effect_ = false;
    std::vector<Cost> costs_;
    std::map<const void*, std::function<void()>> farewells_;
};

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

using Handling = boost::asio::awaitable<HttpResponse>;

/// A path, what may be done there, by whom, and who does it.
struct Route {
    std::string_view verb;     ///< "GET" stands for HEAD, too
    std::string_view pattern;  ///< {} stands for any one segment
    Role needed = Role::none;  ///< none: free to all who may connect and call us by our name
    std::function<Handling(HttpRequest)> handler;
    std::vector<std::string_view> queries{};  ///< that it understands; any other is refused
    bool probe = false;  ///< answered to any name, with any query, and when all else is barred
};

/// What a server serves. Shared by its sessions; the first route that fits is taken.
struct Site {
    Settings settings;
    std::string product;  ///< of the header Server: "name/1.2.3"
    std::vector<Route> routes;
    std::function<std::uint64_t()> next_caller;  ///< numbers connections
    std::function<TimePoint()> now;              ///< needed where a route is not free
};

/// One line of the log at info about what a client did or was refused: its name (address, token)
/// first, as `client`. Texts of the client are cut where they are long.
void log_client(const Caller& caller, std::string_view event,
                std::initializer_list<std::pair<std::string_view, std::string>> fields);

}  // namespace panelgate::web
