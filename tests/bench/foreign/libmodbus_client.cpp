// libmodbus_client HOST PORT: a client of libmodbus with its own defaults, as its manual pages have
// it. It speaks the lines of plain_clients.py: a call a line, what came of it a line.
#include <modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr std::size_t kMost = 2000;

struct Call {
    std::string verb, table;
    int unit = 0, address = 0;
    std::vector<int> values;  // of a read: how many
};

using Answer = std::vector<int>;

int read(modbus_t* server, const Call& call, Answer& answer) {
    std::array<std::uint8_t, kMost> bits{};
    std::array<std::uint16_t, kMost> words{};
    const int count = call.values.at(0);
    int came = -1;
    if (call.table == "coils") came = modbus_read_bits(server, call.address, count, bits.data());
    if (call.table == "discrete") {
        came = modbus_read_input_bits(server, call.address, count, bits.data());
    }
    if (call.table == "holding") {
        came = modbus_read_registers(server, call.address, count, words.data());
    }
    if (call.table == "inputs") {
        came = modbus_read_input_registers(server, call.address, count, words.data());
    }
    const bool is_bits = call.table == "coils" || call.table == "discrete";
    for (std::size_t i = 0; came > 0 && i < static_cast<std::size_t>(came); ++i) {
        answer.push_back(is_bits ? bits.at(i) : words.at(i));
    }
    return came;
}

int write(modbus_t* server, const Call& call) {
    const bool is_coils = call.table == "coils";
    const int first = call.values.at(0);
    const int count = static_cast<int>(call.values.size());
    if (call.verb == "set") {
        return is_coils
                   ? modbus_write_bit(server, call.address, first)
                   : modbus_write_register(server, call.address, static_cast<std::uint16_t>(first));
    }
    std::vector<std::uint8_t> bits;
    std::vector<std::uint16_t> words;
    for (const int value : call.values) {
        bits.push_back(static_cast<std::uint8_t>(value != 0));
        words.push_back(static_cast<std::uint16_t>(value));
    }
    return is_coils ? modbus_write_bits(server, call.address, count, bits.data())
                    : modbus_write_registers(server, call.address, count, words.data());
}

void tell(int came, const Answer& answer) {
    if (came >= 0) {
        std::cout << "ok";
        for (const int value : answer) std::cout << ' ' << value;
        std::cout << std::endl;
        return;
    }
    const int code = errno - MODBUS_ENOBASE;
    if (code > 0 && code < MODBUS_EXCEPTION_MAX) {
        std::cout << "exception " << code << std::endl;
    } else {
        std::cout << "error " << modbus_strerror(errno) << std::endl;
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 64;
    modbus_t* server = modbus_new_tcp(argv[1], std::atoi(argv[2]));
    if (server == nullptr || modbus_connect(server) != 0) {
        std::fprintf(stderr, "libmodbus_client: %s\n", modbus_strerror(errno));
        return 69;
    }
    std::cout << "ready " << LIBMODBUS_VERSION_STRING << std::endl;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        Call call;
        words >> call.verb >> call.table >> call.unit >> call.address;
        std::copy(std::istream_iterator<int>(words), {}, std::back_inserter(call.values));
        Answer answer;
        int came = modbus_set_slave(server, call.unit);
        if (came == 0)
            came = call.verb == "read" ? read(server, call, answer) : write(server, call);
        tell(came, answer);
    }
    modbus_close(server);
    modbus_free(server);
    return 0;
}
