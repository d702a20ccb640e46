#pragma once

#include <memory>
#include <string>

#include "panelgate/tls/settings.hpp"

struct ssl_ctx_st;

namespace panelgate::tls {

/// What a client brings to a connection to one server: whom it trusts, and its own certificate.
/// For one connection at a time.
class ClientContext {
  public:
    /// Throws Unusable. Reads no file: settings.material has the contents. `server`: the name or
    /// address that the server's certificate must have. Without `ca` the system's CAs are trusted;
    /// without `certificate` it shows none.
    ClientContext(const Settings& settings, const std::string& server);
    ClientContext(const ClientContext&) = delete;
    ClientContext& operator=(const ClientContext&) = delete;

    ssl_ctx_st* native() const { return context_.get(); }
    /// Why the server's certificate was not taken, in one sentence; "" if it was.
    const std::string& refusal() const { return refusal_; }

  private:
    std::string refusal_;  ///< the context's verification writes it
    std::shared_ptr<ssl_ctx_st> context_;
};

}  // namespace panelgate::tls
