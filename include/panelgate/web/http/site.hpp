#pragma once

#include <boost/asio/awaitable.hpp>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

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

}  // namespace panelgate::web
