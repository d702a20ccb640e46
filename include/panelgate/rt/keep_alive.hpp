#pragma once

#include <chrono>

namespace panelgate::rt {

/// When a peer that has gone without a word is given up: so many probes after a silence.
struct KeepAlive {
    std::chrono::seconds silence;
    std::chrono::seconds pause;  ///< between two probes
    int probes = 3;
};

/// Small writes leave at once, and a peer that is gone is noticed (CON-07). What cannot be set is
/// no reason to refuse a connection.
void set_up_socket(int socket, const KeepAlive& keep_alive);

}  // namespace panelgate::rt
