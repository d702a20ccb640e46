#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>

namespace panelgate::app {

/// What a program does when it is told to end.
struct Ending {
    std::function<void()> begin;   ///< first SIGTERM or SIGINT: stop accepting
    std::function<bool()> done;    ///< asked again and again until true
    std::function<void()> finish;  ///< then, or after 10 s, or at the second signal
};

/// Runs the loop until a signal has ended it. SIGHUP is told to be no reload in this version.
void run_until_signal(boost::asio::io_context& io, const Ending& ending);

}  // namespace panelgate::app
