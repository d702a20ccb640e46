#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

class HttpSession;
struct Shared;

/// Accepts connections and owns their sessions. Lives in the one thread that runs the executor.
class HttpListener : public std::enable_shared_from_this<HttpListener> {
  public:
    /// Throws std::invalid_argument for an `allow` that is none.
    HttpListener(boost::asio::any_io_executor executor, std::shared_ptr<const Site> site);

    /// On an error (address in use, not an address…) nothing is open.
    boost::system::error_code open();
    /// Serves this from the next request on; what runs ends on the one before. Who may not be
    /// connected any more gets its answer and is closed, and streams of events end where tokens are
    /// others: their clients come again. Only with settings.is_same_door().
    void apply(std::shared_ptr<const Site> site);
    /// The port that is listened on; 0 before open().
    std::uint16_t port() const;
    /// Closes the listener and idle connections; running requests are answered, then closed. A
    /// client has no longer than `reading` to take an answer.
    void stop(Duration reading);
    /// Closes everything; answers still owed are not sent.
    void abandon();
    std::size_t connections() const { return sessions_.size(); }
    const Counters& counters() const;

  private:
    void take(boost::asio::ip::tcp::socket socket);
    /// May it ask only for what is free?
    bool make_room(const Caller& caller);

    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    rt::Acceptor acceptor_;
    std::map<std::uint64_t, std::shared_ptr<HttpSession>> sessions_;  ///< by their callers' ids
};

}  // namespace panelgate::web
