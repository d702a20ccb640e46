#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "beast_message.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/web/http/message.hpp"
#include "shared.hpp"

namespace panelgate::web {

/// Notices that a client has left while its request runs and nobody reads (P2). Whoever has only
/// closed its sending side gets its answer (P3), and looks like one that has left: it is asked now
/// and then by some bytes that clients step over, which the system of one that has left answers
/// with a reset. A part of what owns the socket, too.
class Departure {
  public:
    Departure(boost::asio::ip::tcp::socket& socket, Duration grace);

    /// `owner` holds this and the socket; it is kept until the socket is closed. `left` is called
    /// once at most, never from inside these calls.
    void start(std::shared_ptr<void> owner, std::function<void()> left);
    void request_runs();
    /// How it is asked; null: it cannot be.
    void ask_by(std::function<void()> ask) { ask_ = std::move(ask); }
    /// Its answer leaves now, or will not.
    void request_ends();

  private:
    void watch_input();
    void look_at_input();
    void ask_later();
    bool was_reset();
    void tell();

    boost::asio::ip::tcp::socket& socket_;
    Duration grace_;
    boost::asio::steady_timer timer_;
    std::weak_ptr<void> owner_;
    std::function<void()> left_;
    std::function<void()> ask_;
    bool running_ = false;
    bool watching_ = false;  ///< a wait of watch_input() is pending
};

/// One HTTP connection: reads a request, answers it, and again. Owned by the listener until run()
/// has ended; everything in the one thread.
class HttpSession : public std::enable_shared_from_this<HttpSession> {
  public:
    /// With `probes_only` it answers one request, and only of what is free.
    HttpSession(boost::asio::ip::tcp::socket socket, std::shared_ptr<Shared> shared,
                std::shared_ptr<Caller> caller, bool probes_only);

    /// Serves until the client goes away, breaks the protocol, is idle for too long, or stop().
    static boost::asio::awaitable<void> run(std::shared_ptr<HttpSession> self);
    /// Answers the request that runs, then closes; closes at once when none does. From now on a
    /// client has no longer than `reading` to take an answer.
    void stop(Duration reading);
    /// Where events are sent, the stream ends behind what waits.
    void end_events();
    /// The address of the other end.
    boost::asio::ip::address peer() const;
    /// Closes at once; whoever works for the client is told.
    void abandon();

  private:
    using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;
    using ErrorCode = boost::system::error_code;

    boost::asio::awaitable<ErrorCode> receive();
    boost::asio::awaitable<ErrorCode> receive_body();
    boost::asio::awaitable<bool> serve_one();
    boost::asio::awaitable<HttpResponse> answer(BeastRequest message);
    boost::asio::awaitable<HttpResponse> handle(HttpRequest request, std::optional<Problem> barred);
    boost::asio::awaitable<bool> refuse(ErrorCode why);
    boost::asio::awaitable<bool> send(HttpResponse response, bool head, bool keep_alive);
    boost::asio::awaitable<void> send_events(std::shared_ptr<EventHub::Listener> listener);
    boost::asio::awaitable<void> wait_for_ration(const HttpResponse* response);
    boost::asio::awaitable<void> drain();
    void set_busy(bool busy);
    void send_interim();
    void close();

    boost::beast::tcp_stream stream_;
    std::shared_ptr<Shared> shared_;
    std::shared_ptr<Caller> caller_;
    boost::asio::ip::address local_;  ///< at our end
    const bool probes_only_;
    boost::beast::flat_buffer buffer_;
    std::optional<Parser> parser_;
    Departure departure_;
    std::shared_ptr<EventHub::Listener> listener_;  ///< while events are sent
    bool asked_before_ = false;              ///< it is not the first request that is waited for
    bool sending_ = false;                   ///< an answer, or events
    boost::asio::steady_timer turn_;         ///< of its address
    boost::asio::steady_timer last_moment_;  ///< after stop(): to take the answer
    bool busy_ = false;                      ///< a whole request is here and not yet answered
    bool stopping_ = false;
    bool events_end_ = false;
    Duration time_to_read_;  ///< of an answer
};

}  // namespace panelgate::web
