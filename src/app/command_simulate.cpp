#include <boost/asio/io_context.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <system_error>
#include <vector>

#include "commands.hpp"
#include "gateway.hpp"
#include "load.hpp"
#include "panelgate/rt/log.hpp"
#include "pty_link.hpp"
#include "run_loop.hpp"

namespace panelgate::app {
namespace {

/// NAME=PTY-LINK texts by line name; false (and told) when one is wrong.
bool parse_links(const std::vector<std::string>& texts, const config::Config& config,
                 std::map<std::string, std::string>& links) {
    for (const std::string& text : texts) {
        const std::size_t equals = text.find('=');
        const std::string name = text.substr(0, equals);
        bool known = false;
        for (const config::Line& line : config.lines) known = known || line.name == name;
        if (equals == std::string::npos || equals + 1 == text.size()) {
            std::cerr << "panelgate: --line '" << text << "' is not NAME=PTY-LINK\n";
        } else if (!known) {
            std::cerr << "panelgate: --line '" << text << "': the configuration has no line '"
                      << name << "'\n";
        } else if (text.compare(equals + 1, 6, "tcp://") == 0) {
            std::cerr << "panelgate: --line '" << text
                      << "': RTU over TCP is not in this version; give a path\n";
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
    std::vector<std::unique_ptr<sim::SimulatedBus>> buses;
    std::vector<std::unique_ptr<PtyLink>> made;
    try {
        for (const config::Line& line : loaded.config->lines) {
            buses.push_back(simulate_line(io.get_executor(), line));
            buses.back()->start();
            const auto link = links.find(line.name);
            if (link == links.end()) continue;
            made.push_back(std::make_unique<PtyLink>(link->second, buses.back()->device()));
        }
    } catch (const std::system_error& error) {
        std::cerr << "panelgate: " << error.what() << '\n';
        return kUnavailable;
    }
    run_until_signal(io, {[] {}, [] { return true; },
                          [&] {
                              for (const auto& bus : buses) bus->stop();
                          }});
    return kFine;
}

}  // namespace panelgate::app
