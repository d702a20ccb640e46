#include "panelgate/rt/keep_alive.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

namespace panelgate::rt {

void set_up_socket(int socket, const KeepAlive& keep_alive) {
    const auto set = [socket](int level, int name, int value) {
        ::setsockopt(socket, level, name, &value, sizeof value);
    };
    set(IPPROTO_TCP, TCP_NODELAY, 1);
    set(SOL_SOCKET, SO_KEEPALIVE, 1);
    set(IPPROTO_TCP, TCP_KEEPIDLE, static_cast<int>(keep_alive.silence.count()));
    set(IPPROTO_TCP, TCP_KEEPINTVL, static_cast<int>(keep_alive.pause.count()));
    set(IPPROTO_TCP, TCP_KEEPCNT, keep_alive.probes);
}

}  // namespace panelgate::rt
