#include "driver.hpp"

#include <asm/ioctls.h>
#include <linux/serial.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>

namespace panelgate::line {

Driver look_at_driver(int fd, PortOps& ops) {
    Driver driver;
    serial_struct info{};
    // A pseudo-terminal does not support this, and its TIOCOUTQ does not describe a wire.
    if (ops.control(fd, TIOCGSERIAL, &info) < 0) return driver;
    int queued = 0;
    driver.tells_queue = ops.control(fd, TIOCOUTQ, &queued) >= 0;
    // On a USB adapter it would be a round trip, which must not block the loop.
    unsigned status = 0;
    driver.tells_empty = info.type != PORT_UNKNOWN && ops.control(fd, TIOCSERGETLSR, &status) >= 0;
    return driver;
}

Duration unsent_time(int fd, const Driver& driver, Duration character, PortOps& ops) {
    int queued = 0;
    if (driver.tells_queue && ops.control(fd, TIOCOUTQ, &queued) < 0) queued = 0;
    unsigned status = TIOCSER_TEMT;
    if (driver.tells_empty && ops.control(fd, TIOCSERGETLSR, &status) < 0) status = TIOCSER_TEMT;
    const int shifting = (status & TIOCSER_TEMT) == 0 ? 1 : 0;
    return (std::max(queued, 0) + shifting) * character;
}

void drop_unsent(int fd, PortOps& ops) {
    ops.control(fd, TCFLSH, reinterpret_cast<void*>(std::uintptr_t{TCOFLUSH}));
}

namespace {

/// Returns an empty text if the adapter has no such timer, or it is now 1 ms.
std::string lower_latency_timer(const std::string& device, const std::string& sysfs) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path real = fs::canonical(device, error);
    if (error) return {};
    const fs::path file = fs::path(sysfs) / "class/tty" / real.filename() / "device/latency_timer";
    int now = 0;
    if (!(std::ifstream(file) >> now) || now <= 1) return {};
    std::ofstream out(file);
    if (out << 1 << std::flush) return {};
    return "the adapter keeps received bytes for up to " + std::to_string(now) +
           " ms; let this user write " + file.string() + " (deploy/udev has a rule)";
}

}  // namespace

std::string ask_low_latency(int fd, const std::string& device, PortOps& ops,
                            const std::string& sysfs) {
    serial_struct info{};
    if (ops.control(fd, TIOCGSERIAL, &info) >= 0) {
        if ((info.flags & static_cast<int>(ASYNC_LOW_LATENCY)) == 0) {
            info.flags |= static_cast<int>(ASYNC_LOW_LATENCY);
            ops.control(fd, TIOCSSERIAL, &info);
        }
    }
    return lower_latency_timer(device, sysfs);
}

std::optional<UartErrorCount::Raw> UartErrorCount::read(int fd, PortOps& ops) {
    serial_icounter_struct counts{};
    if (ops.control(fd, TIOCGICOUNT, &counts) < 0) return std::nullopt;
    const auto number = [](int value) { return static_cast<std::uint32_t>(value); };
    return Raw{number(counts.frame), number(counts.parity),
               number(counts.overrun) + number(counts.buf_overrun), number(counts.brk)};
}

void UartErrorCount::opened(int fd, PortOps& ops) {
    seen_ = read(fd, ops);
    if (seen_ && !sum_) sum_.emplace();
}

std::optional<UartErrors> UartErrorCount::look(int fd, PortOps& ops) {
    if (!seen_) return sum_;
    const auto now = read(fd, ops);
    if (!now) return sum_;
    // The driver's counters are 32 bits wide and wrap; so does this difference.
    sum_->framing += now->framing - seen_->framing;
    sum_->parity += now->parity - seen_->parity;
    sum_->overruns += now->overruns - seen_->overruns;
    sum_->breaks += now->breaks - seen_->breaks;
    seen_ = now;
    return sum_;
}

}  // namespace panelgate::line
