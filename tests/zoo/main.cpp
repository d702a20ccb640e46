// zoo_bus: paced Modbus RTU lines with panels that are odd by name.
//   zoo_bus [options] --bus LINK=UNITS | --bus tcp:PORT=UNITS ...
//     LINK             a link that will name the pseudo-terminal;  tcp:0 takes a free port
//     UNITS            1-5,9
//     --baud B         the wire's rate, 0: unpaced (default)   --bits N  of a character (default
//     10: 8N1)
//     --think MS       of an ordinary panel (default 0.5)      --strict  too early a request is
//     lost
//     --tap LINK[,MS]  another link, which hears the whole wire (through an adapter's latency
//     timer)
//     --log FILE       START END BUS KIND hex... of each frame, in seconds of CLOCK_MONOTONIC;
//     KIND:
//                      REQ, BAD (what our master said), RSP, ODD (what it should not hear)
//     --set UNIT|all=HABIT[,HABIT...]   see habit.hpp and habit.cpp; on every bus
// It prints `ready NAME...`; then one line on stdin, one line of answer, until stdin ends or
// `quit`:
//     set UNIT|all HABIT[,HABIT...]   instead of what there was; `-`: none
//     cut            at the next request: the connection (or device) is gone and back at once, and
//                    the reply goes to the next one
//     stall MS       nothing passes either way, then all of it comes    sever MS  ... without
//     having
//                    been acknowledged (tcp)
//     unplug | replug | stats | writes | reset
//   in front of it `@I ` for bus I instead of 0.
// A holding register holds unit * 257 + address * 31 + 7, an input register unit * 263 +
// address * 37 + 11; 0xE000 and 0xE001 count, 0xF000 and above are refused.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bus.hpp"
#include "far_end.hpp"

namespace {

struct Plan {
    zoo::BusSettings settings;
    std::vector<std::pair<std::string, std::vector<int>>> buses;
    std::vector<std::string> habits;  // commands
};

std::vector<int> parse_units(const std::string& text) {
    std::vector<int> units;
    const char* at = text.c_str();
    while (*at != '\0') {
        char* end = nullptr;
        const long first = std::strtol(at, &end, 10);
        if (end == at) throw std::invalid_argument("units: " + text);
        const long last = *end == '-' ? std::strtol(end + 1, &end, 10) : first;
        for (long unit = first; unit <= last && unit <= 247; ++unit) {
            units.push_back(static_cast<int>(unit));
        }
        at = *end == ',' ? end + 1 : end;
    }
    return units;
}

std::pair<std::string, std::string> split_at_equals(const std::string& text) {
    const std::size_t at = text.find('=');
    if (at == std::string::npos) throw std::invalid_argument("no = in " + text);
    return {text.substr(0, at), text.substr(at + 1)};
}

Plan parse(const std::vector<std::string>& arguments) {
    Plan plan;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string& option = arguments[i];
        if (option == "--strict") {
            plan.settings.is_strict = true;
            continue;
        }
        if (i + 1 == arguments.size()) throw std::invalid_argument(option);
        const std::string& value = arguments[++i];
        if (option == "--bus") {
            const auto [name, units] = split_at_equals(value);
            plan.buses.emplace_back(name, parse_units(units));
        } else if (option == "--set") {
            const auto [who, habits] = split_at_equals(value);
            plan.habits.push_back("set " + who + " " + habits);
        } else if (option == "--baud") {
            plan.settings.baud = std::stol(value);
        } else if (option == "--bits") {
            plan.settings.bits = std::stoi(value);
        } else if (option == "--think") {
            plan.settings.think = zoo::milliseconds(std::stod(value));
        } else if (option == "--tap") {
            const std::size_t comma = std::min(value.find(','), value.size());
            plan.settings.tap = value.substr(0, comma);
            if (comma < value.size())
                plan.settings.tap_latency = zoo::milliseconds(std::stod(value.substr(comma + 1)));
        } else if (option == "--log") {
            plan.settings.log = std::fopen(value.c_str(), "w");
        } else {
            throw std::invalid_argument(option);
        }
    }
    if (plan.buses.empty()) throw std::invalid_argument("no --bus");
    return plan;
}

std::vector<std::unique_ptr<zoo::Bus>> open_buses(Plan plan) {
    std::vector<std::unique_ptr<zoo::Bus>> buses;
    for (auto& [name, units] : plan.buses) {
        plan.settings.index = static_cast<int>(buses.size());
        plan.settings.units = units;
        auto end = name.starts_with("tcp:") ? zoo::make_tcp(std::stoi(name.substr(4)))
                                            : zoo::make_pty(name);
        buses.push_back(std::make_unique<zoo::Bus>(plan.settings, std::move(end)));
        for (const auto& habit : plan.habits) {
            if (buses.back()->command(habit) != "ok") throw std::invalid_argument(habit);
        }
    }
    return buses;
}

void serve(const std::vector<std::unique_ptr<zoo::Bus>>& buses) {
    std::cout << "ready";
    for (const auto& bus : buses) std::cout << ' ' << bus->name();
    std::cout << std::endl;
    for (std::string line; std::getline(std::cin, line) && line != "quit";) {
        std::size_t which = 0;
        if (line.starts_with('@')) {
            const std::size_t end = line.find(' ');
            which = std::stoul(line.substr(1, end - 1));
            line = line.substr(end + 1);
        }
        std::cout << (which < buses.size() ? buses[which]->command(line) : "what?") << std::endl;
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::signal(SIGPIPE, SIG_IGN);
    try {
        serve(open_buses(parse({argv + 1, argv + argc})));
    } catch (const std::exception& error) {
        std::cerr << "zoo_bus: " << error.what() << '\n';
        return 64;
    }
    return 0;
}
