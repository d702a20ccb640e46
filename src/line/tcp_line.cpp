#include "panelgate/line/tcp_line.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <utility>

#include "descriptor_line.hpp"

namespace panelgate::line {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr Duration kConnectTimeout = 5s;

/// A server that has gone is noticed within half a minute also while nobody asks.
void set_options(int fd) {
    const int on = 1;
    const int idle = 10;  // s before the first probe
    const int pause = 5;  // s between probes
    const int probes = 3;
    ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    ::setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle, sizeof idle);
    ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &pause, sizeof pause);
    ::setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &probes, sizeof probes);
}

class TcpLine final : public DescriptorLine {
  public:
    TcpLine(const asio::any_io_executor& executor, Settings settings, TcpEndpoint endpoint)
        : DescriptorLine(executor, std::move(settings)),
          endpoint_(std::move(endpoint)),
          resolver_(executor),
          socket_(executor),
          patience_(executor) {}
    ~TcpLine() override { stop(); }

    Duration latency() override;

  private:
    void begin_open() override;
    ssize_t put(ByteView bytes) override {
        return ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
    void cancel_open() override;
    void connect(const tcp::resolver::results_type& addresses);
    void connected();
    void failed(const std::string& why) {
        cancel_open();
        open_failed("cannot reach " + settings().device + ": " + why);
    }
    /// For completions: nothing of an attempt that was given up.
    auto current() const {
        return
            [alive = alive(), this, attempt = attempt_] { return *alive && attempt == attempt_; };
    }

    TcpEndpoint endpoint_;
    tcp::resolver resolver_;
    tcp::socket socket_;  ///< while it connects
    asio::steady_timer patience_;
    std::uint64_t attempt_ = 0;
};

void TcpLine::begin_open() {
    ++attempt_;
    patience_.expires_after(kConnectTimeout);
    patience_.async_wait([this, current = current()](const error_code& error) {
        if (!error && current()) failed("no answer within 5 s");
    });
    resolver_.async_resolve(
        endpoint_.host, endpoint_.port, tcp::resolver::numeric_service,
        [this, current = current()](const error_code& error,
                                    const tcp::resolver::results_type& addresses) {
            if (!current()) return;
            if (error) return failed(error.message());
            connect(addresses);
        });
}

void TcpLine::connect(const tcp::resolver::results_type& addresses) {
    asio::async_connect(socket_, addresses,
                        [this, current = current()](const error_code& error, const tcp::endpoint&) {
                            if (!current()) return;
                            if (error) return failed(error.message());
                            connected();
                        });
}

void TcpLine::connected() {
    ++attempt_;
    patience_.cancel();
    error_code ignored;
    socket_.non_blocking(true, ignored);
    set_options(socket_.native_handle());
    error_code error;
    const int released = socket_.release(error);
    if (error) return failed(error.message());
    const std::string refused = adopt(released);
    if (!refused.empty()) return failed(refused);
    opened();
}

void TcpLine::cancel_open() {
    ++attempt_;
    resolver_.cancel();
    patience_.cancel();
    error_code ignored;
    socket_.close(ignored);
}

/// What the kernel has seen of the way there and back, and four times how much that varies: the
/// same allowance as TCP's own (RFC 6298).
Duration TcpLine::latency() {
    tcp_info info{};
    socklen_t size = sizeof info;
    if (!is_open() || ::getsockopt(fd(), IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
    return std::chrono::microseconds(info.tcpi_rtt + 4 * info.tcpi_rttvar);
}

}  // namespace

std::unique_ptr<Line> make_tcp_line(asio::any_io_executor executor, Settings settings) {
    TcpEndpoint endpoint = parse_tcp_device(settings.device).value_or(TcpEndpoint{});
    return std::make_unique<TcpLine>(executor, std::move(settings), std::move(endpoint));
}

}  // namespace panelgate::line
