#include "panelgate/line/pty.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "panelgate/line/termios_setup.hpp"

namespace panelgate::line {
namespace {

[[noreturn]] void fail(const char* what) {
    throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

Pty::Pty(const SerialFormat& format) {
    master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master_ < 0) fail("posix_openpt");
    std::array<char, 64> name{};
    if (grantpt(master_) != 0 || unlockpt(master_) != 0 ||
        ptsname_r(master_, name.data(), name.size()) != 0) {
        const int error = errno;
        ::close(master_);
        errno = error;
        fail("a pseudo-terminal");
    }
    path_ = name.data();
    slave_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (slave_ < 0) {
        const int error = errno;
        ::close(master_);
        errno = error;
        fail(path_.c_str());
    }
    set_up_tty(slave_, format);  // raw: a pty starts with echo and line editing
}

Pty::~Pty() {
    ::close(slave_);
    ::close(master_);
}

}  // namespace panelgate::line
