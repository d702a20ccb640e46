// libmodbus_master rtu TTY|HOST:PORT BAUD UNIT | tcp HOST:PORT UNIT: a libmodbus master, one
// request at a time. rtu has libmodbus' own timeout of 500 ms, the silence that the standard asks
// for between two requests, and a flush after each failure, as its manual has it; over a connection
// it is the same RTU master. For each line on stdin, a number of seconds, it goes on for so long
// and prints
// {"seconds": S, "good": N, "failed": {"FUNCTION: WHY": N, ...}}.
// It reads known registers and writes with 05 06 15 16, and reads back what 06 and 16 wrote.
#include <modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;
constexpr int kCount = 10;
constexpr int kWritable = 0x8000;
constexpr unsigned kCycle = 8;

[[noreturn]] void fail(const char* what) {
    std::fprintf(stderr, "libmodbus_master: %s: %s\n", what, modbus_strerror(errno));
    std::exit(69);
}

class Master {
  public:
    Master(modbus_t* line, int unit, std::chrono::microseconds gap)
        : line_(line), unit_(unit), gap_(gap) {
        if (line == nullptr || modbus_set_slave(line, unit) != 0) fail("open");
    }

    void run(double seconds) {
        good_ = 0;
        failed_.clear();
        const auto start = Clock::now();
        const auto end = start + std::chrono::duration<double>(seconds);
        while (Clock::now() < end || turn_ % kCycle != 0) {
            ask();
            ++turn_;
            std::this_thread::sleep_for(gap_);
        }
        print(std::chrono::duration<double>(Clock::now() - start).count());
    }

  private:
    // What is read back is what the request before has written.
    void ask() {
        const int at = kWritable + static_cast<int>(turn_ / kCycle % 1000 * 8);
        const auto value = static_cast<std::uint16_t>(turn_);
        std::array<std::uint16_t, 2> two{value, static_cast<std::uint16_t>(value + 1)};
        const std::array<std::uint8_t, 8> bits{1, 0, 0, 1,
                                               value & 8U ? std::uint8_t{1} : std::uint8_t{}};
        switch (turn_ % kCycle) {
            case 1:
                return note("05", modbus_write_bit(line_, at, value & 8U) == 1);
            case 3:
                return note("06", modbus_write_register(line_, at, value) == 1);
            case 4:
                return read_back(at, static_cast<std::uint16_t>(value - 1), 1);
            case 5:
                return note("15", modbus_write_bits(line_, at, 8, bits.data()) == 8);
            case 6:
                return note("16", modbus_write_registers(line_, at + 2, 2, two.data()) == 2);
            case 7:
                return read_back(at + 2, static_cast<std::uint16_t>(value - 1), 2);
            default:
                return read_known();
        }
    }

    void read_known() {
        const int address = static_cast<int>(turn_ * 7919 % 2000);
        std::array<std::uint16_t, kCount> values{};
        const bool came = modbus_read_registers(line_, address, kCount, values.data()) == kCount;
        bool right = true;
        for (int i = 0; i < kCount; ++i) {
            right = right && values[static_cast<std::size_t>(i)] ==
                                 static_cast<std::uint16_t>(unit_ * 257 + (address + i) * 31 + 7);
        }
        note("03", came, right);
    }

    void read_back(int address, std::uint16_t first, int count) {
        std::array<std::uint16_t, 2> values{};
        const bool came = modbus_read_registers(line_, address, count, values.data()) == count;
        const bool right = values[0] == first && (count == 1 || values[1] == first + 1);
        note("03", came, right || !was_confirmed_);
    }

    void note(const char* function, bool came, bool right = true) {
        was_confirmed_ = came;
        if (came && right) {
            ++good_;
        } else if (came) {
            ++failed_[std::string(function) + ": wrong value"];
        } else {
            const int code = errno - MODBUS_ENOBASE;
            const bool is_exception = code > 0 && code < MODBUS_EXCEPTION_MAX;
            ++failed_[std::string(function) + ": " + (is_exception ? "exception " : "") +
                      (is_exception ? std::to_string(code) : modbus_strerror(errno))];
            flush();
        }
    }

    // modbus_flush() of an RTU master is for ttys.
    void flush() const {
        std::array<char, 512> bin{};
        if (modbus_flush(line_) < 0) {
            while (::recv(modbus_get_socket(line_), bin.data(), bin.size(), MSG_DONTWAIT) > 0) {
            }
        }
    }

    void print(double seconds) const {
        std::printf("{\"seconds\": %.4f, \"good\": %ld, \"failed\": {", seconds, good_);
        const char* comma = "";
        for (const auto& [what, count] : failed_) {
            std::printf("%s\"%s\": %ld", comma, what.c_str(), count);
            comma = ", ";
        }
        std::puts("}}");
        std::fflush(stdout);
    }

    modbus_t* line_;
    int unit_;
    std::chrono::microseconds gap_;
    unsigned turn_ = 0;
    long good_ = 0;
    bool was_confirmed_ = false;  // the request before
    std::map<std::string, long> failed_;
};

modbus_t* connected(const std::string& where) {
    const std::size_t colon = where.rfind(':');
    modbus_t* line = modbus_new_tcp(where.substr(0, colon).c_str(), std::atoi(&where[colon + 1]));
    if (line == nullptr || modbus_connect(line) != 0) fail(where.c_str());
    modbus_set_response_timeout(line, 10, 0);  // who refuses says so
    return line;
}

modbus_t* opened(const std::string& where, int baud) {
    const bool is_tty = where[0] == '/';
    modbus_t* line = modbus_new_rtu(is_tty ? where.c_str() : "/dev/null", baud, 'N', 8, 1);
    if (line == nullptr) fail(where.c_str());
    if (is_tty) {
        if (modbus_connect(line) != 0) fail(where.c_str());
    } else {
        const int socket = modbus_get_socket(connected(where));
        const int one = 1;
        ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
        modbus_set_socket(line, socket);
    }
    return line;
}

Master made(int argc, char** argv) {
    const std::string mode = argc > 1 ? argv[1] : "";
    if (mode == "tcp" && argc == 4) return {connected(argv[2]), std::atoi(argv[3]), {}};
    if (mode != "rtu" || argc != 5) std::exit(64);
    const int baud = std::atoi(argv[3]);
    const std::chrono::microseconds gap(baud > 19200 ? 1750 : 35'000'000 / baud);
    return {opened(argv[2], baud), std::atoi(argv[4]), gap};
}

}  // namespace

int main(int argc, char** argv) {
    Master master = made(argc, argv);
    for (double seconds = 0; std::cin >> seconds;) master.run(seconds);
    return 0;
}
