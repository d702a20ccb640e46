#pragma once

#include <sys/types.h>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/tls/settings.hpp"

struct ssl_ctx_st;
struct ssl_st;
struct x509_st;

namespace panelgate::tls {

/// Files that no context can be made of: `file` is the key of the settings that is to blame, the
/// text one sentence that says what would be right.
struct Unusable : std::runtime_error {
    Unusable(std::string key, const std::string& text)
        : std::runtime_error(text), file(std::move(key)) {}
    std::string file;
};

/// What the connections of a listener have in common: certificate, key, CA, list of revoked
/// certificates, versions and suites. Immutable: new files make a new context, for connections to
/// come, and each connection keeps its own. May be used by several threads.
class Context {
  public:
    /// Throws Unusable. Reads no file: settings.material has the contents.
    explicit Context(const Settings& settings);

    ssl_ctx_st* native() const { return context_.get(); }
    /// Returns the end of the certificate's validity, or of a certificate between it and its CA,
    /// whichever is first; in seconds since 1970.
    std::int64_t expiry() const { return expiry_; }
    /// True if a list of revoked certificates names this certificate. Looks up, computes nothing.
    bool revokes(x509_st* certificate) const;

  private:
    std::shared_ptr<ssl_ctx_st> context_;
    std::int64_t expiry_ = 0;
};

/// A client's context for connections to one server: trusted CAs, and the client's certificate. For
/// one connection at a time.
class ClientContext {
  public:
    /// Throws Unusable. Reads no file: settings.material has the contents. `server`: the name or
    /// address that the server's certificate must have. Without `ca` the system's CAs are trusted;
    /// without `certificate` the client shows none.
    ClientContext(const Settings& settings, const std::string& server);
    ClientContext(const ClientContext&) = delete;
    ClientContext& operator=(const ClientContext&) = delete;

    ssl_ctx_st* native() const { return context_.get(); }
    /// Returns why the server's certificate was not taken, in one sentence; "" if it was.
    const std::string& refusal() const { return refusal_; }

  private:
    std::string refusal_;  ///< the context's verification writes it
    std::shared_ptr<ssl_ctx_st> context_;
};

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
