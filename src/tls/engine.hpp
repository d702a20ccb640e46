#pragma once

#include <openssl/ssl.h>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "native.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/counters.hpp"

namespace panelgate::tls {

/// OpenSSL's side of one connection. During the handshake it works on bytes in memory, so that any
/// thread may do it, one at a time; afterwards on a socket that does not block.
class Engine {
  public:
    enum class Progress : std::uint8_t { done, needs_input, failed };

    /// The server's side; OpenSSL's object is made by the first handshake().
    explicit Engine(std::shared_ptr<const Context> context) : context_(std::move(context)) {}
    /// The client's side.
    explicit Engine(const std::shared_ptr<SSL_CTX>& context);
    Engine(const Engine&) = delete;
    Engine& operator=(const Engine&) = delete;

    /// Takes what is in `input`, leaves what must be sent in `output`.
    Progress handshake();
    /// Why it has failed.
    Outcome outcome() const { return outcome_; }
    const std::string& why() const { return why_; }

    /// The handshake is over and its output is sent: bytes go to and come from the socket, but
    /// those in `input` come first.
    void use_socket(int socket) { socket_ = socket; }
    SSL* native() const { return ssl_.get(); }

    /// True if something is here that SSL_read() has not given out: it is read before the socket.
    bool holds_input() const;
    /// Where the owner may put the socket's next bytes, while holds_input() is false or SSL_read()
    /// wants more: whoever waits for them gets them by the same step. Larger records are read on
    /// from the socket.
    std::span<char> room() { return ahead_; }
    void arrived(std::size_t size) { ahead_taken_ = 0, ahead_size_ = size; }

    // Not Bytes, whose pool is the loop's.
    std::string input;
    std::string output;
    std::size_t taken = 0;  ///< of `input`

  private:
    friend struct Wire;

    void create(SSL_CTX* context);
    void explain(int reason);
    void explain_chain(long result);
    int read(char* into, int size);
    int write(const char* bytes, int size);

    std::shared_ptr<const Context> context_;
    Owned<SSL> ssl_;
    int socket_ = -1;
    std::array<char, 1024> ahead_;  ///< a request's record, encrypted
    std::size_t ahead_size_ = 0;
    std::size_t ahead_taken_ = 0;
    bool ended_ = false;  ///< the socket's input
    Outcome outcome_ = Outcome::broken;
    std::string why_;
    std::string refused_;  ///< the certificate that is not accepted, in words
};

}  // namespace panelgate::tls
