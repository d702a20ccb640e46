#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/rt/asio_clock.hpp"
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

/// The panels of all lines, and the ways to them.
class Panels {
  public:
    explicit Panels(boost::asio::any_io_executor executor)
        : executor_(std::move(executor)), clock_(executor_) {}

    /// `link`: where the line's pty is reached, or empty. Throws std::system_error.
    void add(const config::Line& line, const std::string& link) {
        buses_.push_back(simulate_line(executor_, clock_, line));
        buses_.back()->start();
        const std::string device = buses_.back()->device();
        if (link.empty()) return;
        if (!link.starts_with(kTcp)) {
            links_.push_back(std::make_unique<PtyLink>(link, device));
            return;
        }
        const auto endpoint = config::parse_endpoint(link.substr(kTcp.size()));
        bridges_.push_back(std::make_unique<TcpBridge>(executor_, *endpoint, device));
        const std::string port = std::to_string(bridges_.back()->port());
        rt::log(rt::LogLevel::info, "listening",
                {{"line", line.name}, {"rtu_over_tcp", endpoint->address + ':' + port}});
    }
    void stop() {
        bridges_.clear();
        for (const auto& bus : buses_) bus->stop();
    }

  private:
    boost::asio::any_io_executor executor_;
    rt::AsioClock clock_;
    std::vector<std::unique_ptr<sim::SimulatedBus>> buses_;
    std::vector<std::unique_ptr<PtyLink>> links_;
    std::vector<std::unique_ptr<TcpBridge>> bridges_;
};

}  // namespace

ExitCode simulate(const std::string& file, const std::vector<std::string>& texts) {
    const Loaded loaded = load_file(file);
    if (!loaded.config) return loaded.code;
    print_warnings(*loaded.config);
    std::map<std::string, std::string> links;
    if (!parse_links(texts, *loaded.config, links)) return kUsage;

    rt::set_up_log(loaded.config->log);
    boost::asio::io_context io(1);
    rt::AsioClock clock(io.get_executor());
    const rt::LogDrain drain(clock);
    SignalLoop loop(io);
    Panels panels(io.get_executor());
    try {
        for (const config::Line& line : loaded.config->lines) panels.add(line, links[line.name]);
    } catch (const std::system_error& error) {
        std::cerr << "panelgate: " << error.what() << '\n';
        return kUnavailable;
    }
    loop.run({[] {}, [] { return true; }, [&] { panels.stop(); }});
    return kFine;
}

}  // namespace panelgate::app
