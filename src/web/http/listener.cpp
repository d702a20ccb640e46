#include "panelgate/web/http/listener.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <exception>
#include <string_view>
#include <utility>

#include "panelgate/rt/log.hpp"
#include "session.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
namespace {

/// As much as goes without waiting; the connection is closed whatever comes of it.
void refuse(tcp::socket socket) {
    static constexpr std::string_view kFull =
        "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nContent-Length: 0\r\n"
        "Connection: close\r\n\r\n";
    error_code ignored;
    socket.non_blocking(true, ignored);
    socket.write_some(asio::const_buffer(kFull.data(), kFull.size()), ignored);
}

}  // namespace

HttpListener::HttpListener(asio::any_io_executor executor, std::shared_ptr<const Site> site)
    : site_(std::move(site)),
      acceptor_(
          executor, [this](tcp::socket socket) { take(std::move(socket)); },
          [this](const error_code& why) {
              rt::log(rt::LogLevel::warn, "cannot accept",
                      {{"listener", site_->settings.name()}, {"reason", why.message()}});
          }) {}

error_code HttpListener::open() {
    const Settings& settings = site_->settings;
    return acceptor_.open(settings.address, settings.port, settings.ipv6_only);
}

std::uint16_t HttpListener::port() const { return acceptor_.port(); }

void HttpListener::take(tcp::socket socket) {
    if (sessions_.size() >= site_->settings.max_connections) {
        refuse(std::move(socket));
        return;
    }
    auto session = std::make_shared<HttpSession>(std::move(socket), site_);
    sessions_.insert(session);
    asio::co_spawn(acceptor_.get_executor(), HttpSession::run(session),
                   [self = weak_from_this(), session](std::exception_ptr failed) {
                       if (failed) rt::log(rt::LogLevel::error, "http session failed");
                       session->abandon();
                       if (const auto listener = self.lock()) listener->sessions_.erase(session);
                   });
}

void HttpListener::stop() {
    acceptor_.close();
    const auto sessions = sessions_;
    for (const auto& session : sessions) session->stop();
}

void HttpListener::abandon() {
    stop();
    const auto sessions = sessions_;
    for (const auto& session : sessions) session->abandon();
}

}  // namespace panelgate::web
