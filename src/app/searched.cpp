#include "searched.hpp"

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <iostream>

#include "catalogue.hpp"
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

std::string absolute(const std::string& path) {
    return path.empty() ? path : std::filesystem::absolute(path).string();
}

/// False, and told, when the line could not be had.
bool run_scan(const ScanOptions& options, const scan::Settings& settings, Searched& searched) {
    line::Settings device;
    device.device = options.device;
    boost::asio::io_context io(1);
    ScanRun run(io, settings, *searched.profiles, device);
    run.run();
    searched.cut_short = run.cut_short();
    if (run.has_begun()) {
        searched.result = run.result();
        return true;
    }
    std::cerr << "panelgate: " << run.cut_short() << '\n';
    return false;
}

}  // namespace

Searched search(const ScanOptions& options) {
    Searched searched;
    searched.code = kUsage;
    const auto settings = parse_options(options);
    if (!settings) return searched;
    searched.code = kBadConfig;
    searched.profiles = load_catalogue(options.profiles);
    if (!searched.profiles) return searched;
    rt::LogSettings quiet;
    quiet.level = rt::LogLevel::error;  // the result is what there is to say
    rt::set_up_log(quiet);
    searched.device = settings->remote ? options.device : absolute(options.device);
    searched.profiles_dir = absolute(options.profiles);
    searched.code = kUnavailable;
    if (!run_scan(options, *settings, searched)) return searched;
    const bool complete = searched.cut_short.empty() && scan::found_any(*searched.result);
    if (complete) searched.code = kFine;
    return searched;
}

void tell_advice(const ScanOptions& options, const scan::Result& result) {
    for (const std::string& sentence : scan::advice(options.device, result))
        std::cerr << "panelgate: " << sentence << '\n';
}

}  // namespace panelgate::app
