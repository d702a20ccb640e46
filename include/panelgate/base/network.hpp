#pragma once

#include <string>

namespace panelgate {

/// A network in CIDR form; a bare address is /32 or /128.
struct Network {
    std::string address;
    unsigned prefix = 0;
    friend bool operator==(const Network&, const Network&) = default;
};

}  // namespace panelgate
