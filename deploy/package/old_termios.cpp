// For tests under qemu, whose user mode (7.2) knows no struct termios2: the same by the old calls.
// Preloaded into the program. Rates are remembered by descriptor; nothing is paced by them there.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <dlfcn.h>

#include <array>
#include <cstdarg>
#include <cstdlib>

namespace {

struct Rates {
    speed_t in = 38400;
    speed_t out = 38400;
};
std::array<Rates, 1024> g_rates;

using Ioctl = int (*)(int, unsigned long, ...);

Ioctl real() {
    static const auto found = reinterpret_cast<Ioctl>(::dlsym(RTLD_NEXT, "ioctl"));
    if (found == nullptr) std::abort();
    return found;
}

/// struct termios is what struct termios2 begins with.
int get(int fd, termios2* to) {
    termios old{};
    const int result = real()(fd, TCGETS, &old);
    if (result != 0) return result;
    static_assert(sizeof(old) <= sizeof(*to));
    *reinterpret_cast<termios*>(to) = old;
    const Rates& rates = g_rates.at(static_cast<std::size_t>(fd));
    to->c_cflag = (to->c_cflag & ~static_cast<tcflag_t>(CBAUD)) | BOTHER;
    to->c_ispeed = rates.in;
    to->c_ospeed = rates.out;
    return 0;
}

int set(int fd, unsigned long old_request, const termios2& from) {
    termios old = *reinterpret_cast<const termios*>(&from);
    old.c_cflag = (old.c_cflag & ~static_cast<tcflag_t>(CBAUD)) | B38400;
    g_rates.at(static_cast<std::size_t>(fd)) = {from.c_ispeed, from.c_ospeed};
    return real()(fd, old_request, &old);
}

}  // namespace

extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
    va_list more;
    va_start(more, request);
    void* argument = va_arg(more, void*);
    va_end(more);
    if (request == TCGETS2) return get(fd, static_cast<termios2*>(argument));
    if (request == TCSETS2) return set(fd, TCSETS, *static_cast<termios2*>(argument));
    return real()(fd, request, argument);
}
