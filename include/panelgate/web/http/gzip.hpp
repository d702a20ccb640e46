#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace panelgate::web {

/// Would whoever sent this Accept-Encoding take gzip? (RFC 9110 12.5.3; "" is no.)
bool accepts_gzip(std::string_view accept_encoding);

/// The text of a body in the content coding gzip that a Gzip made, or gzip(1); "" of anything else.
std::string unpacked(std::string_view body);

/// Makes a body of the content coding gzip (RFC 1952) of a text that comes in pieces. Pure.
class Gzip {
  public:
    Gzip();
    ~Gzip();
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;

    void add(std::string_view piece);
    /// The whole body. Nothing may follow.
    std::string finish();

  private:
    struct Stream;
    std::unique_ptr<Stream> stream_;
};

}  // namespace panelgate::web
