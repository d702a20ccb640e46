#pragma once

#include <string>

namespace panelgate::standby {

/// Two boxes drive the same lines, one at a time.
struct Settings {
    unsigned rank = 0;         ///< 0 or 1; the box of rank 0 claims a silent line first
    std::string peer{};        ///< URL of the other box's REST API; "": nobody is asked
    std::string token_file{};  ///< path of the file with the token for the peer; "": none
    std::string token{};       ///< content of that file
    std::string ca{};      ///< path of the CA that signed the peer's certificate; "": the system's
    std::string ca_pem{};  ///< content of that file
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::standby
