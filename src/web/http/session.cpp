#include "session.hpp"

#include <sys/socket.h>
#include <algorithm>
#include <array>
#include <boost/asio/error.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/system/error_code.hpp>
#include <exception>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "origin.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/peer.hpp"
#include "panelgate/web/http/problem.hpp"
#include "router.hpp"

namespace panelgate::web {

using boost::asio::ip::tcp;
using boost::system::error_code;

Departure::Departure(tls::Stream& stream, Duration grace)
    : stream_(stream), socket_(stream.socket()), grace_(grace), timer_(stream.get_executor()) {}

/// A reset is reported even with unread input.
void Departure::start(std::shared_ptr<void> owner, std::function<void()> left) {
    owner_ = owner;
    left_ = std::move(left);
    socket_.async_wait(tcp::socket::wait_error, [this, owner](const error_code& cancelled) {
        if (!cancelled && was_reset()) tell();
    });
}

void Departure::request_runs() {
    running_ = true;
    watch_input();
}

void Departure::request_ends() {
    running_ = false;
    timer_.cancel();
}

/// Stops watching once a pipelined request has arrived.
void Departure::watch_input() {
    if (watching_ || !socket_.is_open()) return;
    watching_ = true;
    socket_.async_wait(tcp::socket::wait_read,
                       [this, owner = owner_.lock()](const error_code& error) {
                           watching_ = false;
                           if (!error && running_ && socket_.is_open()) look_at_input();
                       });
}

void Departure::look_at_input() {
    switch (stream_.look()) {
        case tls::Stream::Input::bytes:  // with TLS they may announce the end
            if (stream_.is_secure()) ask_later();
            return;
        case tls::Stream::Input::end:
            return ask_later();
        case tls::Stream::Input::broken:
            return tell();
        case tls::Stream::Input::none:
            return watch_input();  // it was the rest of this request
    }
}

void Departure::ask_later() {
    timer_.expires_after(grace_);
    timer_.async_wait([this, owner = owner_.lock()](const error_code& cancelled) {
        if (cancelled || !running_ || !socket_.is_open()) return;
        if (ask_ && stream_.look() != tls::Stream::Input::bytes) ask_();
        ask_later();
    });
}

/// The wait also ends when both directions are shut down.
bool Departure::was_reset() {
    int why = 0;
    socklen_t size = sizeof why;
    const int socket = socket_.native_handle();
    return ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &why, &size) != 0 || why != 0;
}

void Departure::tell() {
    if (const auto left = std::exchange(left_, nullptr)) left();
}

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace {

constexpr std::size_t kReadSize = 4096;
constexpr std::size_t kWhole = 64 * 1024;  ///< bytes of a body sent in one piece
/// What a client may still send after a refusal before the connection is cut.
constexpr std::size_t kDrainLimit = 1024 * 1024;
constexpr Duration kDrainTime = 2s;
/// Send buffer for events, in bytes, so that a slow client learns in time what it has lost: the
/// kernel's default buffers megabytes.
constexpr int kEventSendBuffer = 128 * 1024;
constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

Problem no_place() {
    return passing_problem(503, "all places of this server are taken; only probes are answered", 1);
}

HttpResponse too_many_streams(decltype(HttpResponse::headers) headers) {
    HttpResponse response = to_response(
        passing_problem(503, "this address streams events on as many connections as it may", 5));
    std::ranges::move(headers, std::back_inserter(response.headers));
    return response;
}

}  // namespace

HttpSession::HttpSession(tls::Stream stream, std::shared_ptr<Shared> shared,
                         std::shared_ptr<Caller> caller, bool probes_only)
    : stream_(std::move(stream)),
      shared_(std::move(shared)),
      caller_(std::move(caller)),
      probes_only_(probes_only),
      buffer_(kHeaderLimit + kReadSize + shared_->site->settings.max_body),
      departure_(stream_, shared_->site->settings.half_close_grace),
      final_send_timer_(stream_.get_executor()),
      time_to_read_(shared_->site->settings.request_timeout) {
    ErrorCode ignored;
    stream_.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    local_ = stream_.socket().local_endpoint(ignored).address();
    take_certificate();
}

asio::awaitable<void> HttpSession::run(std::shared_ptr<HttpSession> self) {
    self->departure_.start(self, [session = self.get()] { session->abandon(); });
    bool more = true;
    while (more && !self->stopping_) more = co_await self->serve_one();
    self->abandon();
}

void HttpSession::take_certificate() {
    const tls::Peer& peer = stream_.peer();
    if (!peer.shown) return;
    const Settings& settings = shared_->site->settings;
    const auto role = tls::certified_role(settings.tls, peer);
    if (role && !role->doubt.empty())
        rt::log(rt::LogLevel::warn, "certificate without a role",
                {{"listener", settings.name()},
                 {"client", caller_->name()},
                 {"subject", peer.subject},
                 {"reason", role->doubt}});
    caller_->certify(peer.subject, role ? role->word : "",
                     role ? std::optional(role->standing) : std::nullopt);
}

asio::awaitable<bool> HttpSession::serve_one() {
    const ErrorCode failed = co_await receive();
    if (is_parse_error(failed)) {
        const bool more = co_await refuse(failed);
        co_return more;
    }
    if (failed) co_return false;

    set_busy(true);
    BeastRequest message = parser_->release();
    const bool keep_alive = message.keep_alive() && !probes_only_;
    const bool head = message.method() == http::verb::head;
    asio::awaitable<HttpResponse> answering = answer(std::move(message));
    HttpResponse response = co_await std::move(answering);
    bool more = false;
    if (response.events && !head && !shared_->places.stream(caller_->id()))
        response = too_many_streams(std::move(response.headers));
    if (!caller_->has_left() && response.events && !head) {
        asio::awaitable<void> sending = send_events(std::move(response));
        co_await std::move(sending);
    } else if (!caller_->has_left()) {
        const bool stays = keep_alive && !stopping_;
        asio::awaitable<bool> sending = send(std::move(response), head, stays);
        more = co_await std::move(sending);
    }
    if (probes_only_ && !caller_->has_left()) co_await drain();
    set_busy(false);
    co_return more;
}

asio::awaitable<HttpResponse> HttpSession::answer(BeastRequest message) {
    auto target = target_of(message);
    if (!target) co_return to_response(problem(400, "the request target cannot be understood"));
    if (const auto repeated = repeated_field(message)) co_return to_response(*repeated);
    auto host = host_of(message, *target);
    std::optional<Problem> barred;
    if (!host) barred = host.error();
    // Probes need no Host; a duplicate or invalid one is an error even there.
    if (barred && message.count(http::field::host) > 0) co_return to_response(*barred);
    departure_.ask_by(nullptr);
    if (message.version() >= 11) departure_.ask_by([this] { send_interim(); });
    HttpRequest request =
        to_request(std::move(message), std::move(*target), host ? *host : std::string());
    request.caller = caller_;
    reader_ = listed_origin(request, shared_->site->settings.cors);
    const bool preflight = request.method == "OPTIONS";
    asio::awaitable<HttpResponse> handling = handle(std::move(request), std::move(barred));
    HttpResponse response = co_await std::move(handling);
    if (!reader_.empty()) share_with(reader_, preflight, response);
    co_return response;
}

void HttpSession::set_busy(bool busy) {
    busy_ = busy;
    if (busy) {
        shared_->places.busy(caller_->id());
        departure_.request_runs();
    } else {
        shared_->places.idle(caller_->id());
        departure_.request_ends();
    }
}

/// Sent before the reply: the socket buffer is empty, so it is written whole. Clients skip it (RFC
/// 9110 15.2).
void HttpSession::send_interim() { stream_.write_aside(asio::buffer(kContinue)); }

/// Reads one complete request into parser_.
asio::awaitable<boost::system::error_code> HttpSession::receive() {
    parser_.emplace();
    parser_->header_limit(kHeaderLimit);
    parser_->body_limit(kLongBody);
    ErrorCode error;
    if (buffer_.size() == 0) {
        const Settings& settings = shared_->site->settings;
        stream_.expires_after(asked_before_ ? settings.idle_timeout
                                            : settings.first_request_timeout);
        const auto space = buffer_.prepare(kReadSize);
        const std::size_t n = co_await stream_.async_read_some(
            space, asio::redirect_error(asio::use_awaitable, error));
        if (error) co_return error;
        buffer_.commit(n);
        if (!stream_.is_secure() && speaks_tls()) co_return asio::error::no_protocol_option;
    }
    asked_before_ = true;
    stream_.expires_after(shared_->site->settings.request_timeout);
    co_await http::async_read_header(stream_, buffer_, *parser_,
                                     asio::redirect_error(asio::use_awaitable, error));
    if (!error && !has_sound_framing(parser_->get())) error = http::error::bad_transfer_encoding;
    if (error || parser_->is_done()) co_return error;
    if (!limit_body()) co_return http::error::body_limit;
    // Beast would merge the trailer, whose fields must not count (RFC 9110 6.5.1).
    http::request_header<> head = parser_->get().base();
    error = co_await receive_body();
    parser_->get().base() = std::move(head);
    co_return error;
}

/// False for a body that is too long. A long one is waited for only of who may send it.
bool HttpSession::limit_body() {
    std::size_t most = shared_->site->settings.max_body;
    const std::uint64_t length = parser_->content_length().value_or(0);
    auto target = length > most ? target_of(parser_->get()) : std::nullopt;
    if (target) {
        HttpRequest head = to_request(BeastRequest(parser_->get()), std::move(*target), {});
        head.caller = caller_;
        most = longest_body(std::move(head), *shared_);
    }
    parser_->body_limit(most);
    return length <= most;
}

/// True, and logged, for the first bytes of a TLS handshake.
bool HttpSession::speaks_tls() const {
    const auto* const bytes = static_cast<const unsigned char*>(buffer_.data().data());
    if (asked_before_ || buffer_.size() < 3 || bytes[0] != 0x16 || bytes[1] != 3) return false;
    rt::log(rt::LogLevel::warn, "connection closed",
            {{"listener", shared_->site->settings.name()},
             {"client", caller_->address()},
             {"reason", "it speaks TLS; write http:// in its address, or give http: tls"}});
    return true;
}

asio::awaitable<boost::system::error_code> HttpSession::receive_body() {
    ErrorCode error;
    if (beast::iequals(parser_->get()[http::field::expect], "100-continue")) {
        const asio::const_buffer text(kContinue.data(), kContinue.size());
        co_await asio::async_write(stream_, text, asio::redirect_error(asio::use_awaitable, error));
        if (error) co_return error;
    }
    co_await http::async_read(stream_, buffer_, *parser_,
                              asio::redirect_error(asio::use_awaitable, error));
    co_return error;
}

/// Runs the handler; its exceptions end here.
asio::awaitable<HttpResponse> HttpSession::handle(HttpRequest request,
                                                  std::optional<Problem> barred) {
    const std::shared_ptr<const Site> site = shared_->site;  // until this request ends
    const std::string path = request.path.empty() ? "/" : request.path.front();
    std::string what;
    if (!barred) barred = check_origin(request, shared_->hosts, local_, site->settings.cors);
    if (probes_only_) barred = no_place();
    try {
        asio::awaitable<HttpResponse> handling =
            dispatch(std::move(request), shared_.get(), barred);
        HttpResponse response = co_await std::move(handling);
        co_return response;
    } catch (const std::exception& error) {
        what = error.what();
    }
    if (!caller_->has_left()) {
        rt::log(rt::LogLevel::error, "http handler failed", {{"path", path}, {"error", what}});
    }
    co_return to_response(problem(500, "the gateway failed to handle this request"));
}

asio::awaitable<bool> HttpSession::refuse(ErrorCode why) {
    set_busy(true);
    HttpResponse response = to_response(problem_of_parse(why, shared_->site->settings.max_body));
    asio::awaitable<bool> sending = send(std::move(response), false, false);
    co_await std::move(sending);
    co_await drain();
    co_return false;
}

namespace {

/// Bytes of a long body that is being sent, which count for all clients together.
class Sending {
  public:
    Sending(const HttpResponse& response, std::shared_ptr<Shared> shared)
        : shared_(std::move(shared)), bytes_(size_of(response)) {
        shared_->sending += bytes_;
    }
    ~Sending() { shared_->sending -= bytes_; }
    Sending(const Sending&) = delete;
    Sending& operator=(const Sending&) = delete;

    static bool is_too_much(const HttpResponse& response, const Shared& shared) {
        const std::size_t bytes = size_of(response);
        return bytes > 0 && shared.sending + bytes > shared.site->settings.max_sending;
    }

  private:
    static std::size_t size_of(const HttpResponse& response) {
        return response.body.size() > kWhole ? response.body.size() : 0;
    }

    std::shared_ptr<Shared> shared_;
    std::size_t bytes_;
};

}  // namespace

/// Sends the reply; true if another request may follow.
asio::awaitable<bool> HttpSession::send(HttpResponse response, bool head, bool keep_alive) {
    if (Sending::is_too_much(response, *shared_))
        response = to_response(passing_problem(503, "too much is being sent; try again", 1));
    const Sending sending(response, shared_);
    ErrorCode error;
    departure_.request_ends();
    ++shared_->counters.requests[response.status];
    sending_ = true;
    stream_.expires_after(time_to_read_);
    if (!response.shared_body && response.body.size() > kWhole)
        response.shared_body = std::make_shared<const std::string>(std::move(response.body));
    if (head || response.shared_body) {
        http::response<http::empty_body> message;
        set_head(message, response, keep_alive, shared_->site->product, stream_.is_secure());
        co_await http::async_write(stream_, message,
                                   asio::redirect_error(asio::use_awaitable, error));
        // In pieces of 64 KB, between which the loop serves others: Beast would pass the whole body
        // to the kernel at once.
        if (!error && !head) {
            const asio::const_buffer body = asio::buffer(*response.shared_body);
            co_await asio::async_write(stream_, body,
                                       asio::redirect_error(asio::use_awaitable, error));
        }
    } else {
        http::response<http::string_body> message;
        set_head(message, response, keep_alive, shared_->site->product, stream_.is_secure());
        message.body() = std::move(response.body);
        co_await http::async_write(stream_, message,
                                   asio::redirect_error(asio::use_awaitable, error));
    }
    sending_ = false;
    final_send_timer_.cancel();
    co_return !error && keep_alive;
}

std::string HttpSession::head_of_events(const HttpResponse& response) const {
    std::string more;
    for (const auto& [name, value] : response.headers) more += name + ": " + value + "\r\n";
    return "HTTP/1.1 200 OK\r\nServer: " + shared_->site->product +
           "\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n"
           "X-Content-Type-Options: nosniff\r\n" +
           (stream_.is_secure()
                ? "Strict-Transport-Security: " + std::string(kStrictTransport) + "\r\n"
                : "") +
           more + "Connection: close\r\n\r\n: panelgate\n\n";
}

/// Streams events until the client leaves, its token expires or the server stops. A comment now and
/// then keeps middleboxes from dropping the connection and detects a lost client.
asio::awaitable<void> HttpSession::send_events(HttpResponse response) {
    ++shared_->counters.requests[200];
    sending_ = true;
    bool asked = false;
    ErrorCode ignored;
    stream_.socket().set_option(asio::socket_base::send_buffer_size(kEventSendBuffer), ignored);
    asio::steady_timer wake_timer(stream_.get_executor());
    const std::shared_ptr<EventHub::Listener> listener = std::move(response.events);
    listener->wake = [&wake_timer] { wake_timer.cancel(); };
    departure_.ask_by([&] {
        asked = true;
        wake_timer.cancel();
    });
    listener_ = listener;
    std::string text = head_of_events(response);
    ErrorCode error;
    while (!error && to_heartbeat() > Duration::zero()) {
        stream_.expires_after(time_to_read_);
        co_await asio::async_write(stream_, asio::buffer(text),
                                   asio::redirect_error(asio::use_awaitable, error));
        if (error) break;
        text = listener->take();
        if (!text.empty()) continue;
        if (listener->ended() || stopping_ || events_end_) break;
        ErrorCode rung;
        wake_timer.expires_after(to_heartbeat());
        co_await wake_timer.async_wait(asio::redirect_error(asio::use_awaitable, rung));
        text = rung ? listener->take() : listener->heartbeat();
        if (text.empty() && std::exchange(asked, false)) text = listener->heartbeat();
    }
    departure_.ask_by(nullptr);
    listener->wake = nullptr;
    listener_.reset();
    sending_ = false;
    final_send_timer_.cancel();
}

/// Reads on after a refusal: closing with unread input would reset the connection, and the client
/// would lose the reply.
asio::awaitable<void> HttpSession::drain() {
    ErrorCode error;
    stream_.shutdown_send();
    stream_.expires_after(kDrainTime);
    std::array<char, kReadSize> waste;
    for (std::size_t total = 0; !error && total < kDrainLimit;) {
        total += co_await stream_.async_read_some(asio::buffer(waste),
                                                  asio::redirect_error(asio::use_awaitable, error));
    }
}

void HttpSession::end_events() {
    events_end_ = listener_ != nullptr;
    if (listener_ && listener_->wake) listener_->wake();
}

asio::ip::address HttpSession::peer() const {
    ErrorCode gone;
    return stream_.socket().remote_endpoint(gone).address();
}

void HttpSession::stop(Duration reading) {
    stopping_ = true;
    time_to_read_ = std::min(time_to_read_, reading);
    if (listener_ && listener_->wake) listener_->wake();
    if (!busy_) close();
    if (!sending_) return;
    final_send_timer_.expires_after(time_to_read_);
    final_send_timer_.async_wait([self = weak_from_this()](const ErrorCode& cancelled) {
        const auto session = self.lock();
        if (session && !cancelled && session->sending_) session->abandon();
    });
}

void HttpSession::abandon() {
    stopping_ = true;
    if (listener_ && listener_->wake) listener_->wake();
    caller_->leave();
    departure_.request_ends();
    close();
}

void HttpSession::close() { stream_.close(); }

}  // namespace panelgate::web
