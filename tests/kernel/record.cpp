#include "record.hpp"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <asm/termios.h>
#include <linux/serial.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ostream>
#include <sstream>

#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {
namespace {

std::string hex(std::uint64_t value) {
    std::ostringstream text;
    text << "0x" << std::hex << value;
    return text.str();
}

std::string field(const char* name, std::int64_t value) {
    return std::string(name) + '=' + std::to_string(value);
}

std::string text_of(const termios2& t) {
    return "iflag=" + hex(t.c_iflag) + ",oflag=" + hex(t.c_oflag) + ",cflag=" + hex(t.c_cflag) +
           ",lflag=" + hex(t.c_lflag) + ',' + field("ispeed", t.c_ispeed) + ',' +
           field("ospeed", t.c_ospeed) + ',' + field("vmin", t.c_cc[VMIN]) + ',' +
           field("vtime", t.c_cc[VTIME]);
}

std::string text_of(const serial_struct& info) {
    return field("type", info.type) + ",flags=" + hex(static_cast<std::uint32_t>(info.flags)) +
           ',' + field("baud_base", info.baud_base) + ',' +
           field("xmit_fifo_size", info.xmit_fifo_size) + ',' +
           field("custom_divisor", info.custom_divisor);
}

std::string text_of(const serial_rs485& rs485) {
    return "flags=" + hex(rs485.flags) + ',' + field("before", rs485.delay_rts_before_send) + ',' +
           field("after", rs485.delay_rts_after_send);
}

std::string text_of(const serial_icounter_struct& c) {
    return field("frame", c.frame) + ',' + field("parity", c.parity) + ',' +
           field("overrun", c.overrun) + ',' + field("buf_overrun", c.buf_overrun) + ',' +
           field("brk", c.brk);
}

std::string text_of(int value) { return field("value", value); }
std::string text_of(unsigned value) { return "bits=" + hex(value); }

class Recorder {
  public:
    Recorder(int fd, std::ostream& out) : fd_(fd), out_(out) {}

    /// Asks for a Value; true when there was one.
    template <class Value>
    bool get(const char* name, unsigned long request, Value& value) {
        const int result = kernel_ops().control(fd_, request, &value);
        line(name, "-", result, result < 0 ? "-" : text_of(value));
        return result >= 0;
    }
    /// Gives a Value; what the driver made of the argument itself is the answer.
    template <class Value>
    void set(const char* name, unsigned long request, Value value, const std::string& asked) {
        const int result = kernel_ops().control(fd_, request, &value);
        line(name, asked, result, "-");
    }
    void order(const char* name, unsigned long request, std::uintptr_t argument,
               const std::string& asked) {
        line(name, asked, kernel_ops().control(fd_, request, reinterpret_cast<void*>(argument)),
             "-");
    }

  private:
    void line(const char* name, const std::string& asked, int result, const std::string& answer) {
        const std::string said =
            result < 0 ? std::string("-") + strerrorname_np(-result) : std::to_string(result);
        out_ << name << ' ' << asked << ' ' << said << ' ' << answer << '\n';
    }

    int fd_;
    std::ostream& out_;
};

struct Format {
    const char* name;
    tcflag_t bits;
    speed_t baud;
};

void record_formats(Recorder& recorder, const termios2& before) {
    constexpr Format kFormats[] = {
        {"1200-8N1", CS8, 1200},
        {"19200-8E1", CS8 | PARENB, 19'200},
        {"19200-8O1", CS8 | PARENB | PARODD, 19'200},
        {"115200-8N2", CS8 | CSTOPB, 115'200},
        {"38400-7E1", CS7 | PARENB, 38'400},
        {"12345-8N1", CS8, 12'345},
        {"250000-8N1", CS8, 250'000},
        {"9600-8N1", CS8, 9600},
    };
    termios2 got{};
    for (const Format& format : kFormats) {
        termios2 t = before;  // with its special characters
        t.c_iflag = IGNBRK;
        t.c_oflag = t.c_lflag = 0;
        t.c_cflag = format.bits | CREAD | CLOCAL | BOTHER;
        t.c_ispeed = t.c_ospeed = format.baud;
        t.c_cc[VMIN] = 1;
        t.c_cc[VTIME] = 0;
        recorder.set("TCSETS2", TCSETS2, t, format.name);
        recorder.get("TCGETS2", TCGETS2, got);
    }
}

void record_rs485(Recorder& recorder) {
    serial_rs485 rs485{};
    recorder.get("TIOCGRS485", TIOCGRS485, rs485);
    rs485 = {};
    rs485.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND;
    rs485.delay_rts_before_send = 1;
    recorder.set("TIOCSRS485", TIOCSRS485, rs485, text_of(rs485));
    recorder.get("TIOCGRS485", TIOCGRS485, rs485);
    recorder.set("TIOCSRS485", TIOCSRS485, serial_rs485{}, "off");
}

void record_low_latency(Recorder& recorder) {
    serial_struct info{};
    if (!recorder.get("TIOCGSERIAL", TIOCGSERIAL, info)) return;
    const serial_struct before = info;
    info.flags |= static_cast<int>(ASYNC_LOW_LATENCY);
    recorder.set("TIOCSSERIAL", TIOCSSERIAL, info, "low_latency");
    recorder.get("TIOCGSERIAL", TIOCGSERIAL, info);
    recorder.set("TIOCSSERIAL", TIOCSSERIAL, before, "as_before");
}

void record_modem_lines(Recorder& recorder) {
    int lines = 0;
    const int rts = TIOCM_RTS;
    recorder.get("TIOCMGET", TIOCMGET, lines);
    recorder.set("TIOCMBIC", TIOCMBIC, rts, "rts");
    recorder.get("TIOCMGET", TIOCMGET, lines);
    recorder.set("TIOCMBIS", TIOCMBIS, rts, "rts");
    recorder.get("TIOCMGET", TIOCMGET, lines);
}

}  // namespace

void record(int fd, std::ostream& out) {
    Recorder recorder(fd, out);
    termios2 first{};
    recorder.get("TCGETS2", TCGETS2, first);
    record_formats(recorder, first);
    record_low_latency(recorder);
    record_rs485(recorder);
    record_modem_lines(recorder);
    serial_icounter_struct counts{};
    recorder.get("TIOCGICOUNT", TIOCGICOUNT, counts);
    int queued = 0;
    recorder.get("TIOCOUTQ", TIOCOUTQ, queued);
    recorder.get("TIOCINQ", TIOCINQ, queued);
    unsigned status = 0;
    recorder.get("TIOCSERGETLSR", TIOCSERGETLSR, status);
    recorder.order("TCFLSH", TCFLSH, TCIOFLUSH, "both");
    recorder.order("TIOCEXCL", TIOCEXCL, 0, "-");
    recorder.order("TIOCNXCL", TIOCNXCL, 0, "-");
}

void report(const char* table, int fd) {
    std::stringstream lines;
    record(fd, lines);
    for (std::string line; std::getline(lines, line);)
        std::printf("record %s: %s\n", table, line.c_str());
}

}  // namespace panelgate::line
