#include "session.hpp"

#include <sys/socket.h>

#include <array>
#include <boost/asio/error.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <cerrno>
#include <exception>
#include <utility>

#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/problem.hpp"
#include "router.hpp"
#include "target.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace {

constexpr std::uint32_t kHeaderLimit = 16 * 1024;
constexpr std::size_t kReadSize = 4096;
/// What a client whose request was refused may still send before it is cut off.
constexpr std::size_t kDrainLimit = 1024 * 1024;
constexpr Duration kDrainTime = 2s;

using BeastRequest = http::request<http::string_body>;

HttpRequest to_request(BeastRequest&& message, Target target) {
    HttpRequest request;
    request.method = message.method_string();
    request.path = std::move(target.path);
    request.query = std::move(target.query);
    for (const char* name : kHeadersRead) {
        const auto field = message.find(name);
        if (field != message.end()) request.headers[name] = field->value();
    }
    request.body = std::move(message.body());
    return request;
}

template <class Message>
void set_head(Message& message, const HttpResponse& response, bool keep_alive,
              const std::string& product) {
    message.version(11);
    message.result(response.status);
    message.set(http::field::server, product);
    message.set(http::field::content_type, response.content_type);
    message.set(http::field::cache_control, "no-store");
    message.set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : response.headers) message.set(name, value);
    message.content_length(response.shared_body ? response.shared_body->size()
                                                : response.body.size());
    message.keep_alive(keep_alive);
}

Problem problem_of_parse(boost::system::error_code why, std::size_t max_body) {
    if (why == http::error::body_limit) {
        return problem(413, "a body has at most " + std::to_string(max_body) + " bytes");
    }
    if (why == http::error::header_limit || why == http::error::buffer_overflow) {
        return problem(431, "a header has at most " + std::to_string(kHeaderLimit) + " bytes");
    }
    return problem(400, "this is not an HTTP/1.1 request: " + why.message());
}

bool is_parse_error(boost::system::error_code why) {
    return why.category() == http::make_error_code(http::error::bad_method).category() &&
           why != http::error::end_of_stream && why != http::error::partial_message;
}

}  // namespace

HttpSession::HttpSession(asio::ip::tcp::socket socket, std::shared_ptr<const Site> site)
    : stream_(std::move(socket)),
      site_(std::move(site)),
      buffer_(kHeaderLimit + kReadSize + site_->settings.max_body) {
    boost::system::error_code ignored;
    stream_.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    boost::system::error_code gone;
    const auto peer = stream_.socket().remote_endpoint(gone);
    caller_ = std::make_shared<Caller>(site_->next_caller(),
                                       gone ? std::string() : peer.address().to_string());
}

asio::awaitable<void> HttpSession::run(std::shared_ptr<HttpSession> self) {
    bool more = true;
    while (more && !self->stopping_) more = co_await self->serve_one();
    self->abandon();
}

asio::awaitable<bool> HttpSession::serve_one() {
    const ErrorCode failed = co_await receive();
    if (is_parse_error(failed)) {
        const bool more = co_await refuse(failed);
        co_return more;
    }
    if (failed) co_return false;

    busy_ = true;
    BeastRequest message = parser_->release();
    const bool keep_alive = message.keep_alive();
    const bool head = message.method() == http::verb::head;
    auto target = parse_target(std::string(message.target()));
    HttpResponse response;
    if (target) {
        HttpRequest request = to_request(std::move(message), std::move(*target));
        request.caller = caller_;
        asio::awaitable<HttpResponse> handling = handle(std::move(request));
        response = co_await std::move(handling);
    } else {
        response = to_response(problem(400, "the request target cannot be understood"));
    }
    bool more = false;
    if (!caller_->has_left() && response.events && !head) {
        asio::awaitable<void> sending = send_events(std::move(response.events));
        co_await std::move(sending);
    } else if (!caller_->has_left()) {
        asio::awaitable<bool> sending = send(std::move(response), head, keep_alive && !stopping_);
        more = co_await std::move(sending);
    }
    busy_ = false;
    co_return more;
}

/// One whole request, into parser_.
asio::awaitable<boost::system::error_code> HttpSession::receive() {
    parser_.emplace();
    parser_->header_limit(kHeaderLimit);
    parser_->body_limit(site_->settings.max_body);
    ErrorCode error;
    if (buffer_.size() == 0) {
        stream_.expires_after(site_->settings.idle_timeout);
        const auto space = buffer_.prepare(kReadSize);
        const std::size_t n = co_await stream_.async_read_some(
            space, asio::redirect_error(asio::use_awaitable, error));
        if (error) co_return error;
        buffer_.commit(n);
    }
    stream_.expires_after(site_->settings.request_timeout);
    co_await http::async_read_header(stream_, buffer_, *parser_,
                                     asio::redirect_error(asio::use_awaitable, error));
    if (error || parser_->is_done()) co_return error;
    error = co_await receive_body();
    co_return error;
}

asio::awaitable<boost::system::error_code> HttpSession::receive_body() {
    ErrorCode error;
    if (beast::iequals(parser_->get()[http::field::expect], "100-continue")) {
        static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
        const asio::const_buffer text(kContinue.data(), kContinue.size());
        co_await asio::async_write(stream_, text, asio::redirect_error(asio::use_awaitable, error));
        if (error) co_return error;
    }
    co_await http::async_read(stream_, buffer_, *parser_,
                              asio::redirect_error(asio::use_awaitable, error));
    co_return error;
}

/// The handler's answer; exceptions end here.
asio::awaitable<HttpResponse> HttpSession::handle(HttpRequest request) {
    const std::string path = request.path.empty() ? "/" : request.path.front();
    std::string what;
    watch_for_departure();
    try {
        asio::awaitable<HttpResponse> handling = dispatch(std::move(request), site_.get());
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
    busy_ = true;
    HttpResponse response = to_response(problem_of_parse(why, site_->settings.max_body));
    asio::awaitable<bool> sending = send(std::move(response), false, false);
    co_await std::move(sending);
    co_await drain();
    co_return false;
}

/// Did it go out, and may another request follow?
asio::awaitable<bool> HttpSession::send(HttpResponse response, bool head, bool keep_alive) {
    ErrorCode error;
    stream_.expires_after(site_->settings.request_timeout);
    if (head || response.shared_body) {
        http::response<http::empty_body> message;
        set_head(message, response, keep_alive, site_->product);
        co_await http::async_write(stream_, message,
                                   asio::redirect_error(asio::use_awaitable, error));
        // In pieces of 64 KB, between which the loop serves others: Beast would hand the kernel all
        // of it at once.
        if (!error && !head) {
            const asio::const_buffer body = asio::buffer(*response.shared_body);
            co_await asio::async_write(stream_, body,
                                       asio::redirect_error(asio::use_awaitable, error));
        }
    } else {
        http::response<http::string_body> message;
        set_head(message, response, keep_alive, site_->product);
        message.body() = std::move(response.body);
        co_await http::async_write(stream_, message,
                                   asio::redirect_error(asio::use_awaitable, error));
    }
    co_return !error && keep_alive;
}

/// Until the client goes away or the server stops. A comment every 15 s keeps middle boxes from
/// forgetting the connection, and notices a client that has gone.
asio::awaitable<void> HttpSession::send_events(std::shared_ptr<EventHub::Listener> listener) {
    constexpr Duration kHeartbeat = 15s;
    asio::steady_timer bell(stream_.get_executor());
    listener->wake = [&bell] { bell.cancel(); };
    listener_ = listener;
    std::string text =
        "HTTP/1.1 200 OK\r\nServer: " + site_->product +
        "\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n"
        "X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n: panelgate\n\n";
    ErrorCode error;
    while (!error) {
        stream_.expires_after(site_->settings.request_timeout);
        co_await asio::async_write(stream_, asio::buffer(text),
                                   asio::redirect_error(asio::use_awaitable, error));
        if (error || listener->ended() || stopping_) break;
        text = listener->take();
        if (!text.empty()) continue;
        ErrorCode rung;
        bell.expires_after(kHeartbeat);
        co_await bell.async_wait(asio::redirect_error(asio::use_awaitable, rung));
        text = rung ? listener->take() : ": \n\n";
    }
    listener->wake = nullptr;
    listener_.reset();
}

/// Reads on after a refusal: closing with unread bytes would reset the connection, and the client
/// would lose the answer.
asio::awaitable<void> HttpSession::drain() {
    ErrorCode error;
    stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, error);
    stream_.expires_after(kDrainTime);
    std::array<char, kReadSize> waste;
    for (std::size_t total = 0; !error && total < kDrainLimit;) {
        total += co_await stream_.async_read_some(asio::buffer(waste),
                                                  asio::redirect_error(asio::use_awaitable, error));
    }
}

/// While a request runs nobody reads: this notices a client that goes away, so that what it asked
/// for leaves the queues. Stops looking once a pipelined request is there.
void HttpSession::watch_for_departure() {
    if (watching_ || !stream_.socket().is_open()) return;
    watching_ = true;
    auto self = shared_from_this();
    stream_.socket().async_wait(asio::ip::tcp::socket::wait_read, [self](ErrorCode error) {
        self->watching_ = false;
        if (error || !self->busy_ || !self->stream_.socket().is_open()) return;
        if (self->client_has_left()) self->abandon();
    });
}

bool HttpSession::client_has_left() {
    char byte = 0;
    const auto n = ::recv(stream_.socket().native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (n > 0) return false;
    if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return true;
    watch_for_departure();  // it was the beginning of this very request
    return false;
}

void HttpSession::stop() {
    stopping_ = true;
    if (listener_ && listener_->wake) listener_->wake();
    if (!busy_) close();
}

void HttpSession::abandon() {
    stopping_ = true;
    if (listener_ && listener_->wake) listener_->wake();
    caller_->leave();
    close();
}

void HttpSession::close() {
    if (stream_.socket().is_open()) stream_.close();
}

}  // namespace panelgate::web
