// What bench/ethernet.py has on either side of the gateway.
//
//   ethernet_peer device N DELAY_US
//
// N servers of Modbus/TCP; prints their ports. A register of a unit holds unit + address, and each
// reply comes DELAY_US behind its request.
//
//   ethernet_peer load PORT UNIT CONNECTIONS SECONDS
//
// Reads of 10 registers without pause, one at a time in each connection; prints answers a second,
// and how many were wrong.
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "peer.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using namespace peer;
constexpr std::size_t kRequest = 12;  // a read in Modbus/TCP

// The devices

struct Late {
    Clock::time_point due;
    int fd;
    Bytes reply;
};

Bytes reply_to(const Bytes& request) {
    const unsigned unit = request[6];
    const unsigned first = word(request, 8);
    const unsigned count = word(request, 10);
    Bytes reply(request.begin(), request.begin() + 4);
    put(reply, 3 + 2 * count);
    reply.push_back(request[6]);
    reply.push_back(request[7]);
    reply.push_back(static_cast<std::uint8_t>(2 * count));
    for (unsigned i = 0; i < count; ++i) put(reply, (unit + first + i) & 0xFFFF);
    return reply;
}

/// Ends with its process.
[[noreturn]] void serve(int devices, std::chrono::microseconds delay) {
    const int epoll = ::epoll_create1(0);
    std::vector<int> listeners;
    for (int i = 0; i < devices; ++i) {
        const int fd = listen_anywhere();
        listeners.push_back(fd);
        watch(epoll, fd);
    }
    std::fflush(stdout);
    std::vector<Bytes> heard(4096);
    std::deque<Late> late;
    while (true) {
        timespec pause{1, 0};
        if (!late.empty()) {
            const auto left = std::max(late.front().due - Clock::now(), Clock::duration{});
            pause = {0, std::chrono::nanoseconds(left).count()};
        }
        epoll_event events[64];
        const int ready = ::epoll_pwait2(epoll, events, 64, &pause, nullptr);
        for (int i = 0; i < ready; ++i) {
            const int fd = events[i].data.fd;
            if (std::find(listeners.begin(), listeners.end(), fd) != listeners.end()) {
                const int peer = ::accept(fd, nullptr, nullptr);
                no_delay(peer);
                heard[static_cast<std::size_t>(peer)].clear();
                watch(epoll, peer);
                continue;
            }
            Bytes& bytes = heard[static_cast<std::size_t>(fd)];
            if (!receive(fd, bytes)) {
                std::erase_if(late, [fd](const Late& one) { return one.fd == fd; });
                ::close(fd);
                continue;
            }
            for (; bytes.size() >= kRequest; bytes.erase(bytes.begin(), bytes.begin() + kRequest))
                late.push_back({Clock::now() + delay, fd, reply_to(bytes)});
        }
        for (const auto now = Clock::now(); !late.empty() && late.front().due <= now;) {
            const Bytes& reply = late.front().reply;
            static_cast<void>(::send(late.front().fd, reply.data(), reply.size(), MSG_NOSIGNAL));
            late.pop_front();
        }
    }
}

// The clients

Bytes request_of(unsigned number, unsigned unit) {
    Bytes request;
    put(request, number);
    put(request, 0);
    put(request, 6);
    request.push_back(static_cast<std::uint8_t>(unit));
    request.push_back(3);
    put(request, number % 1000 * 20);  // apart, so that no two share a transaction
    put(request, 10);
    return request;
}

void load(unsigned port, unsigned unit, int connections, double seconds) {
    const int epoll = ::epoll_create1(0);
    std::vector<unsigned> asked(4096);
    std::vector<Bytes> heard(4096);
    unsigned number = 0;
    const auto ask = [&](int fd) {
        const Bytes request =
            request_of(asked[static_cast<std::size_t>(fd)] = ++number & 0xFFFF, unit);
        static_cast<void>(::send(fd, request.data(), request.size(), MSG_NOSIGNAL));
    };
    for (int i = 0; i < connections; ++i) {
        const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
        const sockaddr_in address = local(port);
        if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            std::exit(1);
        no_delay(fd);
        watch(epoll, fd);
        ask(fd);
    }
    const auto begin = Clock::now();
    const auto end = begin + std::chrono::duration<double>(seconds);
    unsigned long answers = 0;
    unsigned long wrong = 0;
    while (Clock::now() < end) {
        epoll_event events[64];
        const int ready = ::epoll_wait(epoll, events, 64, 100);
        for (int i = 0; i < ready; ++i) {
            const int fd = events[i].data.fd;
            Bytes& bytes = heard[static_cast<std::size_t>(fd)];
            if (!receive(fd, bytes)) std::exit(1);
            if (bytes.size() < 6 || bytes.size() < 6 + word(bytes, 4)) continue;
            const Bytes request = request_of(asked[static_cast<std::size_t>(fd)], unit);
            ++(bytes == reply_to(request) ? answers : wrong);
            bytes.clear();
            ask(fd);
        }
    }
    const std::chrono::duration<double> took = Clock::now() - begin;
    std::printf("%.1f %lu\n", static_cast<double>(answers) / took.count(), wrong);
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (arguments.size() == 3 && arguments[0] == "device")
        serve(std::stoi(arguments[1]), std::chrono::microseconds(std::stoi(arguments[2])));
    if (arguments.size() != 5 || arguments[0] != "load") return 2;
    load(static_cast<unsigned>(std::stoi(arguments[1])),
         static_cast<unsigned>(std::stoi(arguments[2])), std::stoi(arguments[3]),
         std::stod(arguments[4]));
}
