#include "panelgate/web/http/client.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

#include "panelgate/base/text.hpp"

namespace panelgate::web {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::size_t kReplyShown = 200;  // bytes of a line that is shown
constexpr std::string_view kEndOfHead = "\r\n\r\n";

class Question {
  public:
    Question(const std::string& request, std::size_t most,
             const std::function<bool(const HttpReply&)>& enough,
             const std::optional<tls::Trust>& trust)
        : request_(request), most_(most), enough_(enough), trust_(trust) {}

    HttpReply put(const HttpTarget& target, Duration patience) {
        using asio::ip::tcp;
        resolver_.async_resolve(
            target.host, std::to_string(target.port), tcp::resolver::numeric_service,
            [&](const error_code& error, const tcp::resolver::results_type& found) {
                if (error) return end(error);
                asio::async_connect(socket_, found,
                                    [&](const error_code& failed, const tcp::endpoint&) {
                                        failed ? end(failed) : greet(target.host);
                                    });
            });
        io_.run_for(patience);
        return reply_;
    }

  private:
    void greet(const std::string& server) {
        if (!trust_) {
            stream_.emplace(std::move(socket_));
            return send_request();
        }
        tls::connect(std::move(socket_), *trust_, server,
                     [this](const std::string& why, tls::Stream stream) {
                         stream_.emplace(std::move(stream));
                         reply_.secure = why.empty();
                         reply_.refused = why;
                         if (why.empty()) send_request();
                     });
    }
    void send_request() {
        asio::async_write(*stream_, asio::buffer(request_),
                          [this](const error_code& error, std::size_t) {
                              if (error) return end(error);
                              listen();
                          });
    }
    void listen() {
        stream_->async_read_some(asio::buffer(buffer_),
                                 [this](const error_code& error, std::size_t size) {
                                     reply_.text.append(buffer_, size);
                                     if (error) return end(error);
                                     if (!enough_(reply_) && reply_.text.size() < most_) listen();
                                 });
    }
    void end(const error_code& error) { reply_.error = error; }

    const std::string& request_;
    std::size_t most_;
    const std::function<bool(const HttpReply&)>& enough_;
    asio::io_context io_{1};
    asio::ip::tcp::resolver resolver_{io_};
    const std::optional<tls::Trust>& trust_;
    asio::ip::tcp::socket socket_{io_};
    std::optional<tls::Stream> stream_;
    char buffer_[4096]{};
    HttpReply reply_;
};

}  // namespace

std::string first_line(std::string_view text) {
    return printable(text.substr(0, text.find_first_of("\r\n")).substr(0, kReplyShown));
}

std::string HttpReply::status() const {
    const std::string line = first_line(text);
    return line.substr(std::min(line.find(' ') + 1, line.size()));
}

std::string_view HttpReply::body() const {
    const std::size_t head = text.find(kEndOfHead);
    if (head == std::string::npos) return {};
    return std::string_view(text).substr(head + kEndOfHead.size());
}

/// A server refuses a client either by closing or by resetting the connection.
std::string HttpReply::failure() const {
    if (!refused.empty()) return refused;
    if (!error) return "no answer in time";
    const bool shut_out = error == asio::error::eof || error == asio::error::connection_reset;
    if (!shut_out) return error.message();
    if (secure)
        return "closed without an answer: by TLS it got in, so ask its log (`tls handshake "
               "failed`): does it want a client's certificate (`tls: client: required`)?";
    return "closed without an answer (does its `allow` let this machine in, and does it have "
           "`tls`, "
           "so that it is asked by https://?)";
}

HttpReply ask(const HttpTarget& target, const std::string& request, Duration patience,
              std::size_t most, const std::function<bool(const HttpReply&)>& enough) {
    return Question(request, most, enough, target.trust).put(target, patience);
}

}  // namespace panelgate::web
