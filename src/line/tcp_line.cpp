#include "panelgate/line/tcp_line.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <algorithm>
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
#include <cerrno>
#include <charconv>
#include <csignal>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "descriptor_line.hpp"
#include "mbap.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/rt/acceptor.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/context.hpp"

namespace panelgate::line {

/// Resolves one host name. A name server may be silent for half a minute, and a query cannot be
/// cancelled: so each look-up has its own thread, at most one per object, which is never joined,
/// not even at the program's end. Everything else runs in the executor's thread; no callback after
/// cancel() or the object's end.
class NameLookup {
  public:
    using Addresses = boost::asio::ip::tcp::resolver::results_type;
    using Found =
        std::function<void(const boost::system::error_code& error, const Addresses& addresses)>;
    /// Limit for the whole program; if silent servers occupy all threads, a look-up fails with
    /// try_again.
    static constexpr int kMostThreads = 64;

    NameLookup(boost::asio::any_io_executor executor, TcpEndpoint endpoint);
    ~NameLookup();
    NameLookup(const NameLookup&) = delete;
    NameLookup& operator=(const NameLookup&) = delete;

    /// Starts a look-up and replaces the previous one. A pending query is not sent twice: its
    /// answer serves this call, too.
    void ask(Found found);
    void cancel();
    bool waits() const;

  private:
    struct State;
    std::shared_ptr<State> state_;  ///< shared with the thread
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
    std::mutex mutex;                           ///< guards `loop`, all that the thread shares
    std::optional<asio::any_io_executor> loop;  ///< std::nullopt: the owner is gone
    const TcpEndpoint endpoint;
    std::optional<asio::any_io_executor> work;  ///< keeps the loop running
    Found found;
    bool under_way = false;
};

namespace {

std::atomic<int> threads;

/// Blocks the calling thread for as long as the system's resolver takes.
std::pair<error_code, NameLookup::Addresses> resolve(const TcpEndpoint& endpoint) {
    asio::io_context own;
    tcp::resolver resolver(own);
    error_code error;
    auto addresses =
        resolver.resolve(endpoint.host, endpoint.port, tcp::resolver::numeric_service, error);
    return {error, std::move(addresses)};
}

}  // namespace

/// Runs in the thread. The loop may have ended meanwhile: check under the lock.
void NameLookup::State::look_up() {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // signals are the loop's
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

/// TCP_USER_TIMEOUT: how long the kernel retries bytes that the server does not acknowledge, or has
/// no room for. The default, 15 minutes, would keep the line up without a server. Five
/// retransmissions fit in (after 0.2, 0.6, 1.4, 3 and 6.2 s, the last one at the limit).
constexpr std::chrono::seconds kPatience{6};

/// Keep-alive of an idle connection. TCP_USER_TIMEOUT ends it too, in place of the number of
/// probes: so the first is early enough for three of them. A lost server is noticed in that time
/// also while the line is idle.
constexpr rt::KeepAlive kKeepAlive{3s, 1s, 3};
static_assert(kKeepAlive.silence + kKeepAlive.probes * kKeepAlive.pause <= kPatience);

/// A server may delay an acknowledgement until it has data to send: Linux and Windows up to 200 ms.
/// Before that, a missing acknowledgement proves nothing.
constexpr Duration kDelayedAck = 200ms;

void set_options(int fd) {
    rt::set_up_socket(fd, kKeepAlive);
    const int patience = static_cast<int>(std::chrono::milliseconds(kPatience).count());
    ::setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &patience, sizeof patience);
}

/// std::nullopt for a name. A numeric address needs no look-up, and no thread for it.
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
          mbap_(this->settings().as_rtu ? std::optional<Mbap>(std::in_place) : std::nullopt),
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
    std::string blocked_reason() const override { return "the connection takes nothing"; }
    std::optional<TimePoint> unacknowledged_since();
    void resolve();
    ssize_t get(std::span<std::uint8_t> room) override;
    ssize_t put(ByteView bytes) override {
        return tls_ ? tls_->write(bytes) : ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
    ssize_t get_bytes(std::span<std::uint8_t> room) {
        return tls_ ? tls_->read(room) : DescriptorLine::get(room);
    }
    void was_lost(bool unanswered) override;
    void cancel_open() override;
    void give_up();
    void connect(const NameLookup::Addresses& addresses);
    void secure();
    void shake();
    void connected();
    void failed(const std::string& why) {
        const std::string text = "cannot reach " + settings().device + ": " + why;
        cancel_open();  // ends the TLS session, whose text `why` may be
        open_failed(text);
    }
    /// For completions: true if their attempt is still the current one.
    auto current() const {
        return
            [alive = alive(), this, attempt = attempt_] { return *alive && attempt == attempt_; };
    }

    ssize_t get_replies(std::span<std::uint8_t> room);

    TcpEndpoint endpoint_;
    std::optional<Mbap> mbap_;  ///< of a Modbus/TCP device whose user speaks RTU
    NameLookup lookup_;
    tcp::socket socket_;  ///< while it connects
    std::unique_ptr<tls::ClientEnd> tls_;
    std::unique_ptr<rt::Alarm> patience_;
    std::uint64_t attempt_ = 0;
    TimePoint last_write_{};
    std::size_t last_size_ = 0;
    TimePoint older_{};       ///< of the bytes unacknowledged at the last write
    bool has_begun_ = false;  ///< the first bytes of this connection were looked at
    int hang_ups_ = 0;        ///< connections in a row that ended without an answer
    bool told_telnet_ = false;
    bool told_hang_ups_ = false;
};

void TcpLine::begin_open() {
    ++attempt_;
    patience_->arm(clock().now() + kConnectTimeout, [this] { give_up(); });
    const auto address = numeric(endpoint_);
    if (!address) return resolve();
    connect(NameLookup::Addresses::create(*address, endpoint_.host, endpoint_.port));
}

void TcpLine::give_up() {
    failed(lookup_.waits() ? "no name server resolves its address (5 s)" : "no answer within 5 s");
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
                            settings().tls ? secure() : connected();
                        });
}

void TcpLine::secure() {
    error_code ignored;
    socket_.non_blocking(true, ignored);
    try {
        tls_ = std::make_unique<tls::ClientEnd>(
            std::make_shared<const tls::ClientContext>(*settings().tls, endpoint_.host),
            endpoint_.host, socket_.native_handle());
    } catch (const tls::Unusable& why) {
        return failed(why.what());
    }
    shake();
}

void TcpLine::shake() {
    using Step = tls::ClientEnd::Step;
    const Step step = tls_->shake();
    if (step == Step::done) return connected();
    if (step == Step::failed) return failed(tls_->why());
    socket_.async_wait(step == Step::wants_input ? tcp::socket::wait_read : tcp::socket::wait_write,
                       [this, current = current()](const error_code& error) {
                           if (!current()) return;
                           error ? failed(error.message()) : shake();
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
    has_begun_ = false;
    set_telnet(false);
    if (mbap_) mbap_->restart();
    opened();
}

void TcpLine::cancel_open() {
    ++attempt_;
    tls_.reset();
    lookup_.cancel();
    patience_->cancel();
    error_code ignored;
    socket_.close(ignored);
}

/// The kernel's round-trip time plus four times its variation: the same allowance as TCP's own (RFC
/// 6298).
Duration TcpLine::latency() {
    tcp_info info{};
    socklen_t size = sizeof info;
    if (!is_open() || ::getsockopt(fd(), IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
    return std::chrono::microseconds(info.tcpi_rtt + 4 * info.tcpi_rttvar);
}

namespace {

/// True for telnet's IAC with WILL, WONT, DO or DONT (RFC 854). A server negotiates before
/// anything else (ser2net#30, teraterm#916).
bool begins_like_telnet(ByteView bytes) {
    constexpr std::uint8_t kIac = 0xFF;
    constexpr std::uint8_t kWill = 0xFB;
    return bytes.size() >= 2 && bytes[0] == kIac && bytes[1] >= kWill && bytes[1] != kIac;
}

}  // namespace

ssize_t TcpLine::get_replies(std::span<std::uint8_t> room) {
    const ssize_t size = get_bytes(room.first(std::min(room.size(), Mbap::kRead)));
    if (size <= 0) return size;
    const auto frames = mbap_->replies(room.first(static_cast<std::size_t>(size)));
    errno = frames ? EAGAIN : EPROTO;
    if (!frames || frames->empty()) return -1;
    std::ranges::copy(*frames, room.begin());
    return static_cast<ssize_t>(frames->size());
}

ssize_t TcpLine::get(std::span<std::uint8_t> room) {
    if (mbap_) return get_replies(room);
    const ssize_t size = get_bytes(room);
    if (size <= 0 || settings().modbus_tcp || std::exchange(has_begun_, true)) return size;
    const bool telnet = begins_like_telnet(room.first(static_cast<std::size_t>(size)));
    set_telnet(telnet);
    if (telnet && !std::exchange(told_telnet_, true))
        rt::log(rt::LogLevel::warn, "device server speaks telnet",
                {{"device", settings().device},
                 {"advice",
                  "set its port to raw TCP, without telnet and RFC 2217 (ser2net: "
                  "accepter tcp)"}});
    return size;
}

/// A box in Modbus/TCP mode takes RTU frames for broken headers and hangs up
/// (node-modbus-serial#171, tf03mqtt#4).
void TcpLine::was_lost(bool unanswered) {
    constexpr int kMany = 3;
    hang_ups_ = unanswered ? hang_ups_ + 1 : 0;
    if (hang_ups_ < kMany || std::exchange(told_hang_ups_, true)) return;
    rt::log(rt::LogLevel::warn, "device server hangs up on requests",
            {{"device", settings().device},
             {"advice", settings().modbus_tcp
                            ? "it may speak RTU over TCP (write tcp://), or another client has "
                              "its only connection"
                            : "set its mode to raw (transparent): one that speaks Modbus/TCP "
                              "refuses RTU frames; or another client has its port"}});
}

void TcpLine::write(ByteView bytes) {
    if (!is_open() || settings().listen_only) return;
    if (undelivered()) return reset(blocked_reason());  // the rest makes this frame the last one
    const TimePoint now = clock().now();
    older_ = unacknowledged_since().value_or(now);
    last_write_ = now;
    const Bytes adu = mbap_ ? mbap_->request(bytes) : Bytes();
    const ByteView sent = mbap_ ? ByteView(adu) : bytes;
    last_size_ = sent.size();
    DescriptorLine::write(sent);
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

/// Discarding needs a reset (RST): after a normal close the kernel goes on sending its buffer.
void TcpLine::close_device(bool discard) {
    const linger at_once{1, 0};
    if (discard) ::setsockopt(fd(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    tls_.reset();
    DescriptorLine::close_device(discard);
}

}  // namespace

std::unique_ptr<Line> make_tcp_line(asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings) {
    TcpEndpoint endpoint = parse_tcp_device(settings.device).value_or(TcpEndpoint{});
    return std::make_unique<TcpLine>(executor, clock, std::move(settings), std::move(endpoint));
}

}  // namespace panelgate::line
