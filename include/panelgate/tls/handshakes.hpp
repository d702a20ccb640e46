#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <list>
#include <memory>
#include <string>

#include "panelgate/base/network.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/counters.hpp"
#include "panelgate/tls/settings.hpp"
#include "panelgate/tls/stream.hpp"

namespace panelgate::tls {

/// The handshakes of a listener. Their number is bounded: beyond the limit of an address (HostKey)
/// its oldest handshake gives way, beyond the limit of all the oldest handshake of the addresses
/// with most; a handshake that waits for its turn gives way after those that wait for their client.
/// A handshake has `handshake_timeout`, costs no OpenSSL object before the client's first bytes,
/// and then waits for its turn: one begins each 20 ms, so that a flood leaves the loop to the
/// lines. One thread.
class Handshakes : public std::enable_shared_from_this<Handshakes> {
  public:
    /// Takes a connection whose handshake is done.
    using Done = std::function<void(Stream)>;

    /// `name` is the listener's, for the log. Throws Unusable.
    Handshakes(boost::asio::any_io_executor executor, std::string name, Settings settings);
    ~Handshakes();

    /// For handshakes that begin from now on. Files that no context can be made of are logged, and
    /// the former context stays in use.
    void apply(const Settings& settings);
    /// Calls `done` later, at most once: not if the handshake fails, and then the reason is logged
    /// and the socket closed.
    void begin(boost::asio::ip::tcp::socket socket, Done done);
    /// Returns why a connection that was let in before must end by now: its certificate is revoked
    /// or has expired, or it has shown none; "" if it may stay.
    std::string why_leave(const Stream& stream) const;
    /// Ends all handshakes.
    void stop();
    Counters counters() const;

  private:
    struct Conversation;
    using Ref = std::shared_ptr<Conversation>;

    void make_room(const HostKey& host);
    void listen(const Ref& one);
    void look(const Ref& one);
    void take_turns();
    void shake(const Ref& one);
    void judge(const Ref& one, const boost::system::error_code& error);
    void fail(const Ref& one, Outcome outcome, const std::string& why);
    bool end(const Ref& one, Outcome outcome);

    std::string name_;
    Settings settings_;
    std::shared_ptr<const Context> context_;
    std::list<Ref> running_;  ///< the oldest first
    boost::asio::steady_timer turn_;
    bool turn_is_armed_ = false;
    Counters counters_;
};

}  // namespace panelgate::tls
