// What bench/scale.py has on either side of the gateway.
//
//   scale_peer bus N BAUD
//
// N ports of device servers, each with a line of RTU at this rate; prints the ports. A register of
// a station holds station * 1000 + address. A reply begins 5 ms behind its request.
//
//   scale_peer load SECONDS
//
// Reads of 10 registers without pause, one at a time in each connection. Standard input has a row
// HOST PORT LINE FIRST_UNIT UNITS for each connection, to 127.0.0.HOST. Prints a row LINE ANSWERS
// WRONG LATE_MS for each line: 99 % of its answers come within LATE_MS.
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <queue>
#include <string>
#include <vector>

#include "peer.hpp"

namespace {

using namespace peer;
using Clock = std::chrono::steady_clock;
constexpr std::size_t kRtuRead = 8;
constexpr unsigned kCount = 10;

unsigned value_of(unsigned station, unsigned address) {
    return (station * 1000 + address) & 0xFFFF;
}

unsigned crc_of(const Bytes& bytes) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1;
    }
    return crc;
}

// The lines

struct Due {
    Clock::time_point at;
    int fd;
    Bytes reply;
    bool operator>(const Due& other) const { return at > other.at; }
};

Bytes rtu_reply(const Bytes& request) {
    const unsigned count = word(request, 4);
    Bytes reply{request[0], request[1], static_cast<std::uint8_t>(2 * count)};
    for (unsigned i = 0; i < count; ++i) put(reply, value_of(request[0], word(request, 2) + i));
    const unsigned crc = crc_of(reply);
    reply.push_back(static_cast<std::uint8_t>(crc));
    reply.push_back(static_cast<std::uint8_t>(crc >> 8));
    return reply;
}

class Lines {
  public:
    Lines(int count, double baud) : character_(11 / baud), epoll_(::epoll_create1(0)) {
        for (int i = 0; i < count; ++i) {
            const int fd = listen_anywhere();
            is_listener_.resize(static_cast<std::size_t>(fd) + 1);
            is_listener_[static_cast<std::size_t>(fd)] = true;
            watch(epoll_, fd);
        }
        is_listener_.resize(8192);
        std::fflush(stdout);
    }

    /// Ends with its process.
    [[noreturn]] void serve() {
        while (true) {
            timespec pause{1, 0};
            if (!due_.empty())
                pause = {0, std::chrono::nanoseconds(
                                std::clamp(due_.top().at - Clock::now(), Clock::duration{},
                                           Clock::duration(std::chrono::milliseconds(999))))
                                .count()};
            epoll_event events[256];
            const int ready = ::epoll_pwait2(epoll_, events, 256, &pause, nullptr);
            for (int i = 0; i < ready; ++i) hear(events[i].data.fd);
            for (const auto now = Clock::now(); !due_.empty() && due_.top().at <= now; due_.pop())
                static_cast<void>(::send(due_.top().fd, due_.top().reply.data(),
                                         due_.top().reply.size(), MSG_NOSIGNAL));
        }
    }

  private:
    void hear(int fd) {
        if (is_listener_[static_cast<std::size_t>(fd)]) {
            const int peer = ::accept(fd, nullptr, nullptr);
            no_delay(peer);
            return watch(epoll_, peer);
        }
        Bytes& bytes = heard_[fd];
        if (!receive(fd, bytes)) {
            bytes.clear();
            ::close(fd);
            return;
        }
        for (; bytes.size() >= kRtuRead; bytes.erase(bytes.begin(), bytes.begin() + kRtuRead)) {
            Bytes reply = rtu_reply(bytes);
            const double seconds =
                character_ * static_cast<double>(kRtuRead + reply.size()) + 0.005;
            due_.push({Clock::now() + std::chrono::microseconds(static_cast<long>(1e6 * seconds)),
                       fd, std::move(reply)});
        }
    }

    double character_;  ///< seconds
    int epoll_;
    std::vector<bool> is_listener_;
    std::map<int, Bytes> heard_;
    std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
};

// The clients

struct Line {
    std::vector<float> milliseconds;
    unsigned wrong = 0;
};

struct Asker {
    int fd = -1;
    int line = 0;
    unsigned first = 1;
    unsigned units = 1;
    unsigned number = 0;
    unsigned unit = 1;
    unsigned address = 0;
    Bytes heard{};
    Clock::time_point asked{};

    void ask() {
        ++number;
        unit = first + number % units;
        // Apart from others, so that no two requests share a transaction.
        address = (number * 2654435761U >> 16) % 6000 * kCount;
        Bytes request;
        for (const unsigned one : {number & 0xFFFF, 0U, 6U}) put(request, one);
        request.push_back(static_cast<std::uint8_t>(unit));
        request.push_back(3);
        put(request, address);
        put(request, kCount);
        asked = Clock::now();
        static_cast<void>(::send(fd, request.data(), request.size(), MSG_NOSIGNAL));
    }

    bool is_right() const {
        if (heard.size() != 9 + 2 * kCount || word(heard, 0) != (number & 0xFFFF)) return false;
        for (unsigned i = 0; i < kCount; ++i)
            if (word(heard, 9 + 2 * i) != value_of((unit - 1) % 16 + 1, address + i)) return false;
        return true;
    }
};

std::vector<Asker> askers() {
    std::vector<Asker> all;
    unsigned host = 0;
    unsigned port = 0;
    Asker one;
    while (std::scanf("%u %u %d %u %u", &host, &port, &one.line, &one.first, &one.units) == 5) {
        one.fd = ::socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in address = local(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + host);
        if (::connect(one.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            std::exit(1);
        no_delay(one.fd);
        one.number = static_cast<unsigned>(all.size()) * 7919;
        all.push_back(one);
    }
    return all;
}

void load(double seconds) {
    std::vector<Asker> all = askers();
    std::map<int, Line> lines;
    const int epoll = ::epoll_create1(0);
    for (std::size_t i = 0; i < all.size(); ++i) {
        epoll_event event{};
        event.events = EPOLLIN;
        event.data.u64 = i;
        ::epoll_ctl(epoll, EPOLL_CTL_ADD, all[i].fd, &event);
        all[i].ask();
    }
    const auto end = Clock::now() + std::chrono::microseconds(static_cast<long>(1e6 * seconds));
    while (Clock::now() < end) {
        epoll_event events[256];
        const int ready = ::epoll_wait(epoll, events, 256, 100);
        for (int i = 0; i < ready; ++i) {
            Asker& one = all[events[i].data.u64];
            if (!receive(one.fd, one.heard)) std::exit(1);
            if (one.heard.size() < 9) continue;
            Line& line = lines[one.line];
            line.milliseconds.push_back(
                std::chrono::duration<float, std::milli>(Clock::now() - one.asked).count());
            line.wrong += one.is_right() ? 0 : 1;
            one.heard.clear();
            one.ask();
        }
    }
    for (auto& [number, line] : lines) {
        const auto at =
            line.milliseconds.begin() + static_cast<long>(line.milliseconds.size() * 99 / 100);
        std::nth_element(line.milliseconds.begin(), at, line.milliseconds.end());
        std::printf("%d %zu %u %.2f\n", number, line.milliseconds.size(), line.wrong,
                    static_cast<double>(*at));
    }
}

}  // namespace

int main(int count, char** arguments) {
    const std::string what = count > 1 ? arguments[1] : "";
    if (what == "bus" && count == 4)
        Lines(std::atoi(arguments[2]), std::atof(arguments[3])).serve();
    if (what == "load" && count == 3)
        load(std::atof(arguments[2]));
    else
        return 64;
    return 0;
}
