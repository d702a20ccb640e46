#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstddef>
#include <functional>

#include "commands.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::app {

/// What a program does when it is told to end, or to read its file again.
struct Ending {
    std::function<void()> begin;   ///< first SIGTERM or SIGINT: stop accepting
    std::function<bool()> done;    ///< asked again and again until true
    std::function<void()> finish;  ///< then, or when patience() is over, or at the second signal
    std::function<std::size_t()> open{};  ///< connections that are still owed an answer
    Duration longest_answer{};            ///< of what is in flight
    std::function<void()> reload{};       ///< at SIGHUP; empty: nothing can be read again

    /// What has been accepted is answered within its time, and the answer needs a moment to leave.
    Duration patience() const { return std::max<Duration>(10s, longest_answer + 2s); }
};

/// Keeps signals from its construction on, so that none ends the program while it starts.
class SignalLoop {
  public:
    explicit SignalLoop(boost::asio::io_context& io);
    /// Runs the loop until a signal, also an earlier one, has ended it: kFine, or kCut when a
    /// second one came before it was done.
    ExitCode run(const Ending& ending);

  private:
    boost::asio::io_context& io_;
    boost::asio::signal_set ends_;
    boost::asio::signal_set reloads_;
};

}  // namespace panelgate::app
