#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "commands.hpp"

namespace {

using namespace panelgate;
using namespace panelgate::app;

constexpr const char* kAbout =
    "panelgate: a Modbus RTU-to-TCP gateway for operator panels on RS-485 lines";

void add_scan(CLI::App& cli, ScanOptions& options, ExitCode& code) {
    CLI::App* scan_cli = cli.add_subcommand(
        "scan", "find stations, serial settings and panel profiles on a line; only ever reads");
    scan_cli->add_option("DEVICE", options.device, "a serial device, or tcp://HOST:PORT")
        ->required();
    scan_cli->add_option("--baud", options.baud, "rates to try, such as 9600,38400");
    scan_cli->add_option("--parity", options.parity, "none, even, odd or a list of them");
    scan_cli->add_option("--stations", options.stations,
                         "addresses to ask, such as 1-31 (the default) or 5,17,20-31");
    scan_cli->add_option("--profiles", options.profiles,
                         "directory of further panel profiles, as profiles_dir of a configuration");
    scan_cli->add_flag("--yaml", options.yaml, "print a configuration of the line instead");
    scan_cli->add_flag("--speak", options.speak, "scan although another master is talking");
    scan_cli->footer(
        "Exit codes: 0 something was found; 64 usage; 69 the device cannot be used, another "
        "master\n"
        "is talking, nothing was found, or the scan was interrupted (what was found is printed).");
    scan_cli->callback([&options, &code] { code = scan(options); });
}

int run_command(int argc, char** argv) {
    CLI::App cli{kAbout, "panelgate"};
    cli.set_version_flag("--version", std::string("panelgate ") + PANELGATE_VERSION);
    cli.require_subcommand(1);
    ExitCode code = kFine;

    std::string file = kDefaultConfig;
    bool simulated = false;
    CLI::App* run_cli = cli.add_subcommand("run", "run the gateway");
    run_cli->add_option("-c,--config", file, "configuration file")->capture_default_str();
    run_cli->add_flag(
        "--simulate", simulated,
        "replace every line's device by a simulated bus with the configured stations");
    run_cli->callback([&] { code = run(file, simulated); });

    std::string http;
    std::string modbus;
    CLI::App* demo_cli = cli.add_subcommand(
        "demo", "run the shipped demo on simulated panels: no hardware, no root, loopback");
    demo_cli->add_option("--http", http, "ADDR:PORT of the REST API (port 0: any free one)");
    demo_cli->add_option("--modbus", modbus, "ADDR:PORT of Modbus/TCP (port 0: any free one)");
    demo_cli->callback([&] { code = demo(http, modbus); });

    std::string format = "text";
    CLI::App* check_cli = cli.add_subcommand("check", "validate a configuration");
    check_cli->add_option("-c,--config", file, "configuration file")->capture_default_str();
    check_cli->add_option("--format", format, "text or json")
        ->check(CLI::IsMember({"text", "json"}));
    check_cli->callback([&] { code = check(file, format == "json"); });

    std::vector<std::string> links;
    CLI::App* simulate_cli = cli.add_subcommand("simulate", "only the simulated panels, on ptys");
    simulate_cli->add_option("-c,--config", file, "configuration file")->capture_default_str();
    simulate_cli->add_option(
        "--line", links,
        "NAME=PTY-LINK, a link to the line's pty, or NAME=tcp://ADDR:PORT, RTU over TCP");
    simulate_cli->callback([&] { code = simulate(file, links); });

    ScanOptions scan_options;
    add_scan(cli, scan_options, code);

    std::string profile;
    std::string what;
    CLI::App* address_cli =
        cli.add_subcommand("address", "vendor notation to Modbus table and address, and back");
    address_cli->add_option("PROFILE", profile)->required();
    address_cli->add_option("NOTATION", what, "UB180, or back: coil/288")->required();
    address_cli->callback([&] { code = address(profile, what); });

    std::string name;
    CLI::App* profiles_cli = cli.add_subcommand("profiles", "list the panel profiles, or show one");
    profiles_cli->add_option("NAME", name);
    profiles_cli->callback([&] { code = profiles(name); });

    try {
        cli.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const bool asked_for = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
        cli.exit(error);  // prints the help, the version, or what is wrong
        return asked_for ? kFine : kUsage;
    }
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run_command(argc, argv);
    } catch (const std::exception& error) {
        std::cerr << "panelgate: internal error: " << error.what() << '\n';
        return kInternal;
    }
}
