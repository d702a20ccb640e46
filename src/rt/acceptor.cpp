#include "panelgate/rt/acceptor.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

namespace panelgate::rt {

void set_up_socket(int socket, const KeepAlive& keep_alive) {
    const auto set = [socket](int level, int name, int value) {
        ::setsockopt(socket, level, name, &value, sizeof value);
    };
    set(IPPROTO_TCP, TCP_NODELAY, 1);
    set(SOL_SOCKET, SO_KEEPALIVE, 1);
    set(IPPROTO_TCP, TCP_KEEPIDLE, static_cast<int>(keep_alive.silence.count()));
    set(IPPROTO_TCP, TCP_KEEPINTVL, static_cast<int>(keep_alive.pause.count()));
    set(IPPROTO_TCP, TCP_KEEPCNT, keep_alive.probes);
}

namespace {

namespace ip = boost::asio::ip;

AddressBytes as_v6(const ip::address& address) {
    if (address.is_v6()) return address.to_v6().to_bytes();
    return ip::make_address_v6(ip::v4_mapped, address.to_v4()).to_bytes();
}

}  // namespace

AccessList::AccessList(const std::vector<Network>& allowed) {
    for (const Network& network : allowed) {
        boost::system::error_code error;
        const ip::address address = ip::make_address(network.address, error);
        const unsigned widest = !error && address.is_v4() ? 32 : 128;
        if (error || network.prefix > widest) {
            throw std::invalid_argument("not a network: " + network.address + "/" +
                                        std::to_string(network.prefix));
        }
        allowed_.push_back({as_v6(address), network.prefix + (128 - widest)});
    }
}

bool AccessList::allows(const ip::address& peer) const {
    if (allowed_.empty()) return true;
    const AddressBytes address = as_v6(peer);
    return std::ranges::any_of(allowed_, [&](const Entry& entry) {
        return same_prefix(address, entry.address, entry.prefix);
    });
}

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {
constexpr auto kAcceptPause = std::chrono::milliseconds(100);
}  // namespace

struct Acceptor::State : std::enable_shared_from_this<Acceptor::State> {
    State(const asio::any_io_executor& executor, Accepted a, Failing f)
        : acceptor(executor), pause(executor), accepted(std::move(a)), failing(std::move(f)) {}

    void accept();
    void on_accept(const error_code& error, tcp::socket socket);

    tcp::acceptor acceptor;
    asio::steady_timer pause;
    Accepted accepted;
    Failing failing;
    bool fails = false;
};

void Acceptor::State::accept() {
    acceptor.async_accept([self = shared_from_this()](const error_code& error, tcp::socket socket) {
        self->on_accept(error, std::move(socket));
    });
}

void Acceptor::State::on_accept(const error_code& error, tcp::socket socket) {
    if (!acceptor.is_open()) return;
    if (error && error != asio::error::connection_aborted) {
        // Without descriptors the next attempt would fail at once: without a pause the loop would
        // spin.
        if (!std::exchange(fails, true)) failing(error);
        pause.expires_after(kAcceptPause);
        pause.async_wait([self = shared_from_this()](const error_code& stopped) {
            if (!stopped && self->acceptor.is_open()) self->accept();
        });
        return;
    }
    if (!error) {
        fails = false;
        accepted(std::move(socket));
        if (!acceptor.is_open()) return;
    }
    accept();
}

Acceptor::Acceptor(const asio::any_io_executor& executor, Accepted accepted, Failing failing)
    : state_(std::make_shared<State>(executor, std::move(accepted), std::move(failing))) {}

Acceptor::~Acceptor() { close(); }

error_code Acceptor::open(const std::string& address, std::uint16_t port, bool ipv6_only) {
    tcp::acceptor& acceptor = state_->acceptor;
    error_code error;
    const tcp::endpoint endpoint(asio::ip::make_address(address, error), port);
    if (!error) acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error && endpoint.address().is_v6())
        acceptor.set_option(asio::ip::v6_only(ipv6_only), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(tcp::acceptor::max_listen_connections, error);
    if (error) {
        close();
    } else {
        state_->accept();
    }
    return error;
}

std::uint16_t Acceptor::port() const {
    error_code closed;
    const tcp::endpoint endpoint = state_->acceptor.local_endpoint(closed);
    return closed ? std::uint16_t{0} : endpoint.port();
}

asio::any_io_executor Acceptor::get_executor() const { return state_->acceptor.get_executor(); }

void Acceptor::close() {
    error_code ignored;
    state_->acceptor.close(ignored);
    state_->pause.cancel();
}

}  // namespace panelgate::rt
