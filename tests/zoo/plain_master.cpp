// plain_master TTY BAUD UNITS SECONDS: what a plain libmodbus RTU master gets from a line.
// It reads ten holding registers of units 1 to UNITS in turn, with libmodbus' own timeout of 500
// ms, the silence that the standard asks for between two requests, and a flush after each failure,
// as its manual has it. Prints {"seconds": S, "units": {"1": {"good": N, "failed": N, "wrong": N},
// ...}}.
#include <modbus.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace {

constexpr int kCount = 10;
using Clock = std::chrono::steady_clock;

struct Seen {
    long good = 0, failed = 0, wrong = 0;
};

bool is_right(int unit, int address, const std::array<std::uint16_t, kCount>& values) {
    for (int i = 0; i < kCount; ++i) {
        const auto want = static_cast<std::uint16_t>(unit * 257 + (address + i) * 31 + 7);
        if (values[static_cast<std::size_t>(i)] != want) return false;
    }
    return true;
}

void ask(modbus_t* line, int unit, int address, Seen& seen) {
    std::array<std::uint16_t, kCount> values{};
    modbus_set_slave(line, unit);
    if (modbus_read_registers(line, address, kCount, values.data()) != kCount) {
        ++seen.failed;
        modbus_flush(line);
    } else if (is_right(unit, address, values)) {
        ++seen.good;
    } else {
        ++seen.wrong;
    }
}

void print(const std::vector<Seen>& seen, double seconds) {
    std::printf("{\"seconds\": %.3f, \"units\": {", seconds);
    for (std::size_t i = 0; i < seen.size(); ++i) {
        std::printf("%s\"%zu\": {\"good\": %ld, \"failed\": %ld, \"wrong\": %ld}",
                    i == 0 ? "" : ", ", i + 1, seen[i].good, seen[i].failed, seen[i].wrong);
    }
    std::printf("}}\n");
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 5) return 64;
    const int baud = std::atoi(argv[2]);
    std::vector<Seen> seen(static_cast<std::size_t>(std::atoi(argv[3])));
    modbus_t* line = modbus_new_rtu(argv[1], baud, 'N', 8, 1);
    if (line == nullptr || modbus_connect(line) != 0) {
        std::fprintf(stderr, "plain_master: %s\n", modbus_strerror(errno));
        return 69;
    }
    const auto gap = std::chrono::microseconds(baud > 19200 ? 1750 : 35'000'000 / baud);
    const auto start = Clock::now();
    const auto end = start + std::chrono::duration<double>(std::atof(argv[4]));
    unsigned turn = 0;
    while (Clock::now() < end) {
        const auto unit = turn % seen.size();
        ask(line, static_cast<int>(unit) + 1, static_cast<int>(turn * 7919 % 2000), seen[unit]);
        std::this_thread::sleep_for(gap);
        ++turn;
    }
    print(seen, std::chrono::duration<double>(Clock::now() - start).count());
    modbus_close(line);
    modbus_free(line);
    return 0;
}
