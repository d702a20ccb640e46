#include "tcp_bridge.hpp"

#include <fcntl.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::app {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

struct TcpBridge::State : std::enable_shared_from_this<TcpBridge::State> {
    using Buffer = std::array<std::uint8_t, 1024>;

    explicit State(const asio::any_io_executor& executor) : client(executor), device(executor) {}

    /// Takes the place of the one before.
    void serve(tcp::socket socket);
    void from_client(std::uint64_t connection);
    void from_device();

    tcp::socket client;
    asio::posix::stream_descriptor device;
    std::uint64_t connections = 0;  ///< a completion of an earlier one is stale
    Buffer up{};
    Buffer down{};
};

void TcpBridge::State::serve(tcp::socket socket) {
    client = std::move(socket);
    error_code ignored;
    client.set_option(tcp::no_delay(true), ignored);
    client.non_blocking(true, ignored);
    from_client(++connections);
}

void TcpBridge::State::from_client(std::uint64_t connection) {
    client.async_read_some(
        asio::buffer(up), [self = shared_from_this(), connection](error_code error, std::size_t n) {
            if (connection != self->connections) return;
            if (error) {
                self->client.close(error);
                return;
            }
            // A pty takes a frame at once; what it does not take is lost, as on a wire.
            asio::write(self->device, asio::buffer(self->up, n), error);
            self->from_client(connection);
        });
}

void TcpBridge::State::from_device() {
    device.async_read_some(asio::buffer(down),
                           [self = shared_from_this()](error_code error, std::size_t n) {
                               if (error) return;
                               // A client that does not read loses bytes instead of stopping the
                               // line.
                               if (self->client.is_open())
                                   self->client.send(asio::buffer(self->down, n), 0, error);
                               self->from_device();
                           });
}

TcpBridge::TcpBridge(const asio::any_io_executor& executor, const config::Endpoint& endpoint,
                     const std::string& device)
    : state_(std::make_shared<State>(executor)),
      acceptor_(
          executor, [state = state_.get()](tcp::socket socket) { state->serve(std::move(socket)); },
          [](const error_code& why) {
              rt::log(rt::LogLevel::warn, "cannot accept", {{"reason", why.message()}});
          }) {
    const int fd = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) throw std::system_error(errno, std::generic_category(), device);
    state_->device.assign(fd);
    state_->device.non_blocking(true);  // else a write waits for those who read on this very loop
    if (const error_code error = acceptor_.open(endpoint.address, endpoint.port)) {
        throw std::system_error(
            error, "cannot listen on " + endpoint_text(endpoint.address, endpoint.port));
    }
    state_->from_device();
}

TcpBridge::~TcpBridge() {
    error_code ignored;
    state_->client.close(ignored);
    state_->device.close(ignored);
}

std::uint16_t TcpBridge::port() const { return acceptor_.port(); }

}  // namespace panelgate::app
