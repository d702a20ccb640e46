#pragma once

#include <boost/asio/awaitable.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// The client of one connection, or of one request at the plant. Belongs to one loop.
class Caller {
  public:
    /// `id` is unique to this connection; `address` has no port, "" if unknown.
    Caller(std::uint64_t id, std::string address)
        : id_(id), address_(std::move(address)), host_(address_) {
        identify({}, {}, {});
    }

    std::uint64_t id() const { return id_; }
    const std::string& address() const { return address_; }
    /// What its places, turns and wrong tokens are counted by.
    const HostKey& host() const { return host_; }
    /// Who makes the current request. Its name is "http 10.0.0.9" or "http 10.0.0.9 token ops".
    const WhoRef& who() const { return who_; }
    const std::string& name() const { return who_->name; }
    const std::string& token() const { return who_->token; }
    /// Sets the client of the current request: the name of the token ("": none), the role, and the
    /// listener.
    void identify(std::string token, Standing standing, std::string listener);
    /// Sets subject and role word of the client's certificate; `standing`: by that role, on a
    /// listener that takes roles from certificates.
    void certify(std::string subject, std::string word, std::optional<Standing> standing);
    const std::optional<Standing>& certificate_role() const { return certificate_role_; }
    /// A caller of the same identity for another loop, still there and without callbacks.
    Caller stand_in() const {
        Caller caller(id_, address_);
        caller.who_ = who_;
        caller.certificate_role_ = certificate_role_;
        return caller;
    }
    /// Asks on behalf of another caller.
    void acts_for(const Caller& client) { who_ = client.who_; }
    /// True once the connection is over: no reply is wanted, and the site's objects may be gone.
    bool has_left() const { return left_; }
    /// Registers a callback for the connection's end; of several for one `whom` only the first
    /// counts. True if this is the first. Must not be called on a caller that has left.
    bool at_leaving(const void* whom, std::function<void()> farewell) {
        return leave_handlers_.emplace(whom, std::move(farewell)).second;
    }
    void forget(const void* whom) { leave_handlers_.erase(whom); }
    /// Moves its callbacks to another caller.
    void hand_over(Caller& to) { to.leave_handlers_.merge(leave_handlers_); }
    void leave() {
        left_ = true;
        hang_up();
    }
    /// No reply is wanted any more: what has begun is completed, nothing new is started.
    void hang_up() {
        hung_up_ = true;
        for (const auto& [whom, farewell] : std::exchange(leave_handlers_, {})) farewell();
    }
    bool has_hung_up() const { return hung_up_; }
    /// Its request has, or may have, taken effect: repeating it could apply it twice.
    void take_effect() { has_effect_ = true; }
    bool has_effect() const { return has_effect_; }
    /// A bus transaction made for its current request, by this line. Only the first kMostCosts are
    /// recorded.
    struct Cost {
        const void* line = nullptr;
        std::uint64_t transaction = 0;
        friend bool operator==(const Cost&, const Cost&) = default;
    };
    static constexpr std::size_t kMostCosts = 1000;
    void add_cost(const Cost& cost) {
        if (costs_.size() < kMostCosts) costs_.push_back(cost);
    }
    /// Returns and clears those of the current request, in order.
    std::vector<Cost> take_costs() { return std::exchange(costs_, {}); }

  private:
    std::uint64_t id_;
    std::string address_;
    HostKey host_;
    WhoRef who_;
    std::optional<Standing> certificate_role_{};
    bool left_ = false;
    bool hung_up_ = false;
    bool has_effect_ = false;
    std::vector<Cost> costs_;
    std::map<const void*, std::function<void()>> leave_handlers_;
};

/// A request as seen by handlers, independent of Beast.
struct HttpRequest {
    std::string method;
    std::string host;                               ///< lower case; empty: HTTP/1.0 without one
    std::string port;                               ///< of the Host; empty if none
    std::vector<std::string> path;                  ///< segments, percent-decoded
    std::multimap<std::string, std::string> query;  ///< decoded, repeated names kept
    std::map<std::string, std::string> headers;     ///< those read, names in lower case
    std::string body;
    std::vector<std::string> arguments;  ///< segments matched by the route's {}
    std::shared_ptr<Caller> caller;
    Role role = Role::none;  ///< of the client
    WallTime at{};           ///< when it was judged: tokens expire
    bool folder = false;     ///< the path ends with '/'
};
/// A header that is read, as sent; "" if there is none. Valid as long as the request's headers.
std::string_view header(const HttpRequest& request, const std::string& name);

/// The request headers that are read; each may occur once.
inline constexpr const char* kHeadersRead[] = {
    "authorization",  "origin",         "content-type",    "content-encoding", "sec-fetch-site",
    "sec-fetch-mode", "sec-fetch-dest", "idempotency-key", "last-event-id"};
/// … and list headers: repeated fields are joined (RFC 9110 5.3).
inline constexpr const char* kListsRead[] = {"accept", "accept-encoding", "if-none-match",
                                             "if-match"};

/// A body shared by several responses, in memory once.
using SharedText = std::shared_ptr<const std::string>;

struct HttpResponse {
    unsigned status = 200;
    std::string content_type = "application/json";
    std::string body;
    SharedText shared_body;                                    ///< if set, sent instead of `body`
    bool probe = false;                                        ///< a health check: not rate limited
    std::vector<std::pair<std::string, std::string>> headers;  ///< additional headers
    /// If set, the loop of the faces calls this to make the body, so that the plant's loop only
    /// copies. Owns or shares what it needs.
    std::function<void(HttpResponse&)> finish;
    bool is_long = false;  ///< `finish` may take long: a worker calls it
    /// If set, there is no body: events are streamed while the client listens.
    std::shared_ptr<EventHub::Listener> events;
};

/// Says that the reply depends on this request header (RFC 9110 12.5.5).
void add_vary(HttpResponse& response, const std::string& name);

using Handling = boost::asio::awaitable<HttpResponse>;

/// A path with its method, required role and handler.
struct Route {
    std::string_view verb;     ///< "GET" includes HEAD
    std::string_view pattern;  ///< {} matches any one segment
    Role needed = Role::none;  ///< none: public, but allow list and host name still apply
    std::function<Handling(HttpRequest)> handler;
    std::vector<std::string_view> queries{};  ///< supported; any other is refused
    bool probe = false;    ///< answered for any host name and query, even when all else is barred
    bool face = false;     ///< the handler needs nothing of the plant's loop
    bool figures = false;  ///< the response shows the server's counters
    Right right = Right::read;  ///< that an own role has to have; none is needed where `needed` is
    std::optional<Right> or_right{};  ///< one that is enough for an own role, too
    /// Of the configuration's text: who may use the route may send a long body, and the audit
    /// knows each use.
    bool configures = false;
};
/// Bytes of a body that such a route takes.
inline constexpr std::size_t kLongBody = 4 * 1024 * 1024;

/// What a client changed or was refused: for an audit. Valid for the call only.
struct Deed {
    WhoRef who;
    std::string_view method;
    std::string_view path;
    std::string_view body;  ///< of the request, at most kMostOfBody bytes
    unsigned status = 0;
    std::string_view answer{};  ///< the reply's body
    bool shown_token = false;   ///< a right or a wrong one

    static constexpr std::size_t kMostOfBody = 1024;
};

class Crossing;
struct Counters;

/// What a server serves. Shared by its sessions; the first matching route is used.
struct Site {
    Settings settings;
    std::shared_ptr<Crossing> crossing{};  ///< null: handlers run in the sessions' loop
    std::function<void(const Counters&)> keep_figures{};  ///< of the plant's loop; may be empty
    std::function<std::function<void()>()> collect{};     ///< as Providers::collect
    std::string product;                                  ///< for the Server header: "name/1.2.3"
    std::vector<Route> routes;
    std::function<std::uint64_t()> next_caller;  ///< returns connection ids
    std::function<TimePoint()> now;              ///< any thread; required unless all is public
    std::function<void(const Deed&)> record{};  ///< of the plant's loop; may be empty, never throws
    std::function<WallTime()> wall{};           ///< any thread; empty: no token expires
};

/// Logs at info what a client did or was refused: its name (address, token) first, as `client`.
/// Long texts from the client are truncated.
void log_client(const Caller& caller, std::string_view event,
                std::initializer_list<std::pair<std::string_view, std::string>> fields);

}  // namespace panelgate::web
