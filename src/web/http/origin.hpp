#pragma once

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// Returns the host of "NAME", "NAME:PORT", "[ADDRESS]:PORT" in lower case, without brackets or a
/// trailing dot; nullopt if malformed.
std::optional<std::string> host_of_authority(std::string_view authority);
/// Returns its port, "" if there is none.
std::string port_of_authority(std::string_view authority);

/// Returns this machine's own names, without a DNS query.
std::vector<std::string> machine_names();

/// The names under which the server may be addressed: protects against DNS rebinding, since a
/// rebound page sends its own name and browsers let no page choose another. Pure.
class HostNames {
  public:
    HostNames(const Settings& settings, const std::vector<std::string>& machine);

    /// True for a name of ours. `host` comes from host_of_authority(), `local` is the connection's
    /// local address. That address, the listen address and the loopback (address and name) are
    /// always accepted.
    bool knows(const std::string& host, const boost::asio::ip::address& local) const;
    /// True for a configured name, where a proxy may use another port.
    bool is_configured(const std::string& host) const { return configured_.contains(host); }

  private:
    std::set<std::string> names_;
    std::set<std::string> configured_;
    std::set<boost::asio::ip::address> addresses_;
};

/// Checks a request for anything not public. 421 if it is for another name (`request.host`;
/// HTTP/1.0 may have none; an address is taken whichever it is). 403 if the browser reports a page
/// of another site, unless the user follows a link to one of our pages; and for a foreign Origin,
/// except with OPTIONS. Pages of the origins in `readers` (lower case) may read.
std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local,
                                    const std::vector<std::string>& readers);

/// Which pages of other sites may read: the server's part of the CORS protocol
/// (https://fetch.spec.whatwg.org/#http-cors-protocol). Pure.

/// The origin of the page that asks, as its browser wrote it, if `origins` (lower case) lists it;
/// else "".
std::string listed_origin(const HttpRequest& request, const std::vector<std::string>& origins);
bool is_listed(const std::string& origin, const std::vector<std::string>& origins);
/// True for what such a page may do: read, and ask beforehand whether it may.
bool is_reading(const HttpRequest& request);

/// Lets the browser hand a reply to the page of `origin`; `preflight`: it is one to OPTIONS.
void share_with(const std::string& origin, bool preflight, HttpResponse& response);

}  // namespace panelgate::web
