#pragma once

#include <atomic>
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

namespace panelgate::tls {
class Handshakes;
class Stream;
}  // namespace panelgate::tls
namespace panelgate::web {

class HttpSession;
struct Shared;

/// Accepts connections and owns their sessions. Of the executor's single thread, but for
/// connections().
class HttpListener : public std::enable_shared_from_this<HttpListener> {
  public:
    /// Throws std::invalid_argument for an invalid `allow`.
    HttpListener(boost::asio::any_io_executor executor, std::shared_ptr<const Site> site);

    /// Opens the port. On an error (address in use, invalid address…) nothing is open.
    boost::system::error_code open();
    /// Serves `site` from the next request on; running requests finish on the previous one. Clients
    /// no longer allowed get their reply and are closed; event streams end of those whose token
    /// (or, without one, whose role) changed, and their clients reconnect. Requires
    /// settings.is_same_listener().
    void apply(std::shared_ptr<const Site> site);
    /// Returns the bound port; 0 before open().
    std::uint16_t port() const;
    /// Closes the listener and idle connections; running requests are answered, then closed. A
    /// client has at most `reading` to take a reply.
    void stop(Duration reading);
    /// Closes everything; outstanding replies are not sent.
    void abandon();
    std::size_t connections() const { return open_; }
    /// Takes the same `tls` with changed files, for connections to come; those whose certificate is
    /// revoked now are closed behind the running request. Ignored without TLS.
    void renew(const tls::Settings& settings);
    /// Closes, behind the running request, connections whose certificate is revoked or has expired.
    /// Ignored without TLS.
    void review();
    Counters counters() const;

  private:
    void take(boost::asio::ip::tcp::socket socket);
    void serve(tls::Stream stream);
    /// True if it gets one of the places for probes only.
    bool make_room(const Caller& caller);
    void apply_roles(const Settings& before);

    std::shared_ptr<Shared> shared_;
    rt::AccessList allowed_;
    std::shared_ptr<tls::Handshakes> handshakes_;  ///< null: no TLS
    rt::Acceptor acceptor_;
    std::map<std::uint64_t, std::shared_ptr<HttpSession>> sessions_;  ///< by caller id
    std::atomic<std::size_t> open_ = 0;                               ///< their number
};

}  // namespace panelgate::web
