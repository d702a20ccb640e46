#include "panelgate/base/thread.hpp"

#include <csignal>
#include <utility>

namespace panelgate {

std::thread start_thread(std::function<void()> run) {
    sigset_t all{};
    sigset_t before{};
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    std::thread thread(std::move(run));
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return thread;
}

}  // namespace panelgate
