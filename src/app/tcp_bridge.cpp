#include "tcp_bridge.hpp"

#include <fcntl.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <system_error>
#include <utility>

namespace panelgate::app {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

struct TcpBridge::State : std::enable_shared_from_this<TcpBridge::State> {
    using Buffer = std::array<std::uint8_t, 1024>;

    explicit State(const asio::any_io_executor& executor)
        : acceptor(executor), client(executor), device(executor) {}

    void accept();
    void from_client(std::uint64_t connection);
    void from_device();

    tcp::acceptor acceptor;
    tcp::socket client;
    asio::posix::stream_descriptor device;
    std::uint64_t connections = 0;  ///< a completion of an earlier one is stale
    Buffer up{};
    Buffer down{};
};

void TcpBridge::State::accept() {
    acceptor.async_accept([self = shared_from_this()](error_code error, tcp::socket socket) {
        if (error) return;
        self->client = std::move(socket);
        self->client.set_option(tcp::no_delay(true), error);
        self->from_client(++self->connections);
        self->accept();
    });
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
    : state_(std::make_shared<State>(executor)) {
    const int fd = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) throw std::system_error(errno, std::generic_category(), device);
    state_->device.assign(fd);
    const std::string name = endpoint.address + ':' + std::to_string(endpoint.port);
    const tcp::endpoint where(asio::ip::make_address(endpoint.address), endpoint.port);
    error_code error;
    state_->acceptor.open(where.protocol(), error);
    if (!error) state_->acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) state_->acceptor.bind(where, error);
    if (!error) state_->acceptor.listen(1, error);
    if (error) throw std::system_error(error, "cannot listen on " + name);
    state_->accept();
    state_->from_device();
}

TcpBridge::~TcpBridge() {
    error_code ignored;
    state_->acceptor.close(ignored);
    state_->client.close(ignored);
    state_->device.close(ignored);
}

std::uint16_t TcpBridge::port() const { return state_->acceptor.local_endpoint().port(); }

}  // namespace panelgate::app
