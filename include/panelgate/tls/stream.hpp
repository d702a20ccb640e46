#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/compose.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "panelgate/base/time.hpp"
#include "panelgate/tls/peer.hpp"

struct x509_st;

namespace panelgate::tls {

/// What has come is no TLS, or was changed on the way.
inline constexpr auto kDamaged = boost::system::errc::protocol_error;

/// A connection, plain or with TLS. Meets Asio's AsyncReadStream and AsyncWriteStream. One read and
/// one write at a time; the owner of the stream keeps it alive until both have ended. Never blocks.
/// One thread. An end of input without close_notify is an end of input: lengths end ADUs and
/// requests.
class Stream {
  public:
    using executor_type = boost::asio::any_io_executor;
    using Secure = boost::asio::ssl::stream<boost::asio::ip::tcp::socket>;
    /// What has arrived and is not read.
    enum class Input : std::uint8_t { none, bytes, end, broken };

    /// A plain connection.
    explicit Stream(boost::asio::ip::tcp::socket socket);
    /// A connection whose handshake is over.
    explicit Stream(std::unique_ptr<Secure> secure);
    /// Only while no operation is pending and no time limit runs.
    Stream(Stream&&) = default;

    bool is_secure() const { return secure_ != nullptr; }
    /// Returns what the client's certificate says; nothing without TLS.
    const Peer& peer() const { return peer_; }
    /// Returns the client's certificate; null if the client has shown none.
    x509_st* certificate() const;

    executor_type get_executor() { return socket().get_executor(); }
    /// For its addresses, options and wait operations. Bytes go through this class.
    boost::asio::ip::tcp::socket& socket() { return secure_ ? secure_->next_layer() : plain_; }
    const boost::asio::ip::tcp::socket& socket() const {
        return secure_ ? secure_->next_layer() : plain_;
    }

    template <class Buffers, class Token>
    auto async_read_some(const Buffers& buffers, Token&& token);
    template <class Buffers, class Token>
    auto async_write_some(const Buffers& buffers, Token&& token);
    /// The same without a time limit (expires_after): a plain read costs what the socket's own
    /// does.
    template <class Handler>
    void read_some(boost::asio::mutable_buffer into, Handler handler);
    /// Writes what can be written at once; would_block if nothing, as always with TLS.
    std::size_t write_some(boost::asio::const_buffer bytes, boost::system::error_code& error);
    /// Writes a static text while no other write is pending, and forgets it.
    void write_aside(boost::asio::const_buffer text);
    /// Looks without reading, while no read is pending. With TLS, bytes may be no more than an
    /// announced end.
    Input look();
    /// Returns the number of bytes in the socket that are not read, encrypted or not.
    std::size_t available() const;

    /// If an operation is pending by then, it fails and the connection is closed.
    void expires_after(Duration patience);
    /// Tells the client that nothing more is sent.
    void shutdown_send();
    /// Idempotent. Pending operations fail.
    void close();

    enum class Way : std::uint8_t { read, write };  ///< of a transfer

  private:
    template <Way kWay, class Buffers>
    struct Transfer;

    void say_goodbye();
    boost::system::error_code told(boost::system::error_code error) const;

    boost::asio::ip::tcp::socket plain_;  ///< not open with TLS
    std::shared_ptr<Secure> secure_;      ///< null: plain
    Peer peer_;
    boost::asio::steady_timer timer_;
    int pending_ = 0;  ///< operations
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

/// One read or write. Asio makes a TLS record of each buffer, so small ones are joined.
template <Stream::Way kWay, class Buffers>
struct Stream::Transfer {
    static constexpr std::size_t kRecord = 16 * 1024;

    Stream& stream;
    Buffers buffers;
    bool begun = false;
    std::unique_ptr<std::string> joined{};

    template <class Self>
    void operator()(Self& self, boost::system::error_code error = {}, std::size_t size = 0) {
        Stream& on = stream;
        if (begun) {
            --on.pending_;
            return self.complete(on.secure_ ? on.told(error) : error, size);
        }
        begun = true;
        const Buffers all = buffers;
        if constexpr (kWay == Way::read) {
            if (on.secure_) return on.secure_->async_read_some(all, std::move(self));
            on.plain_.async_read_some(all, std::move(self));
        } else {
            if (on.secure_ && is_split(all)) return write_joined(self, all);
            if (on.secure_) return on.secure_->async_write_some(all, std::move(self));
            on.plain_.async_write_some(all, std::move(self));
        }
    }
    static bool is_split(const Buffers& all) {
        const auto begin = boost::asio::buffer_sequence_begin(all);
        return begin != boost::asio::buffer_sequence_end(all) &&
               boost::asio::const_buffer(*begin).size() <
                   std::min(kRecord, boost::asio::buffer_size(all));
    }
    template <class Self>
    void write_joined(Self& self, const Buffers& all) {
        joined = std::make_unique<std::string>(std::min(kRecord, boost::asio::buffer_size(all)), 0);
        boost::asio::buffer_copy(boost::asio::buffer(*joined), all);
        const boost::asio::const_buffer record = boost::asio::buffer(*joined);
        Secure& into = *stream.secure_;
        into.async_write_some(record, std::move(self));
    }
};

template <class Buffers, class Token>
auto Stream::async_read_some(const Buffers& buffers, Token&& token) {
    ++pending_;
    return boost::asio::async_compose<Token, void(boost::system::error_code, std::size_t)>(
        Transfer<Way::read, Buffers>{*this, buffers}, token, socket());
}

template <class Buffers, class Token>
auto Stream::async_write_some(const Buffers& buffers, Token&& token) {
    ++pending_;
    return boost::asio::async_compose<Token, void(boost::system::error_code, std::size_t)>(
        Transfer<Way::write, Buffers>{*this, buffers}, token, socket());
}

template <class Handler>
void Stream::read_some(boost::asio::mutable_buffer into, Handler handler) {
    if (!is_secure()) return plain_.async_read_some(into, std::move(handler));
    secure_->async_read_some(into, [this, handler = std::move(handler)](
                                       const boost::system::error_code& error,
                                       std::size_t size) mutable { handler(told(error), size); });
}

/// Whom a client believes, in PEM form: the server that has this very certificate, whatever its
/// name and dates, or a server whose certificate the CA has signed for its name or address.
struct Trust {
    std::string certificate;
    std::string ca;
    bool any_name = false;  ///< the CA's signature is enough, whatever names it is for
    bool anybody = false;   ///< whoever is there: for a question that holds no secret
};

/// Makes a connected socket secure, from the client's side: for programs that ask one server, by
/// its name or its address. `done` is called once, later: with why it failed, or "" and the stream.
void connect(boost::asio::ip::tcp::socket socket, const Trust& trust, const std::string& server,
             std::function<void(const std::string& why, Stream stream)> done);

}  // namespace panelgate::tls
