#include <boost/json.hpp>
#include <iostream>

#include "commands.hpp"
#include "load.hpp"

namespace panelgate::app {
namespace {

void print_text(const std::string& file, const config::Config& config) {
    std::cout << file << " is valid: " << config.lines.size() << " line(s), "
              << config.modbus_tcp.size() << " Modbus/TCP listener(s), "
              << (config.http ? "HTTP on " + config.http->name() : "no HTTP") << '\n';
    for (const config::Line& line : config.lines) {
        std::cout << "line " << line.name << ": " << line.device.device << ", "
                  << to_string(line.device.serial) << '\n';
        for (const config::Station& station : line.stations) {
            std::cout << "  station " << int{station.id} << ' ' << station.name << ", "
                      << station.profile->name << (station.read_only ? ", read only" : "") << '\n';
        }
    }
    for (const tcp_server::Settings& listener : config.modbus_tcp) {
        std::cout << "modbus_tcp " << listener.name() << ':';
        for (const std::string& line : listener.lines) std::cout << ' ' << line;
        std::cout << '\n';
    }
}

void print_json(const config::Config& config) {
    boost::json::array lines;
    for (const config::Line& line : config.lines) {
        boost::json::array stations;
        for (const config::Station& station : line.stations) {
            stations.push_back(boost::json::object{
                {"id", station.id}, {"name", station.name}, {"profile", station.profile->name}});
        }
        lines.push_back(boost::json::object{{"name", line.name},
                                            {"device", line.device.device},
                                            {"serial", to_string(line.device.serial)},
                                            {"stations", std::move(stations)}});
    }
    boost::json::array warnings;
    for (const std::string& warning : config.warnings) warnings.emplace_back(warning);
    std::cout << boost::json::serialize(boost::json::object{{"lines", std::move(lines)},
                                                            {"warnings", std::move(warnings)}})
              << '\n';
}

}  // namespace

ExitCode check(const std::string& file, bool json) {
    const Loaded loaded = load_file(file);
    if (!loaded.config) return loaded.code;
    print_warnings(*loaded.config);
    if (json) {
        print_json(*loaded.config);
    } else {
        print_text(file, *loaded.config);
    }
    return kFine;
}

}  // namespace panelgate::app
