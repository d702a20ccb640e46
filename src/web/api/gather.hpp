#pragma once

#include <boost/asio/awaitable.hpp>
#include <vector>

namespace panelgate::web {

/// Runs all of them at once, in the loop of who awaits; goes on when the last has ended. Then the
/// first exception of any is thrown.
boost::asio::awaitable<void> gather(std::vector<boost::asio::awaitable<void>> all);

}  // namespace panelgate::web
