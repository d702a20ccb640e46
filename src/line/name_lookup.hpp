#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <functional>
#include <memory>
#include <string>

#include "panelgate/line/settings.hpp"

namespace panelgate::line {

/// Finds the addresses of one host. A name server may be silent for half a minute, and nobody can
/// take the question back: so each look-up has a thread of its own, at most one for an object, that
/// nobody waits for, also at the program's end. All else happens in the one thread that runs the
/// executor; nothing is told after cancel() or the object's end.
class NameLookup {
  public:
    using Addresses = boost::asio::ip::tcp::resolver::results_type;
    using Found =
        std::function<void(const boost::system::error_code& error, const Addresses& addresses)>;
    /// Threads of the whole program; who comes when all are held by silent servers is told to try
    /// again.
    static constexpr int kMostThreads = 64;

    NameLookup(boost::asio::any_io_executor executor, TcpEndpoint endpoint);
    ~NameLookup();
    NameLookup(const NameLookup&) = delete;
    NameLookup& operator=(const NameLookup&) = delete;

    /// Takes the place of what was asked before. A question that is still open is not asked twice:
    /// its answer is this one's, too.
    void ask(Found found);
    void cancel();
    bool waits() const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< the thread's share of it
};

}  // namespace panelgate::line
