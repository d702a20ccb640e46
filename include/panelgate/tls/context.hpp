#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "panelgate/tls/settings.hpp"

struct ssl_ctx_st;

namespace panelgate::tls {

/// Files that no context can be made of: `file` is the key of the settings that is to blame, the
/// text one sentence that says what would be right.
struct Unusable : std::runtime_error {
    Unusable(std::string key, const std::string& text)
        : std::runtime_error(text), file(std::move(key)) {}
    std::string file;
};

/// What the connections of a listener have in common: certificate, key, CA, list of revoked
/// certificates, versions and suites. Immutable; shared by its connections, so that a newer one
/// replaces it for those to come. May be used by several threads.
class Context {
  public:
    /// Throws Unusable. Reads no file: settings.material has the contents.
    explicit Context(const Settings& settings);

    ssl_ctx_st* native() const { return context_.get(); }
    /// The end of the certificate's validity, or of one between it and its CA, whichever is first;
    /// in seconds since 1970.
    std::int64_t expiry() const { return expiry_; }
    ClientCertificate client() const { return client_; }

  private:
    void use_ca(const Settings& settings);
    void use_crl(const Settings& settings);

    std::shared_ptr<ssl_ctx_st> context_;
    std::int64_t expiry_ = 0;
    ClientCertificate client_;
};

}  // namespace panelgate::tls
