#pragma once

#include <sys/types.h>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/tls/context.hpp"

struct ssl_st;

namespace panelgate::tls {

/// The client's end of TLS over a connected, non-blocking socket that stays its owner's. Nothing
/// waits: the owner watches the socket.
class ClientEnd {
  public:
    /// `server`: the name or address that the context was made for.
    ClientEnd(std::shared_ptr<const ClientContext> context, const std::string& server, int socket);
    ~ClientEnd();
    ClientEnd(const ClientEnd&) = delete;
    ClientEnd& operator=(const ClientEnd&) = delete;

    enum class Step : std::uint8_t { done, wants_input, wants_output, failed };
    /// Goes on with the handshake.
    Step shake();
    /// Why the handshake has failed, in one sentence.
    const std::string& why() const { return why_; }
    /// Like ::read and ::write, with errno EAGAIN and EPROTO.
    ssize_t read(std::span<std::uint8_t> room);
    ssize_t write(ByteView bytes);

  private:
    ssize_t result_of(int result) const;

    std::shared_ptr<const ClientContext> context_;
    std::unique_ptr<ssl_st, void (*)(ssl_st*)> tls_;
    std::string why_;
};

}  // namespace panelgate::tls
