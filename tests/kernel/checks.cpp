#include "checks.hpp"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <asm/termios.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "conversation.hpp"
#include "driver.hpp"
#include "record.hpp"
#include "tty_trouble.hpp"

namespace panelgate::line {
namespace {

int order(int fd, unsigned long request, std::uintptr_t argument) {
    return ask(fd, request, reinterpret_cast<void*>(argument));
}

/// The name of the device that the port belongs to, in its driver's folder: what "unbind" wants.
std::string device_of(const std::string& driver, const std::string& tty) {
    namespace fs = std::filesystem;
    for (const auto& entry : fs::directory_iterator(driver)) {
        if (!fs::is_symlink(entry) || entry.path().filename() == "module") continue;
        for (const auto& below : fs::recursive_directory_iterator(fs::canonical(entry)))
            if (below.path().filename() == tty) return entry.path().filename();
    }
    return {};
}

void write_file(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

}  // namespace

void Checks::check(const std::string& name, bool good, const std::string& detail) {
    ++count_;
    if (!good) ++failed_;
    std::printf("%s %s %s\n", good ? "ok" : "not ok", name.c_str(), detail.c_str());
    std::fflush(stdout);
}

void Checks::run_uart() {
    formats();
    odd_rate();
    rate_above_base();
    bytes();
    earlier_users();
    stopped_output();
    breaks();
    exclusive();
    sending();
    queue();
    low_latency();
    not_serial();
    absent();
    unbind();
}

void Checks::run_adapter() {
    formats();
    odd_rate();
    rate_of_adapter();
    bytes();
    earlier_users();
    exclusive();
    sending();
    low_latency();
    adapter_timer();
    unplug();
}

void Checks::formats() {
    struct Case {
        const char* name;
        Parity parity;
        int stop_bits;
        tcflag_t bits;
    };
    constexpr Case kCases[] = {{"8N1", Parity::none, 1, CS8},
                               {"8E1", Parity::even, 1, CS8 | PARENB},
                               {"8O1", Parity::odd, 1, CS8 | PARENB | PARODD},
                               {"8N2", Parity::none, 2, CS8 | CSTOPB},
                               {"8E2", Parity::even, 2, CS8 | PARENB | CSTOPB}};
    constexpr int kRates[] = {1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200};
    Port port(port_);
    for (const Case& c : kCases) {
        std::string wrong;
        for (const int baud : kRates) {
            const std::string said = set_up(port, {baud, 8, c.parity, c.stop_bits});
            const termios2 t = settings_of(port.fd());
            const tcflag_t bits = t.c_cflag & (CSIZE | PARENB | PARODD | CSTOPB | CRTSCTS);
            if (said.empty() && bits == c.bits && t.c_ospeed == static_cast<speed_t>(baud))
                continue;
            wrong +=
                " at " + std::to_string(baud) + ": " + said + " made " + std::to_string(t.c_ospeed);
        }
        check(std::string("format.") + c.name, wrong.empty(),
              wrong.empty() ? "1200..115200" : wrong);
    }
}

void Checks::odd_rate() {
    Port port(port_);
    set_up(port, kPlain);
    const std::string odd = set_up(port, {12'345, 8, Parity::none, 1});
    check("rate.12345", odd.empty(),
          odd + "made " + std::to_string(settings_of(port.fd()).c_ospeed));
}

void Checks::rate_above_base() {
    Port port(port_);
    set_up(port, kPlain);
    const std::string above = set_up(port, {250'000, 8, Parity::none, 1});
    check("rate.above_baud_base", above.find(" bit/s of 250000") != above.npos, above);
}

void Checks::rate_of_adapter() {
    Port port(port_);
    const std::string said = set_up(port, {250'000, 8, Parity::none, 1});
    check("rate.250000", said.empty(), said);
}

void Checks::bytes() {
    Port port(port_);
    for (const SerialFormat& format : {kPlain, SerialFormat{}}) {
        const std::string name = "bytes." + to_string(format).substr(6);
        std::string wrong = set_up(port, format);
        if (wrong.empty()) wrong = exchange(port, all_values());
        check(name, wrong.empty(), wrong.empty() ? "256 values both ways" : wrong);
    }
}

void Checks::earlier_users() {
    Port theirs(port_);
    Port port(port_);
    tell_host("mute");  // with the echo of a terminal on this end, answers would never end
    use_as_terminal(theirs.fd());
    std::string wrong = take_over(port);
    check("earlier_user.cooked", wrong.empty(), wrong);
    const termios2 left = settings_of(port.fd());
    constexpr tcflag_t kWanted = CS8 | CREAD | CLOCAL;
    check("earlier_user.nothing_left",
          left.c_iflag == IGNBRK && left.c_oflag == 0 && left.c_lflag == 0 &&
              (left.c_cflag & ~static_cast<tcflag_t>(CBAUD | HUPCL)) == kWanted);

    tell_host("send 6f6c64");
    int waiting = 0;
    wait_until([&] { return ask(port.fd(), TIOCINQ, &waiting) == 0 && waiting == 3; });
    wrong = take_over(port);
    check("earlier_user.unread_input", waiting == 3 && wrong.empty(),
          std::to_string(waiting) + " bytes were waiting " + wrong);
}

void Checks::stopped_output() {
    Port theirs(port_);
    Port port(port_);
    tell_host("mute");
    use_as_terminal(theirs.fd());
    tell_host("send 13");  // XOFF, which stops the output of a port with IXON
    const bool stopped = wait_until([&] {
        int held = 0;
        theirs.write(Bytes{'x'});
        ask(port.fd(), TIOCOUTQ, &held);
        return held > 0;
    });
    const std::string wrong = take_over(port);
    check("earlier_user.stopped_by_xoff", stopped && wrong.empty(), wrong);
}

void Checks::breaks() {
    Port port(port_);
    set_up(port, kPlain);
    UartErrorCount errors;
    errors.opened(port.fd(), kernel_ops());
    tell_host("break");
    const Bytes got = port.read(1, 100);
    const std::string wrong = exchange(port, all_values());
    const auto counted = errors.look(port.fd(), kernel_ops());
    check("break.is_no_byte", got.empty() && wrong.empty(), wrong);
    check("break.is_counted", counted && counted->breaks == 1,
          counted ? "TIOCGICOUNT says " + std::to_string(counted->breaks) : "TIOCGICOUNT refused");
    const bool others = counted && counted->parity + counted->framing + counted->overruns > 0;
    check("break.is_no_other_error", counted && !others);
}

void Checks::exclusive() {
    Port port(port_);
    check("lock.exclusive", ask(port.fd(), TIOCEXCL, nullptr) == 0);
    ::chmod(port_.c_str(), 0666);
    const pid_t child = ::fork();
    if (child == 0) {
        constexpr uid_t kNobody = 65'534;
        const bool dropped = ::setgid(kNobody) == 0 && ::setuid(kNobody) == 0;
        ::_exit(dropped ? Port(port_).error() : 255);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    const int error = WIFEXITED(status) ? WEXITSTATUS(status) : 255;
    check("lock.refuses_other_users", error == EBUSY, std::strerror(error));
    Port other(port_);
    check("lock.root_may_open", other.is_open(), std::strerror(other.error()));
    const bool ours = ::flock(port.fd(), LOCK_EX | LOCK_NB) == 0;
    const bool theirs = ::flock(other.fd(), LOCK_EX | LOCK_NB) == 0;
    check("lock.flock", ours && !theirs && errno == EWOULDBLOCK);
    const std::string holder = holder_of_lock(other.fd());
    check("lock.holder", holder == "process " + std::to_string(::getpid()), holder);
    ask(port.fd(), TIOCNXCL, nullptr);
}

void Checks::sending() {
    Port port(port_);
    set_up(port, kPlain);
    Rs485 settings;
    settings.mode = Rs485::Mode::kernel;
    const std::string error = set_up_rs485(port.fd(), settings, kernel_ops()).error;
    check("rs485.kernel_mode_is_refused", error.starts_with("its driver cannot switch RS-485"),
          error);
    for (const bool sending : {true, false}) {
        const std::string said = switch_rts(port.fd(), settings, sending, kernel_ops());
        int lines = 0;
        ask(port.fd(), TIOCMGET, &lines);
        check(sending ? "rts.high_to_send" : "rts.low_to_listen",
              said.empty() && ((lines & TIOCM_RTS) != 0) == sending, said);
    }
}

void Checks::queue() {
    Port port(port_);
    set_up(port, kPlain);
    const Driver driver = look_at_driver(port.fd(), kernel_ops());
    check("queue.is_told", driver.tells_queue);
    check("queue.last_bit_is_told", driver.tells_empty);
    const auto unsent = [&] { return unsent_time(port.fd(), driver, 1ms, kernel_ops()) / 1ms; };
    check("queue.idle", unsent() == 0, std::to_string(unsent()) + " characters");
    order(port.fd(), TCXONC, TCOOFF);
    const Bytes frame(100, 0x55);
    port.write(frame);
    const auto held = unsent();
    check("queue.counts_what_is_held", held == 100, std::to_string(held) + " characters");
    order(port.fd(), TCXONC, TCOON);
    const std::size_t back = port.read(frame.size()).size();
    check("queue.empties", back == frame.size() && unsent() == 0, std::to_string(back) + " back");
}

void Checks::low_latency() {
    const auto is_on = [](Port& port) {
        serial_struct info{};
        ask(port.fd(), TIOCGSERIAL, &info);
        return (static_cast<unsigned>(info.flags) & ASYNC_LOW_LATENCY) != 0;
    };
    Port port(port_);
    const bool before = is_on(port);
    const std::string said = ask_low_latency(port.fd(), port_, kernel_ops());
    check("low_latency.taken", said.empty() && is_on(port), before ? "was on before" : said);
    port.close();
    Port again(port_);
    check("low_latency.stays_after_close", is_on(again));
}

void Checks::not_serial() {
    Port null("/dev/null");
    const std::string error = set_up(null, kPlain);
    check("not_serial", error.starts_with("not a serial device"), error);
}

void Checks::absent() {
    // 8250.nr_uarts makes four nodes; the machine has two UARTs.
    Port port("/dev/ttyS3");
    const std::string said = set_up(port, kPlain);
    serial_struct info{};
    const bool unknown = ask(port.fd(), TIOCGSERIAL, &info) == 0 && info.type == PORT_UNKNOWN;
    check("absent.is_unknown", unknown, "type " + std::to_string(info.type));
    check("absent.is_an_error", said.ends_with(std::strerror(EIO)), said);
    const Driver driver = look_at_driver(port.fd(), kernel_ops());
    check("absent.tells_no_last_bit", !driver.tells_empty);
    report("absent", port.fd());
}

void Checks::adapter_timer() {
    const std::string file = "/sys/class/tty/" + std::filesystem::path(port_).filename().string() +
                             "/device/latency_timer";
    write_file(file, "16");
    Port port(port_);
    const Driver driver = look_at_driver(port.fd(), kernel_ops());
    check("queue.is_told", driver.tells_queue);
    check("queue.last_bit_is_not_asked_for", !driver.tells_empty);
    const std::string said = ask_low_latency(port.fd(), port_, kernel_ops());
    int now = 0;
    std::ifstream(file) >> now;
    check("low_latency.timer", said.empty() && now == 1, std::to_string(now) + " ms " + said);
}

void Checks::unbind() {
    const std::string folder = "/sys/bus/pnp/drivers/serial/";
    const std::string device = device_of(folder, std::filesystem::path(port_).filename());
    check("unplug.device", !device.empty(), device);
    take_away([&] { write_file(folder + "unbind", device); },
              [&] { write_file(folder + "bind", device); });
}

void Checks::unplug() {
    take_away([] { tell_host("unplug"); },
              [this] {
                  tell_host("plug");
                  wait_until([this] { return Port(port_).is_open(); });
              });
}

void Checks::take_away(const std::function<void()>& take, const std::function<void()>& give) {
    Port port(port_);
    set_up(port, kPlain);
    take();
    pollfd p{port.fd(), POLLIN, 0};
    const int polled = ::poll(&p, 1, 3000);
    std::uint8_t byte = 0;
    const ssize_t n = ::read(port.fd(), &byte, 1);
    check("unplug.wakes_and_reads_nothing", polled == 1 && n == 0,
          "read " + std::to_string(n) + " revents " + std::to_string(p.revents));
    const ssize_t sent = ::write(port.fd(), &byte, 1);
    check("unplug.write_fails", sent < 0 && errno == EIO, std::strerror(errno));
    const std::string said = set_up(port, kPlain);
    check("unplug.settings_fail", !said.empty(), said);
    const Driver driver{true, true};
    check("unplug.nothing_unsent", unsent_time(port.fd(), driver, 1ms, kernel_ops()) == 0ms);
    report("gone", port.fd());
    Port gone(port_);
    const std::string why = set_up(gone, kPlain);
    check("unplug.open_again_fails", !why.empty(), why);
    gone.close();
    port.close();
    give();
    Port back(port_);
    std::string wrong = set_up(back, kPlain);
    if (wrong.empty()) wrong = exchange(back, all_values());
    check("unplug.plugged_in_again", wrong.empty(), wrong);
}

}  // namespace panelgate::line
