#include "panelgate/line/tcp_line.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/execution/outstanding_work.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/prefer.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <csignal>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "descriptor_line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/acceptor.hpp"

namespace panelgate::line {

/// Finds the addresses of one host. A name server may be silent for half a minute, and nobody can
/// take the question back: so each look-up has a thread of its own, at most one for an object, that
/// nobody waits for, also at the program's end. All else happens in the one thread that runs the
/// executor; nothing is told after cancel() or the object's end.
class NameLookup {
  public:
    using Addresses = boost::asio::ip::tcp::resolver::results_type;
    using Found =
        std::function<void(const boost::system::error_code& error, const Addresses& addresses)>;
    /// Threads of the whole program; who comes when all are held by silent servers is told to try
    /// again.
    static constexpr int kMostThreads = 64;

    NameLookup(boost::asio::any_io_executor executor, TcpEndpoint endpoint);
    ~NameLookup();
    NameLookup(const NameLookup&) = delete;
    NameLookup& operator=(const NameLookup&) = delete;

    /// Takes the place of what was asked before. A question that is still open is not asked twice:
    /// its answer is this one's, too.
    void ask(Found found);
    void cancel();
    bool waits() const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< the thread's share of it
};

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

struct NameLookup::State : std::enable_shared_from_this<NameLookup::State> {
    State(asio::any_io_executor e, TcpEndpoint of)
        : executor(std::move(e)), loop(executor), endpoint(std::move(of)) {}

    void start();
    void look_up();
    void tell(const error_code& error, const Addresses& addresses);

    asio::any_io_executor executor;
    std::mutex mutex;                           ///< of `loop`, all that the thread shares
    std::optional<asio::any_io_executor> loop;  ///< nothing: nobody is there any more
    const TcpEndpoint endpoint;
    std::optional<asio::any_io_executor> work;  ///< the loop has something to wait for
    Found found;
    bool under_way = false;
};

namespace {

std::atomic<int> threads;

/// The calling thread waits for as long as the system's resolver does.
std::pair<error_code, NameLookup::Addresses> resolve(const TcpEndpoint& endpoint) {
    asio::io_context own;
    tcp::resolver resolver(own);
    error_code error;
    auto addresses =
        resolver.resolve(endpoint.host, endpoint.port, tcp::resolver::numeric_service, error);
    return {error, std::move(addresses)};
}

}  // namespace

/// In the thread. The loop may have ended meanwhile, and only the lock tells.
void NameLookup::State::look_up() {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // they are the loop's
    auto [error, addresses] = resolve(endpoint);
    --threads;
    const std::lock_guard lock(mutex);
    if (!loop) return;
    asio::post(*loop, [self = shared_from_this(), why = error, results = std::move(addresses)] {
        self->tell(why, results);
    });
}

void NameLookup::State::start() {
    under_way = true;
    error_code failed;
    if (++threads > kMostThreads) {
        failed = asio::error::try_again;
    } else {
        try {
            std::thread([self = shared_from_this()] { self->look_up(); }).detach();
        } catch (const std::system_error& error) {
            failed = error.code();
        }
    }
    if (!failed) return;
    --threads;
    asio::post(executor, [self = shared_from_this(), failed] { self->tell(failed, {}); });
}

void NameLookup::State::tell(const error_code& error, const Addresses& addresses) {
    under_way = false;
    work.reset();
    if (const Found asked = std::exchange(found, nullptr)) asked(error, addresses);
}

NameLookup::NameLookup(asio::any_io_executor executor, TcpEndpoint endpoint)
    : state_(std::make_shared<State>(std::move(executor), std::move(endpoint))) {}

NameLookup::~NameLookup() {
    cancel();
    const std::lock_guard lock(state_->mutex);
    state_->loop.reset();
}

void NameLookup::ask(Found found) {
    state_->found = std::move(found);
    state_->work = asio::prefer(state_->executor, asio::execution::outstanding_work.tracked);
    if (!state_->under_way) state_->start();
}

void NameLookup::cancel() {
    state_->found = nullptr;
    state_->work.reset();
}

bool NameLookup::waits() const { return state_->found != nullptr; }

namespace {

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
