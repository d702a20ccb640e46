#include "panelgate/web/http/listener.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
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

constexpr Duration kPauseAfterFailedAccept = 100ms;  ///< mostly: out of file descriptors

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
    : site_(std::move(site)), acceptor_(executor), pause_(executor) {}

error_code HttpListener::open() {
    error_code error;
    const auto address = asio::ip::make_address(site_->settings.address, error);
    if (error) return error;
    const tcp::endpoint endpoint(address, site_->settings.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
    if (error) {
        error_code ignored;
        acceptor_.close(ignored);
        return error;
    }
    asio::co_spawn(acceptor_.get_executor(), accept_loop(shared_from_this()),
                   [](std::exception_ptr failed) {
                       if (failed) rt::log(rt::LogLevel::error, "http listener failed");
                   });
    return {};
}

std::uint16_t HttpListener::port() const {
    error_code error;
    const tcp::endpoint endpoint = acceptor_.local_endpoint(error);
    return error ? std::uint16_t{0} : endpoint.port();
}

asio::awaitable<void> HttpListener::accept_loop(std::shared_ptr<HttpListener> self) {
    while (self->acceptor_.is_open()) {
        error_code error;
        tcp::socket socket =
            co_await self->acceptor_.async_accept(asio::redirect_error(asio::use_awaitable, error));
        if (!self->acceptor_.is_open()) break;
        if (!error) {
            self->take(std::move(socket));
            continue;
        }
        self->pause_.expires_after(kPauseAfterFailedAccept);
        co_await self->pause_.async_wait(asio::redirect_error(asio::use_awaitable, error));
    }
}

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
    error_code ignored;
    acceptor_.close(ignored);
    pause_.cancel();
    const auto sessions = sessions_;
    for (const auto& session : sessions) session->stop();
}

void HttpListener::abandon() {
    stop();
    const auto sessions = sessions_;
    for (const auto& session : sessions) session->abandon();
}

}  // namespace panelgate::web
