#include "tty_trouble.hpp"

#include <grp.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace panelgate::line {

namespace {

std::string name_of_group(gid_t gid) {
    std::array<char, 4096> buffer;
    group entry{};
    group* found = nullptr;
    const bool known = ::getgrgid_r(gid, &entry, buffer.data(), buffer.size(), &found) == 0;
    const std::string number = std::to_string(gid);
    return known && found != nullptr ? std::string(found->gr_name) + " (" + number + ')' : number;
}

}  // namespace

std::string explain_open_error(const std::string& device, int error) {
    const std::string text = std::strerror(error);
    struct stat info{};
    if (error != EACCES || ::stat(device.c_str(), &info) != 0) return text;
    std::array<char, 8> mode;
    std::snprintf(mode.data(), mode.size(), "%03o", info.st_mode & 0777u);
    return text + ": it belongs to group " + name_of_group(info.st_gid) + " with mode " +
           mode.data() + ", this is uid " + std::to_string(::geteuid()) + " gid " +
           std::to_string(::getegid()) + "; add the user to that group, with Docker: --group-add " +
           std::to_string(info.st_gid);
}

std::string holder_of_lock(int fd) {
    struct stat info{};
    if (::fstat(fd, &info) != 0) return "another program";
    std::array<char, 64> file;  // as /proc/locks writes it: MAJOR:MINOR:INODE
    std::snprintf(file.data(), file.size(), "%02x:%02x:%lu", major(info.st_dev), minor(info.st_dev),
                  static_cast<unsigned long>(info.st_ino));
    std::ifstream locks("/proc/locks");
    std::string number;
    std::string kind;
    std::string strength;
    std::string way;
    std::string pid;
    std::string where;
    std::string rest;
    while (locks >> number >> kind >> strength >> way >> pid >> where) {
        std::getline(locks, rest);
        if (kind == "FLOCK" && where == file.data() && pid != "-1") return "process " + pid;
    }
    return "another program";
}

namespace {

timespec to_timespec(Duration d) {
    const auto whole = std::chrono::floor<std::chrono::seconds>(d);
    timespec time{};
    time.tv_sec = static_cast<decltype(time.tv_sec)>(whole.count());
    time.tv_nsec = static_cast<decltype(time.tv_nsec)>((d - whole).count());
    return time;
}

}  // namespace

CallInterrupter::CallInterrupter(Duration patience) {
    // Once per program: a late signal must not meet the default action, which ends the program.
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

CallInterrupter::~CallInterrupter() {
    if (armed_) ::timer_delete(timer_);
}

}  // namespace panelgate::line
