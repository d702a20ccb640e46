#pragma once

#include <boost/asio/ip/address.hpp>
#include <optional>

#include "host_names.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// May who asks from there, under this name, have anything that is not free? 421 when the request
/// is for another host (`request.host`; a request of HTTP/1.0 may have none). 403 when a browser
/// says that a page of another site asks, unless its user follows a link to a page of ours; and
/// when there is an Origin that is not ours, but for OPTIONS.
std::optional<Problem> check_origin(const HttpRequest& request, const HostNames& names,
                                    const boost::asio::ip::address& local);

}  // namespace panelgate::web
