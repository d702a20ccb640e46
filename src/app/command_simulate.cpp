#include <boost/asio/io_context.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <string_view>
#include <system_error>
#include <vector>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/rt/log.hpp"
#include "pty_link.hpp"
#include "run_loop.hpp"
#include "simulated_line.hpp"
#include "tcp_bridge.hpp"

namespace panelgate::app {
namespace {

constexpr std::string_view kTcp = "tcp://";

/// NAME=PTY-LINK and NAME=tcp://ADDR:PORT texts by line name; false (and told) when one is wrong.
bool parse_links(const std::vector<std::string>& texts, const config::Config& config,
                 std::map<std::string, std::string>& links) {
    for (const std::string& text : texts) {
        const std::size_t equals = text.find('=');
        const std::string name = text.substr(0, equals);
        bool known = false;
        for (const config::Line& line : config.lines) known = known || line.name == name;
        if (equals == std::string::npos || equals + 1 == text.size()) {
            std::cerr << "panelgate: --line '" << text
                      << "' is not NAME=PTY-LINK or NAME=tcp://ADDR:PORT\n";
        } else if (!known) {
            std::cerr << "panelgate: --line '" << text << "': the configuration has no line '"
                      << name << "'\n";
        } else if (text.compare(equals + 1, kTcp.size(), kTcp) == 0 &&
                   !config::parse_endpoint(text.substr(equals + 1 + kTcp.size()))) {
            std::cerr << "panelgate: --line '" << text
                      << "' is not NAME=tcp://ADDR:PORT with an IP address and a port\n";
        } else {
            links[name] = text.substr(equals + 1);
            continue;
        }
        return false;
    }
    return true;
}

}  // namespace

ExitCode simulate(const std::string& file, const std::vector<std::string>& texts) {
    const Loaded loaded = load_file(file);
    if (!loaded.config) return loaded.code;
    std::map<std::string, std::string> links;
    if (!parse_links(texts, *loaded.config, links)) return kUsage;

    rt::set_up_log(loaded.config->log);
    boost::asio::io_context io(1);
    SignalLoop loop(io);
    std::vector<std::unique_ptr<sim::SimulatedBus>> buses;
    std::vector<std::unique_ptr<PtyLink>> made;
    std::vector<std::unique_ptr<TcpBridge>> bridges;
    try {
        for (const config::Line& line : loaded.config->lines) {
            buses.push_back(simulate_line(io.get_executor(), line));
            buses.back()->start();
            const auto link = links.find(line.name);
            if (link == links.end()) continue;
            if (!link->second.starts_with(kTcp)) {
                made.push_back(std::make_unique<PtyLink>(link->second, buses.back()->device()));
                continue;
            }
            const auto endpoint = config::parse_endpoint(link->second.substr(kTcp.size()));
            bridges.push_back(
                std::make_unique<TcpBridge>(io.get_executor(), *endpoint, buses.back()->device()));
            rt::log(rt::LogLevel::info, "listening",
                    {{"line", line.name},
                     {"rtu_over_tcp",
                      endpoint->address + ':' + std::to_string(bridges.back()->port())}});
        }
    } catch (const std::system_error& error) {
        std::cerr << "panelgate: " << error.what() << '\n';
        return kUnavailable;
    }
    loop.run({[] {}, [] { return true; },
              [&] {
                  bridges.clear();
                  for (const auto& bus : buses) bus->stop();
              }});
    return kFine;
}

}  // namespace panelgate::app
