// guest: as process 1 of an emulated machine it runs the checks of src/line on
// /dev/ttyS1, or an adapter on USB when it was given modules, and switches the machine off.
// Anywhere else:
//   guest record            what a new pseudo-terminal answers, to stdout
//   guest record DEVICE     what the driver of DEVICE answers
#include <sys/mount.h>
#include <sys/reboot.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/utsname.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <set>
#include <string_view>

#include "checks.hpp"
#include "conversation.hpp"
#include "record.hpp"

namespace {

using panelgate::line::Checks;
using panelgate::line::Port;

/// What a program expects to find. The kernel has opened no console for us: there was no /dev yet.
void furnish() {
    for (const char* folder : {"/proc", "/sys", "/dev", "/tmp"}) ::mkdir(folder, 0755);
    ::mount("proc", "/proc", "proc", 0, nullptr);
    ::mount("sysfs", "/sys", "sysfs", 0, nullptr);
    ::mount("devtmpfs", "/dev", "devtmpfs", 0, nullptr);
    const int console = ::open("/dev/console", O_RDWR | O_NOCTTY);
    for (int fd = 0; fd < 3; ++fd) ::dup2(console, fd);
}

/// Loads /modules/* in the order of their names. False when there are none: what is built into the
/// kernel does.
bool load_modules() {
    namespace fs = std::filesystem;
    if (!fs::exists("/modules")) return false;
    std::set<fs::path> files;
    for (const auto& entry : fs::directory_iterator("/modules")) files.insert(entry.path());
    for (const fs::path& file : files) {
        const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
        if (::syscall(SYS_finit_module, fd, "", 0) != 0) std::perror(file.c_str());
        ::close(fd);
    }
    return true;
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
    const bool on_usb = load_modules();
    const char* path = on_usb ? "/dev/ttyUSB0" : "/dev/ttyS1";
    // On USB the node is there before it can be opened.
    panelgate::line::wait_until([path] { return Port(path).is_open(); });
    panelgate::line::report(on_usb ? "ftdi" : "8250", Port(path).fd());
    Checks checks(path);
    on_usb ? checks.run_adapter() : checks.run_uart();
    std::printf("guest: done, %d checks, %d failed\n", checks.count(), checks.failed());
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
