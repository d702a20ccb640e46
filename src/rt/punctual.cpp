#include "panelgate/rt/punctual.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sched_attr.hpp"

namespace panelgate::rt {

namespace {

/// Who says that it needs the processor for no longer than that at a time is let in before
/// programs that compute (Linux 6.12 and later; earlier ones take no notice). Nobody has to grant
/// it.
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
        // Threads that it starts are not to compete with it.
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

}  // namespace panelgate::rt
