#pragma once

#include <boost/asio/awaitable.hpp>
#include <string>

namespace panelgate::web {

/// A body in the content coding gzip, made in pieces: others have their turn in between.
boost::asio::awaitable<std::string> packed(std::string body);

}  // namespace panelgate::web
