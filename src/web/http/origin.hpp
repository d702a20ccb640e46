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

/// ASCII only: what HTTP compares without case is nothing else.
inline std::string to_lower(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return lower;
}

/// The host of "NAME", "NAME:PORT", "[ADDRESS]:PORT": in lower case, without brackets and without
/// the dot at the end. Nothing when it is none.
std::optional<std::string> host_of_authority(std::string_view authority);
/// Its port; "" where it names none.
std::string port_of_authority(std::string_view authority);

/// What this machine calls itself, without asking a name server.
std::vector<std::string> machine_names();

/// By which names the server may be called. A page whose name was rebound to our address calls us
/// by its own; browsers let no page choose another. Pure.
class HostNames {
  public:
    HostNames(const Settings& settings, const std::vector<std::string>& machine);

    /// `host` is of host_of_authority(); `local` is the connection's address at our end. Always
    /// ours are that address, the one that is listened on, and the loopback, by address and name.
    bool knows(const std::string& host, const boost::asio::ip::address& local) const;
    /// The configuration names it: a proxy may have another port there.
    bool is_configured(const std::string& host) const { return configured_.contains(host); }

  private:
    std::set<std::string> names_;
    std::set<std::string> configured_;
    std::set<boost::asio::ip::address> addresses_;
};

/// May who asks from there, under this name, have anything that is not free? 421 when the request
/// is for another host (`request.host`; a request of HTTP/1.0 may have none). 403 when a browser
/// says that a page of another site asks, unless its user follows a link to a page of ours; and
/// when there is an Origin that is not ours, but for OPTIONS.
std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local);

}  // namespace panelgate::web
