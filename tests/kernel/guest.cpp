// guest: as process 1 of an emulated machine it runs the checks of src/line on /dev/ttyS1 and
// switches the machine off. Anywhere else:
//   guest record            what a new pseudo-terminal answers, to stdout
//   guest record DEVICE     what the driver of DEVICE answers
#include <sys/mount.h>
#include <sys/reboot.h>
#include <sys/stat.h>
#include <sys/utsname.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string_view>

#include "checks.hpp"
#include "port.hpp"
#include "record.hpp"

namespace {

using panelgate::line::Checks;
using panelgate::line::Port;

constexpr const char* kPort = "/dev/ttyS1";

/// What a program expects to find. The kernel has opened no console for us: there was no /dev yet.
void furnish() {
    for (const char* folder : {"/proc", "/sys", "/dev", "/tmp"}) ::mkdir(folder, 0755);
    ::mount("proc", "/proc", "proc", 0, nullptr);
    ::mount("sysfs", "/sys", "sysfs", 0, nullptr);
    ::mount("devtmpfs", "/dev", "devtmpfs", 0, nullptr);
    const int console = ::open("/dev/console", O_RDWR | O_NOCTTY);
    for (int fd = 0; fd < 3; ++fd) ::dup2(console, fd);
}

int record_device(const std::string& path) {
    Port port(path);
    if (!port.is_open()) {
        std::cerr << path << ": " << std::strerror(port.error()) << '\n';
        return 1;
    }
    panelgate::line::record(port.fd(), std::cout);
    return 0;
}

int record_pty() {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
    const char* path = master < 0 || ::unlockpt(master) != 0 ? nullptr : ::ptsname(master);
    if (path == nullptr) {
        std::perror("a pseudo-terminal");
        return 1;
    }
    return record_device(path);
}

void run_as_init() {
    furnish();
    utsname system{};
    ::uname(&system);
    std::printf("guest: Linux %s\n", system.release);
    panelgate::line::report("8250", Port(kPort).fd());
    Checks checks(kPort);
    const int failed = checks.run();
    std::printf("guest: done, %d checks, %d failed\n", checks.count(), failed);
    std::fflush(stdout);
    ::reboot(RB_POWER_OFF);
}

}  // namespace

int main(int argc, char** argv) {
    if (::getpid() == 1) run_as_init();
    if (argc == 2 && std::string_view(argv[1]) == "record") return record_pty();
    if (argc == 3 && std::string_view(argv[1]) == "record") return record_device(argv[2]);
    std::cerr << "usage: guest record [DEVICE]\n";
    return 64;
}
