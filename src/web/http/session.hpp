#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "beast_message.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/tls/stream.hpp"
#include "panelgate/web/http/message.hpp"
#include "router.hpp"
#include "shared.hpp"

namespace panelgate::web {

/// Detects that a client has left while its request runs and the session does not read (P2). A
/// half-closed client still gets its reply (P3) but looks the same, so it is probed now and then
/// with bytes that clients skip; the system of one that has left answers with a reset. Owned
/// together with the stream.
class Departure {
  public:
    Departure(tls::Stream& stream, Duration grace);

    /// `owner` owns this and the socket; kept until the socket is closed. `left` is called at most
    /// once, never from inside these calls.
    void start(std::shared_ptr<void> owner, std::function<void()> left);
    void request_runs();
    /// Sets how the client is probed; null: not possible.
    void ask_by(std::function<void()> ask) { ask_ = std::move(ask); }
    /// The reply is being sent, or will not be.
    void request_ends();

  private:
    void watch_input();
    void look_at_input();
    void ask_later();
    bool was_reset();
    void tell();

    tls::Stream& stream_;
    boost::asio::ip::tcp::socket& socket_;  ///< its socket
    Duration grace_;
    boost::asio::steady_timer timer_;
    std::weak_ptr<void> owner_;
    std::function<void()> left_;
    std::function<void()> ask_;
    bool running_ = false;
    bool watching_ = false;  ///< a wait of watch_input() is pending
};

/// One HTTP connection: reads and answers requests one after another. Owned by the listener until
/// run() has ended; single-threaded.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
  public:
    /// With TLS the handshake is over. `probes_only`: a single request is answered, and only a
    /// probe.
    HttpSession(tls::Stream stream, std::shared_ptr<Shared> shared, std::shared_ptr<Caller> caller,
                bool probes_only);

    /// Serves until the client leaves, breaks the protocol or is idle for too long, or until
    /// stop().
    static boost::asio::awaitable<void> run(std::shared_ptr<HttpSession> self);
    /// Answers the running request, then closes; without one, closes at once. From now on a client
    /// has at most `reading` to take a reply.
    void stop(Duration reading);
    const Caller& caller() const { return *caller_; }
    /// The origin of the last request's page, if `cors` lists that origin; else empty.
    const std::string& reader() const { return reader_; }
    const tls::Stream& stream() const { return stream_; }
    /// Takes over what its certificate says, by the listener's present settings.
    void take_certificate();
    /// Ends an event stream after the pending events.
    void end_events();
    /// Returns the peer's address.
    boost::asio::ip::address peer() const;
    /// Closes at once and notifies those working for the client.
    void abandon();

  private:
    using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;
    using ErrorCode = boost::system::error_code;

    boost::asio::awaitable<ErrorCode> receive();
    bool speaks_tls() const;
    std::string head_of_events(const HttpResponse& response) const;
    bool limit_body();
    boost::asio::awaitable<ErrorCode> receive_body();
    boost::asio::awaitable<bool> serve_one();
    boost::asio::awaitable<HttpResponse> answer(BeastRequest message);
    boost::asio::awaitable<HttpResponse> handle(HttpRequest request, std::optional<Problem> barred);
    boost::asio::awaitable<bool> refuse(ErrorCode why);
    boost::asio::awaitable<bool> send(HttpResponse response, bool head, bool keep_alive);
    /// Of an event stream; zero: its client's token has expired.
    Duration to_heartbeat() const {
        constexpr Duration kHeartbeat = 15s;
        return time_of_token(caller_->token(), *shared_->site, kHeartbeat);
    }
    boost::asio::awaitable<void> send_events(HttpResponse response);
    boost::asio::awaitable<void> drain();
    void set_busy(bool busy);
    void send_interim();
    void close();

    tls::Stream stream_;
    std::shared_ptr<Shared> shared_;
    std::shared_ptr<Caller> caller_;
    boost::asio::ip::address local_;  ///< local address
    std::string reader_;
    bool probes_only_;
    boost::beast::flat_buffer buffer_;
    std::optional<Parser> parser_;
    Departure departure_;
    std::shared_ptr<EventHub::Listener> listener_;  ///< while events are sent
    bool asked_before_ = false;                     ///< not the first request
    bool sending_ = false;                          ///< a reply or events
    boost::asio::steady_timer
        final_send_timer_;  ///< after stop(): the client's time to take the reply
    bool busy_ = false;     ///< a complete request is not answered yet
    bool stopping_ = false;
    bool events_end_ = false;
    Duration time_to_read_;  ///< the client's time to take a reply
};

}  // namespace panelgate::web
