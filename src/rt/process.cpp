#include "panelgate/rt/process.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <numeric>

namespace panelgate::rt {

std::size_t raise_descriptor_limit() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return std::numeric_limits<std::size_t>::max();
    const rlimit raised{limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    return limit.rlim_cur;
}

std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked) {
    const std::size_t sum = std::accumulate(asked.begin(), asked.end(), std::size_t{0});
    if (sum <= available) return asked;
    const double part = static_cast<double>(available) / static_cast<double>(sum);
    std::vector<std::size_t> granted;
    for (const std::size_t wish : asked) {
        const auto share = static_cast<std::size_t>(static_cast<double>(wish) * part);
        granted.push_back(std::max(share, std::size_t{1}));
    }
    return granted;
}

namespace {

/// A thread that asks for short slices runs before compute-bound programs (Linux 6.12 and later;
/// earlier kernels ignore it). No privilege is needed.
void ask_for_short_slices() {
    constexpr unsigned kSlice = 100'000;  // ns, the shortest that Linux takes
    SchedAttr attributes;
    if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return;
    if (attributes.policy != SCHED_OTHER) return;
    attributes.runtime = kSlice;
    ::syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

std::vector<std::string> be_punctual(const RealtimeSettings& settings) {
    std::vector<std::string> refused;
    ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    ask_for_short_slices();
    if (settings.priority > 0) {
        const sched_param parameter{.sched_priority = settings.priority};
        // Its child threads must not compete with it.
        if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) != 0) {
            refused.push_back("realtime.priority " + std::to_string(settings.priority) + ": " +
                              std::strerror(errno) +
                              "; it takes CAP_SYS_NICE (docker run --cap-add SYS_NICE) or "
                              "LimitRTPRIO in the unit");
        }
    }
    if (settings.lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        refused.push_back(std::string("realtime.lock_memory: ") + std::strerror(errno) +
                          "; it takes CAP_IPC_LOCK (docker run --cap-add IPC_LOCK) or "
                          "LimitMEMLOCK=infinity in the unit");
    }
    return refused;
}

void LoopLag::start() { arm(clock_.now() + kEvery); }

void LoopLag::arm(TimePoint due) {
    alarm_->arm(due, [this, due] {
        const TimePoint now = clock_.now();
        seconds_.observe(now - due);
        arm(now + kEvery);
    });
}

}  // namespace panelgate::rt
