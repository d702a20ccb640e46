#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace panelgate::web {

/// True if this Accept-Encoding allows gzip (RFC 9110 12.5.3; "" does not).
bool accepts_gzip(std::string_view accept_encoding);

/// Decompresses a body made by Gzip or gzip(1); "" for anything else.
std::string unpacked(std::string_view body);

/// Compresses text, given in pieces, to content coding gzip (RFC 1952). Pure.
class Gzip {
  public:
    Gzip();
    ~Gzip();
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;

    void add(std::string_view piece);
    /// Returns the complete body; no calls may follow.
    std::string finish();

  private:
    struct Stream;
    std::unique_ptr<Stream> stream_;
};

}  // namespace panelgate::web
