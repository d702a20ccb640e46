// Loaded in front of the system's library: the clock on the wall is wrong by as many seconds as the
// file $WRONG_CLOCK_STEP says, which a test changes while the program runs.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <ctime>

namespace {

long step() {
    const char* const path = ::getenv("WRONG_CLOCK_STEP");
    const int file = path == nullptr ? -1 : ::open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return 0;
    std::array<char, 32> text{};
    const ssize_t size = ::read(file, text.data(), text.size() - 1);
    ::close(file);
    return size > 0 ? ::atol(text.data()) : 0;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* now) {
    using Real = int (*)(clockid_t, timespec*);
    static const auto real = reinterpret_cast<Real>(::dlsym(RTLD_NEXT, "clock_gettime"));
    const int failed = real(clock, now);
    if (failed == 0 && clock == CLOCK_REALTIME) now->tv_sec += step();
    return failed;
}
