// probe tcp PORT UNIT FUNCTION REGISTERS PAUSE_US SECONDS | probe rtu TTY UNIT FUNCTION ...
// One client with one request open: how long each took, in microseconds, one a line. `rtu` is the
// same client alone on the line, without a gateway: the difference is what the gateway adds.
// FUNCTION 3 reads REGISTERS from 0 on, 6 writes one at 200. Between two it pauses for PAUSE_US and
// up to as long again, at least a millisecond, so that it does not run in step with anybody; the
// pause is longer than the gap, which is therefore no part of what is measured. `fail` stands for a
// request that was not answered well.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "rtu_frame.hpp"

namespace {

std::int64_t now_ns() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

[[noreturn]] void fail(const char* what) {
    std::perror(what);
    std::exit(69);
}

int open_tcp(int port) {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    int one = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) fail("connect");
    return fd;
}

int open_tty(const char* path) {
    const int fd = open(path, O_RDWR | O_NOCTTY);
    termios t{};
    if (fd < 0 || tcgetattr(fd, &t) != 0) fail(path);
    cfmakeraw(&t);
    t.c_cc[VMIN] = 0;
    tcsetattr(fd, TCSANOW, &t);
    return fd;
}

Bytes pdu_of(int function, int registers, std::uint16_t turn) {
    const int address = function == 3 ? 0 : 200;
    const int value = function == 3 ? registers : turn;
    return {static_cast<std::uint8_t>(function), static_cast<std::uint8_t>(address >> 8),
            static_cast<std::uint8_t>(address), static_cast<std::uint8_t>(value >> 8),
            static_cast<std::uint8_t>(value)};
}

Bytes framed(bool tcp, int unit, const Bytes& pdu, std::uint16_t turn) {
    Bytes frame;
    if (tcp) {
        frame = {static_cast<std::uint8_t>(turn >> 8),     static_cast<std::uint8_t>(turn), 0, 0, 0,
                 static_cast<std::uint8_t>(pdu.size() + 1)};
    }
    frame.push_back(static_cast<std::uint8_t>(unit));
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    if (!tcp) {
        append_crc(frame);
    }
    return frame;
}

// Whether a whole reply of this length came within 15 seconds.
bool receive(int fd, std::size_t length, Bytes& reply) {
    reply.resize(length);
    std::size_t have = 0;
    while (have < length) {
        pollfd waiting{fd, POLLIN, 0};
        if (poll(&waiting, 1, 15000) <= 0) return false;
        const ssize_t more = read(fd, reply.data() + have, length - have);
        if (more <= 0) return false;
        have += static_cast<std::size_t>(more);
        // An exception is shorter; it is a failure and need not be read well.
        if (have >= 9 && length > 9 && (reply[7] & 0x80) != 0 && reply[5] == 3) return false;
    }
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 8) return 64;
    const bool tcp = std::string(argv[1]) == "tcp";
    const int unit = std::atoi(argv[3]);
    const int function = std::atoi(argv[4]);
    const int registers = std::atoi(argv[5]);
    const long pause_us = std::atol(argv[6]);
    const auto seconds = std::atof(argv[7]);
    prctl(PR_SET_TIMERSLACK, 1);
    const int fd = tcp ? open_tcp(std::atoi(argv[2])) : open_tty(argv[2]);
    const std::size_t body = function == 3 ? 2 + 2 * static_cast<std::size_t>(registers) : 5;
    const std::size_t length = body + 1 + (tcp ? 6 : 2);
    std::vector<double> took;
    const std::int64_t end = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
    unsigned dice = 1;
    for (std::uint16_t turn = 1; now_ns() < end; ++turn) {
        const Bytes request = framed(tcp, unit, pdu_of(function, registers, turn), turn);
        Bytes reply;
        const std::int64_t sent = now_ns();
        if (write(fd, request.data(), request.size()) != static_cast<ssize_t>(request.size()))
            fail("write");
        const bool good = receive(fd, length, reply);
        took.push_back(good ? static_cast<double>(now_ns() - sent) / 1e3 : -1);
        dice = dice * 1664525U + 1013904223U;
        const long pause = pause_us + static_cast<long>(dice >> 8) % std::max(1000L, pause_us);
        const timespec rest{pause / 1'000'000, pause % 1'000'000 * 1000};
        nanosleep(&rest, nullptr);
    }
    for (const double us : took) us < 0 ? std::puts("fail") : std::printf("%.1f\n", us);
}
