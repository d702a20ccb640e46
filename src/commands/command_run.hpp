#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cstddef>
#include <functional>

#include "commands.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::commands {

/// What a program does on a signal to end, or to reload.
struct Ending {
    std::function<void()> begin;   ///< first SIGTERM or SIGINT: stop accepting
    std::function<bool()> done;    ///< polled until true
    std::function<void()> finish;  ///< called then, after patience(), or at the second signal
    std::function<std::size_t()> open{};  ///< connections with outstanding answers
    Duration longest_answer{};            ///< longest time to an outstanding answer
    std::function<void()> reload{};       ///< on SIGHUP; empty: no reload

    /// Accepted requests are answered within their time, and the answer needs a moment to be sent.
    Duration patience() const { return std::max<Duration>(10s, longest_answer + 2s); }
};

/// Catches signals from construction on, so that no signal ends the program during the start.
class SignalLoop {
  public:
    explicit SignalLoop(boost::asio::io_context& io);
    /// Runs the loop until a signal, perhaps an earlier one, has ended it. kFine, or kCut if a
    /// second signal came before it was done.
    ExitCode run(const Ending& ending);

  private:
    boost::asio::io_context& io_;
    boost::asio::signal_set ends_;
    boost::asio::signal_set reloads_;
};

}  // namespace panelgate::commands
