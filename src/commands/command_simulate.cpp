#include <boost/asio/io_context.hpp>
#include <iostream>
#include <map>
#include <optional>
#include <system_error>
#include <vector>

#include "command_run.hpp"
#include "commands.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/simulated_panels.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::commands {
namespace {

/// Parses NAME=PTY-LINK and NAME=tcp://ADDR:PORT texts by line name; false, with a message on
/// stderr, if one is wrong.
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
        } else if (text.compare(equals + 1, gateway::kTcpLink.size(), gateway::kTcpLink) == 0 &&
                   !config::parse_endpoint(text.substr(equals + 1 + gateway::kTcpLink.size()))) {
            std::cerr << "panelgate: --line '" << text
                      << "' is not NAME=tcp://ADDR:PORT with an IP address and a port\n";
        } else if (!links.emplace(name, text.substr(equals + 1)).second) {
            std::cerr << "panelgate: --line '" << text << "': line '" << name
                      << "' has been given already; a line goes to one place\n";
        } else {
            continue;
        }
        return false;
    }
    return true;
}

/// The address of --http; nothing without it.
struct FaultsEndpoint {
    std::optional<config::Endpoint> endpoint;
    bool wrong = false;  ///< invalid, and reported on stderr
};

FaultsEndpoint parse_http(const std::string& text) {
    if (text.empty()) return {};
    FaultsEndpoint faults{config::parse_endpoint(text)};
    faults.wrong = !faults.endpoint;
    if (faults.wrong)
        std::cerr << "panelgate: --http '" << text
                  << "' is not ADDR:PORT, such as 127.0.0.1:8081\n";
    return faults;
}

}  // namespace

ExitCode simulate(const std::string& file, const std::vector<std::string>& texts,
                  const std::string& http) {
    const explain::Loaded loaded = explain::load_file(file);
    if (!loaded.config) return loaded.code;
    explain::print_warnings(*loaded.config);
    std::map<std::string, std::string> links;
    if (!parse_links(texts, *loaded.config, links)) return kUsage;
    const FaultsEndpoint faults = parse_http(http);
    if (faults.wrong) return kUsage;

    rt::set_up_log(loaded.config->log);
    boost::asio::io_context io(1);
    rt::AsioClock clock(io.get_executor());
    const rt::LogDrain drain(clock, io.get_executor());
    SignalLoop loop(io);
    gateway::SimulatedPanels panels(io.get_executor());
    try {
        for (const config::Line& line : loaded.config->lines) panels.add(line, links[line.name]);
        if (faults.endpoint) panels.serve_faults(*faults.endpoint);
    } catch (const std::system_error& error) {
        std::cerr << "panelgate: " << error.what() << '\n';
        return kUnavailable;
    }
    std::cout << panels.text() << "Ctrl-C ends it.\n" << std::flush;
    std::cout.clear();  // they run even if stdout takes nothing
    return loop.run({.begin = [] {},
                     .done = [] { return true; },
                     .finish = [&] { panels.stop(); },
                     .open = {},
                     .longest_answer = {}});
}

}  // namespace panelgate::commands
