#include "panelgate/line/tcp_line.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <charconv>
#include <optional>
#include <utility>

#include "descriptor_line.hpp"
#include "name_lookup.hpp"
#include "panelgate/rt/keep_alive.hpp"

namespace panelgate::line {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr Duration kConnectTimeout = 5s;

/// How long the kernel goes on with bytes that the server does not acknowledge, or has no room for
/// (TCP_USER_TIMEOUT). Its own patience, 15 minutes, would keep the line up without a server. Five
/// retransmissions fit in (after 0.2, 0.6, 1.4, 3 and 6.2 s, the last one at the limit).
constexpr std::chrono::seconds kPatience{6};

/// Probes of an idle connection. The patience above ends them too, in place of their number: so the
/// first has to be early enough for three of them. A server that has gone is noticed within it also
/// while nobody asks.
constexpr rt::KeepAlive kKeepAlive{3s, 1s, 3};
static_assert(kKeepAlive.silence + kKeepAlive.probes * kKeepAlive.pause <= kPatience);

/// A server may keep an acknowledgement back until there is something to send with it: Linux and
/// Windows up to 200 ms. What it has had for a shorter time says nothing.
constexpr Duration kDelayedAck = 200ms;

void set_options(int fd) {
    rt::set_up_socket(fd, kKeepAlive);
    const int patience = static_cast<int>(std::chrono::milliseconds(kPatience).count());
    ::setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &patience, sizeof patience);
}

/// Nothing on a name. A number needs no look-up, and no thread for it.
std::optional<tcp::endpoint> numeric(const TcpEndpoint& endpoint) {
    error_code is_name;
    const asio::ip::address address = asio::ip::make_address(endpoint.host, is_name);
    if (is_name) return std::nullopt;
    std::uint16_t port = 0;
    std::from_chars(endpoint.port.data(), endpoint.port.data() + endpoint.port.size(), port);
    return tcp::endpoint(address, port);
}

class TcpLine final : public DescriptorLine {
  public:
    TcpLine(const asio::any_io_executor& executor, rt::Clock& clock, Settings settings,
            TcpEndpoint endpoint)
        : DescriptorLine(executor, clock, std::move(settings)),
          endpoint_(std::move(endpoint)),
          lookup_(executor, endpoint_),
          socket_(executor),
          patience_(clock.make_alarm()) {}
    ~TcpLine() override { stop(); }

    Duration latency() override;
    void write(ByteView bytes) override;
    bool undelivered() override;

  private:
    void begin_open() override;
    void close_device(bool discard) override;
    std::string takes_nothing() const override { return "the connection takes nothing"; }
    std::optional<TimePoint> unacknowledged_since();
    void resolve();
    ssize_t put(ByteView bytes) override {
        return ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
    void cancel_open() override;
    void give_up();
    void connect(const NameLookup::Addresses& addresses);
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
    NameLookup lookup_;
    tcp::socket socket_;  ///< while it connects
    std::unique_ptr<rt::Alarm> patience_;
    std::uint64_t attempt_ = 0;
    TimePoint last_write_{};
    std::size_t last_size_ = 0;
    TimePoint older_{};  ///< of what had not been acknowledged when the last frame was written
};

void TcpLine::begin_open() {
    ++attempt_;
    patience_->arm(clock().now() + kConnectTimeout, [this] { give_up(); });
    const auto address = numeric(endpoint_);
    if (!address) return resolve();
    connect(NameLookup::Addresses::create(*address, endpoint_.host, endpoint_.port));
}

void TcpLine::give_up() {
    failed(lookup_.waits() ? "no name server tells its address (5 s)" : "no answer within 5 s");
}

void TcpLine::resolve() {
    lookup_.ask([this](const error_code& error, const NameLookup::Addresses& addresses) {
        if (error) return failed(error.message());
        connect(addresses);
    });
}

void TcpLine::connect(const NameLookup::Addresses& addresses) {
    asio::async_connect(socket_, addresses,
                        [this, current = current()](const error_code& error, const tcp::endpoint&) {
                            if (!current()) return;
                            if (error) return failed(error.message());
                            connected();
                        });
}

void TcpLine::connected() {
    ++attempt_;
    patience_->cancel();
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
    lookup_.cancel();
    patience_->cancel();
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

void TcpLine::write(ByteView bytes) {
    if (!is_open() || settings().listen_only) return;
    if (undelivered()) return reset(takes_nothing());  // what follows makes this frame the last one
    const TimePoint now = clock().now();
    older_ = unacknowledged_since().value_or(now);
    last_write_ = now;
    last_size_ = bytes.size();
    DescriptorLine::write(bytes);
}

/// When the oldest byte was written that the server's system has not acknowledged.
std::optional<TimePoint> TcpLine::unacknowledged_since() {
    int waiting = 0;
    if (::ioctl(fd(), SIOCOUTQ, &waiting) != 0 || waiting <= 0) return std::nullopt;
    return static_cast<std::size_t>(waiting) <= last_size_ ? last_write_ : older_;
}

bool TcpLine::undelivered() {
    if (!is_open()) return false;
    if (DescriptorLine::undelivered()) return true;
    const auto since = unacknowledged_since();
    return since && clock().now() - *since >= latency() + kDelayedAck;
}

/// Discarding needs a reset (RST): after a usual end the kernel goes on sending what it holds.
void TcpLine::close_device(bool discard) {
    const linger at_once{1, 0};
    if (discard) ::setsockopt(fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    DescriptorLine::close_device(discard);
}

}  // namespace

std::unique_ptr<Line> make_tcp_line(asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings) {
    TcpEndpoint endpoint = parse_tcp_device(settings.device).value_or(TcpEndpoint{});
    return std::make_unique<TcpLine>(executor, clock, std::move(settings), std::move(endpoint));
}

}  // namespace panelgate::line
