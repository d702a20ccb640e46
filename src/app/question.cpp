#include "question.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>

#include "panelgate/base/utf8.hpp"

namespace panelgate::app {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kShown = 200;  // bytes of a line that is told
constexpr std::string_view kEndOfHead = "\r\n\r\n";

class Question {
  public:
    Question(const std::string& request, std::size_t most,
             const std::function<bool(const Said&)>& enough)
        : request_(request), most_(most), enough_(enough) {}

    Said put(const asio::ip::tcp::endpoint& target, Duration patience) {
        socket_.async_connect(target, [this](const error_code& error) {
            if (error) return end(error);
            say();
        });
        io_.run_for(patience);
        return said_;
    }

  private:
    void say() {
        asio::async_write(socket_, asio::buffer(request_),
                          [this](const error_code& error, std::size_t) {
                              if (error) return end(error);
                              listen();
                          });
    }
    void listen() {
        socket_.async_read_some(asio::buffer(buffer_),
                                [this](const error_code& error, std::size_t size) {
                                    said_.text.append(buffer_, size);
                                    if (error) return end(error);
                                    if (!enough_(said_) && said_.text.size() < most_) listen();
                                });
    }
    void end(const error_code& error) { said_.error = error; }

    const std::string& request_;
    std::size_t most_;
    const std::function<bool(const Said&)>& enough_;
    asio::io_context io_{1};
    asio::ip::tcp::socket socket_{io_};
    char buffer_[4096]{};
    Said said_;
};

}  // namespace

std::string first_line(std::string_view text) {
    const std::string_view line = text.substr(0, text.find_first_of("\r\n")).substr(0, kShown);
    std::string shown = as_utf8(line);
    std::ranges::replace_if(
        shown, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, '?');
    return shown;
}

std::string Said::status() const {
    const std::string line = first_line(text);
    return line.substr(std::min(line.find(' ') + 1, line.size()));
}

std::string_view Said::body() const {
    const std::size_t head = text.find(kEndOfHead);
    if (head == std::string::npos) return {};
    return std::string_view(text).substr(head + kEndOfHead.size());
}

/// Who may not connect is shut out in either way.
std::string Said::silence() const {
    if (!error) return "no answer in time";
    const bool shut_out = error == asio::error::eof || error == asio::error::connection_reset;
    if (!shut_out) return error.message();
    return "closed without an answer (does its `allow` let this machine in?)";
}

Said ask(const std::string& address, std::uint16_t port, const std::string& request,
         Duration patience, std::size_t most, const std::function<bool(const Said&)>& enough) {
    return Question(request, most, enough).put({asio::ip::make_address(address), port}, patience);
}

}  // namespace panelgate::app
