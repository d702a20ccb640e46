#include "panelgate/rt/punctual.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>

namespace panelgate::rt {

std::vector<std::string> be_punctual(const RealtimeSettings& settings) {
    std::vector<std::string> refused;
    ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
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
