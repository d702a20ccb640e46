#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <utility>

#include "panelgate/base/time.hpp"

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

}  // namespace panelgate::web
