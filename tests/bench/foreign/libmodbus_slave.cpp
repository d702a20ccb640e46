// libmodbus_slave TTY BAUD UNIT: libmodbus' own RTU server, as its examples have it. It prints
// `ready`. A holding register holds unit * 257 + address * 31 + 7 until somebody writes it.
#include <modbus.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace {

constexpr int kAll = 0x10000;

[[noreturn]] void fail() {
    std::fprintf(stderr, "libmodbus_slave: %s\n", modbus_strerror(errno));
    std::exit(69);
}

void serve(modbus_t* line, modbus_mapping_t* memory) {
    std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> request{};
    while (true) {
        const int length = modbus_receive(line, request.data());
        if (length > 0) modbus_reply(line, request.data(), length, memory);
        if (length < 0 && errno == EIO) return;  // the line is gone
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 4) return 64;
    const int unit = std::atoi(argv[3]);
    modbus_t* line = modbus_new_rtu(argv[1], std::atoi(argv[2]), 'N', 8, 1);
    if (line == nullptr || modbus_set_slave(line, unit) != 0 || modbus_connect(line) != 0) fail();
    modbus_mapping_t* memory = modbus_mapping_new(kAll, kAll, kAll, kAll);
    if (memory == nullptr) fail();
    for (int i = 0; i < kAll; ++i) {
        memory->tab_registers[static_cast<std::size_t>(i)] =
            static_cast<std::uint16_t>(unit * 257 + i * 31 + 7);
    }
    std::puts("ready");
    std::fflush(stdout);
    serve(line, memory);
    modbus_mapping_free(memory);
    modbus_close(line);
    modbus_free(line);
    return 0;
}
