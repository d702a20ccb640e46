// tcp_bus: stations 1 to 247 behind a TCP port, RTU frames, no pacing: each read of registers (03)
// is answered at once with unit * 257 + address * 31 + 7, as rtubus does, and each write of one
// (06) with itself. One master at a time. Prints "listening PORT"; each line on stdin is answered
// by {"replies": N}; ends with stdin.
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "rtu_frame.hpp"

namespace {

constexpr std::size_t kRead = 8;  // a request of function 03 or 06 with its CRC

Bytes reply_to(const std::uint8_t* request) {
    if (request[1] == 6) return Bytes(request, request + kRead);
    const unsigned address = request[2] << 8 | request[3];
    const unsigned count = request[5];
    Bytes reply{request[0], 3, static_cast<std::uint8_t>(2 * count)};
    for (unsigned i = 0; i < count; ++i) {
        const unsigned value = request[0] * 257 + (address + i) * 31 + 7;
        reply.push_back(static_cast<std::uint8_t>(value >> 8));
        reply.push_back(static_cast<std::uint8_t>(value));
    }
    append_crc(reply);
    return reply;
}

// False when the master has left.
bool serve(int master, Bytes& heard, long& replies) {
    std::uint8_t piece[1024];
    const ssize_t more = read(master, piece, sizeof piece);
    if (more <= 0) return false;
    heard.insert(heard.end(), piece, piece + more);
    while (heard.size() >= kRead) {
        const Bytes reply = reply_to(heard.data());
        heard.erase(heard.begin(), heard.begin() + kRead);
        if (write(master, reply.data(), reply.size()) != static_cast<ssize_t>(reply.size()))
            return false;
        ++replies;
    }
    return true;
}

int listen_on_free_port() {
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    if (bind(listener, reinterpret_cast<sockaddr*>(&own), size) != 0 || listen(listener, 4) != 0 ||
        getsockname(listener, reinterpret_cast<sockaddr*>(&own), &size) != 0)
        return -1;
    std::printf("listening %d\n", ntohs(own.sin_port));
    std::fflush(stdout);
    return listener;
}

}  // namespace

int main() {
    const int listener = listen_on_free_port();
    if (listener < 0) return 69;
    int master = -1;
    long replies = 0;
    Bytes heard;
    for (;;) {
        pollfd waiting[3] = {{STDIN_FILENO, POLLIN, 0}, {listener, POLLIN, 0}, {master, POLLIN, 0}};
        if (poll(waiting, 3, -1) < 0) return 70;
        if (waiting[2].revents != 0 && !serve(master, heard, replies)) {
            close(master);
            master = -1;
        }
        if (waiting[1].revents != 0 && master < 0) {
            master = accept(listener, nullptr, nullptr);
            const int one = 1;
            setsockopt(master, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
            heard.clear();
        }
        if (waiting[0].revents != 0) {
            char command[64];
            if (read(STDIN_FILENO, command, sizeof command) <= 0) return 0;
            std::printf("{\"replies\": %ld}\n", replies);
            std::fflush(stdout);
        }
    }
}
