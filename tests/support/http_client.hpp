#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/json/parse.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace panelgate::test {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;

struct Reply {
    http::response<http::string_body> message;
    boost::system::error_code error;

    unsigned status() const { return error ? 0 : message.result_int(); }
    std::string header(const std::string& name) const { return std::string(message[name]); }
    const std::string& body() const { return message.body(); }
    boost::json::object json() const { return boost::json::parse(message.body()).as_object(); }
    boost::json::value at(const char* name) const { return json().at(name); }
};

inline boost::json::value json_of(const char* text) { return boost::json::parse(text); }

/// One connection, driven by the server's own thread: nothing here blocks it.
class Client {
  public:
    Client(boost::asio::io_context& io, std::uint16_t port) : io_(io), socket_(io) {
        socket_.connect({boost::asio::ip::address_v4::loopback(), port});
    }

    void send(const std::string& text) { boost::asio::write(socket_, boost::asio::buffer(text)); }
    /// Runs the server until a reply is there or the connection ends.
    Reply receive(bool head = false) {
        http::response_parser<http::string_body> parser;
        parser.skip(head);
        parser.body_limit(boost::none);
        std::optional<boost::system::error_code> done;
        http::async_read(socket_, buffer_, parser, [&](auto error, std::size_t) { done = error; });
        while (!done) io_.run_one();
        return {parser.release(), *done};
    }
    Reply ask(const std::string& method, const std::string& target, const std::string& body = "",
              const std::string& headers = "") {
        std::string text = method + " " + target + " HTTP/1.1\r\nHost: x\r\n" + headers;
        if (!body.empty()) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
        send(text + "\r\n" + body);
        return receive(method == "HEAD");
    }
    tcp::socket& socket() { return socket_; }

  private:
    boost::asio::io_context& io_;
    tcp::socket socket_;
    boost::beast::flat_buffer buffer_;
};

}  // namespace panelgate::test
