// serial_pair BAUD SLAVE MASTER...: one serial line, 8N1, from a pseudo-terminal for somebody's
// slave to pseudo-terminals for masters that take turns: whoever spoke last hears the slave.
// Arguments are links to make. BAUD 0: unpaced. It prints `ready`, and at the end of stdin how many
// characters met.
#include <poll.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <memory>
#include <vector>

#include "far_end.hpp"
#include "frame.hpp"
#include "wire.hpp"

namespace {

constexpr int kSlave = 1;
constexpr int kBits = 10;

class Pair {
  public:
    Pair(long baud, const char* slave, const std::vector<const char*>& masters)
        : wire_(baud == 0 ? 0 : kBits * zoo::kSecond / baud, 1) {
        ends_.push_back(zoo::make_pty(slave));
        for (const char* link : masters) ends_.push_back(zoo::make_pty(link));
    }

    // Until stdin says anything or ends.
    void run() {
        while (!wait()) step(zoo::now());
    }

    unsigned long long collisions() const { return wire_.collisions(); }

  private:
    bool wait() const {
        std::vector<pollfd> all{{0, POLLIN, 0}};
        for (const auto& end : ends_) all.push_back({end->descriptor(), POLLIN, 0});
        const auto grain = std::max(100 * zoo::kMicrosecond, wire_.character());
        const auto next = wire_.next(last_step_ + grain);
        const auto pause = next ? std::max<zoo::Time>(*next - zoo::now(), 0) : zoo::kSecond;
        const timespec until{pause / zoo::kSecond, pause % zoo::kSecond};
        ::ppoll(all.data(), all.size(), &until, nullptr);
        return all[0].revents != 0;
    }

    void step(zoo::Time at) {
        last_step_ = at;
        for (std::size_t i = 0; i < ends_.size(); ++i) {
            const zoo::Bytes said = ends_[i]->read();
            if (said.empty()) continue;
            if (i > 0) listener_ = i;
            wire_.say({.start = at, .speaker = i == 0 ? kSlave : zoo::kMaster, .bytes = said});
        }
        zoo::Bytes to_slave, to_master;
        while (const auto c = wire_.passed(at)) {
            (c->speaker == kSlave ? to_master : to_slave).push_back(c->value);
        }
        if (!to_slave.empty()) ends_[0]->write(to_slave);
        if (!to_master.empty()) ends_[listener_]->write(to_master);
    }

    zoo::Wire wire_;
    std::vector<std::unique_ptr<zoo::FarEnd>> ends_;  // the slave's is the first
    std::size_t listener_ = 1;
    zoo::Time last_step_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc < 4) return 64;
    try {
        Pair pair(std::atol(argv[1]), argv[2], {argv + 3, argv + argc});
        ::prctl(PR_SET_TIMERSLACK, 1);
        std::puts("ready");
        std::fflush(stdout);
        pair.run();
        std::printf("%llu\n", pair.collisions());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "serial_pair: %s\n", error.what());
        return 69;
    }
    return 0;
}
