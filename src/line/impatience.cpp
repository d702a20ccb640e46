#include "impatience.hpp"

#include <signal.h>
#include <unistd.h>

#include <chrono>

namespace panelgate::line {
namespace {

timespec to_timespec(Duration d) {
    const auto whole = std::chrono::floor<std::chrono::seconds>(d);
    timespec time{};
    time.tv_sec = static_cast<decltype(time.tv_sec)>(whole.count());
    time.tv_nsec = static_cast<decltype(time.tv_nsec)>((d - whole).count());
    return time;
}

}  // namespace

Impatience::Impatience(Duration patience) {
    // Once for the program: a signal that comes late must not meet the default, which ends it.
    static const bool handled = [] {
        struct sigaction nothing{};
        nothing.sa_handler = [](int) {};  // without SA_RESTART
        return ::sigaction(SIGALRM, &nothing, nullptr) == 0;
    }();
    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = SIGALRM;
    event._sigev_un._tid = ::gettid();  // sigev_notify_thread_id has no name in glibc 2.36
    armed_ = handled && ::timer_create(CLOCK_MONOTONIC, &event, &timer_) == 0;
    const itimerspec times{to_timespec(patience), to_timespec(patience)};
    if (armed_) ::timer_settime(timer_, 0, &times, nullptr);
}

Impatience::~Impatience() {
    if (armed_) ::timer_delete(timer_);
}

}  // namespace panelgate::line
