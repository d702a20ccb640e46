#include "readiness.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <string_view>

#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/base/utf8.hpp"

namespace panelgate::app {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMost = 4096;  // bytes of the answer
constexpr std::size_t kShown = 200;  // … of a line that is told

/// The first line of `text`, fit for a terminal.
std::string first_line(std::string_view text) {
    const std::string_view line = text.substr(0, text.find_first_of("\r\n")).substr(0, kShown);
    std::string shown = as_utf8(line);
    std::ranges::replace_if(
        shown, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
    return shown;
}

class Probe {
  public:
    Probe(const std::string& address, std::uint16_t port)
        : target_(asio::ip::make_address(address), port),
          request_("GET /readyz HTTP/1.1\r\nHost: " + endpoint_text(address, port) +
                   "\r\nConnection: close\r\n\r\n") {}

    std::string run(Duration patience) {
        socket_.async_connect(target_, [this](const error_code& error) {
            if (error) return end(error);
            ask();
        });
        io_.run_for(patience);
        return verdict();
    }

  private:
    void ask() {
        asio::async_write(socket_, asio::buffer(request_),
                          [this](const error_code& error, std::size_t) {
                              if (error) return end(error);
                              listen();
                          });
    }

    /// Until it is known to be ready, or nothing more comes.
    void listen() {
        socket_.async_read_some(asio::buffer(buffer_),
                                [this](const error_code& error, std::size_t size) {
                                    answer_.append(buffer_, size);
                                    if (error) return end(error);
                                    const bool enough = is_ready() || answer_.size() >= kMost;
                                    if (!enough) listen();
                                });
    }

    void end(const error_code& error) { error_ = error; }

    bool is_http() const { return answer_.starts_with("HTTP/1."); }
    /// "200 OK" of a status line (RFC 9112, 4).
    std::string status() const {
        const std::string line = first_line(answer_);
        return line.substr(std::min(line.find(' ') + 1, line.size()));
    }
    bool is_ready() const {
        const bool whole = answer_.find("\r\n") != std::string::npos;
        return whole && is_http() && (status() + ' ').starts_with("200 ");
    }

    std::string verdict() const {
        if (is_ready()) return {};
        if (answer_.empty()) return silence();
        if (!is_http()) return "an answer that is no HTTP: " + first_line(answer_);
        const std::size_t body = answer_.find("\r\n\r\n");
        const std::string why =
            body == std::string::npos ? "" : first_line(std::string_view(answer_).substr(body + 4));
        return status() + (why.empty() ? "" : ": " + why);
    }

    /// Who may not connect is shut out in either way.
    std::string silence() const {
        if (!error_) return "no answer in time";
        const bool shut_out = error_ == asio::error::eof || error_ == asio::error::connection_reset;
        if (!shut_out) return error_.message();
        return "closed without an answer (does its `allow` let this machine in?)";
    }

    asio::io_context io_{1};
    asio::ip::tcp::socket socket_{io_};
    asio::ip::tcp::endpoint target_;
    std::string request_;
    char buffer_[1024]{};
    std::string answer_;
    error_code error_;
};

}  // namespace

std::string ask_whether_ready(const std::string& address, std::uint16_t port, Duration patience) {
    return Probe(address, port).run(patience);
}

}  // namespace panelgate::app
