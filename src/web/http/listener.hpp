#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <set>

#include "api/handlers.hpp"
#include "http/session.hpp"
#include "panelgate/web/api/server.hpp"

namespace panelgate::web {

/// Accepts connections and owns their sessions.
class Server::Listener : public std::enable_shared_from_this<Listener> {
  public:
    Listener(boost::asio::any_io_executor executor, std::shared_ptr<const Api> api);

    boost::system::error_code open();
    std::uint16_t port() const;
    void stop();
    void abandon();
    std::size_t connections() const { return sessions_.size(); }

  private:
    static boost::asio::awaitable<void> accept_loop(std::shared_ptr<Listener> self);
    void take(boost::asio::ip::tcp::socket socket);

    std::shared_ptr<const Api> api_;
    boost::asio::ip::tcp::acceptor acceptor_;
    boost::asio::steady_timer pause_;  ///< after a failed accept
    std::set<std::shared_ptr<HttpSession>> sessions_;
};

}  // namespace panelgate::web
