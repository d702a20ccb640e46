#pragma once

#include <openssl/ssl.h>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "native.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::tls {

/// Takes certificate and key of the settings into use; throws Unusable. Returns the end of its
/// validity, or of one between it and its CA, whichever is first; in seconds since 1970.
std::int64_t use_pair(SSL_CTX* context, const Settings& settings);
/// The CAs of the settings. Throws Unusable; `advice`: which one to give where there is none.
std::vector<Owned<X509>> trusted_authorities(const Settings& settings, const char* advice);
/// A file that is being written holds the first objects only; throws Unusable.
void check_whole(const char* key, const std::string& file, std::string_view content,
                 std::string_view kind, std::size_t read);

}  // namespace panelgate::tls
