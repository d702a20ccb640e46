#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include "catalogue.hpp"
#include "commands.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "scan_run.hpp"

namespace panelgate::app {
namespace {

/// Settings of the command line; nothing (and told) when something is wrong with it.
std::optional<scan::Settings> parse_options(const ScanOptions& options) {
    scan::Settings settings;
    settings.remote = options.device.starts_with("tcp://");
    settings.speak_anyway = options.speak;
    std::optional<std::string> wrong;
    if (settings.remote && !line::parse_tcp_device(options.device)) {
        wrong = "DEVICE must be tcp://HOST:PORT with a port from 1 to 65535, not '" +
                options.device + '\'';
    } else if (options.device.empty() || options.device == "sim") {
        wrong = "DEVICE must be a serial device such as /dev/ttyUSB0, or tcp://HOST:PORT";
    } else if (settings.remote && !(options.baud.empty() && options.parity.empty())) {
        wrong = "--baud and --parity are the far end's own on a tcp:// device: leave them out";
    }
    if (!wrong && !options.baud.empty()) wrong = scan::parse_baud(options.baud, settings);
    if (!wrong && !options.parity.empty()) wrong = scan::parse_parity(options.parity, settings);
    if (!wrong && !options.stations.empty())
        wrong = scan::parse_stations(options.stations, settings);
    if (!wrong) return settings;
    std::cerr << "panelgate: " << *wrong << '\n';
    return std::nullopt;
}

void print(const ScanOptions& options, const ScanRun& run) {
    const scan::Result result = run.result();
    if (options.yaml) {
        const bool remote = result.remote;
        const auto absolute = [](const std::string& path) {
            return path.empty() ? path : std::filesystem::absolute(path).string();
        };
        std::cout << scan::report_yaml(remote ? options.device : absolute(options.device), result,
                                       absolute(options.profiles));
    } else {
        std::cout << scan::report_text(options.device, result, run.cut_short());
    }
    std::cout << std::flush;
    for (const std::string& sentence : scan::advice(options.device, result))
        std::cerr << "panelgate: " << sentence << '\n';
}

}  // namespace

ExitCode scan(const ScanOptions& options) {
    const auto settings = parse_options(options);
    if (!settings) return kUsage;
    const auto profiles = load_catalogue(options.profiles);
    if (!profiles) return kBadConfig;
    rt::LogSettings quiet;
    quiet.level = rt::LogLevel::error;  // the result is what there is to say
    rt::set_up_log(quiet);
    line::Settings device;
    device.device = options.device;
    boost::asio::io_context io(1);
    ScanRun run(io, *settings, *profiles, device);
    run.run();
    if (!run.has_begun()) {
        std::cerr << "panelgate: " << run.cut_short() << '\n';
        return kUnavailable;
    }
    print(options, run);
    const bool complete = run.cut_short().empty() && scan::found_any(run.result());
    return complete ? kFine : kUnavailable;
}

}  // namespace panelgate::app
