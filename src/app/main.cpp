#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "commands.hpp"

namespace {

using namespace panelgate;
using namespace panelgate::app;

constexpr const char* kAbout =
    "panelgate: a Modbus RTU-to-TCP gateway for operator panels on RS-485 lines";

/// The command line; the command that is asked for runs while it is parsed.
class CommandLine {
  public:
    CommandLine() {
        cli_.set_version_flag("--version", std::string("panelgate ") + PANELGATE_VERSION);
        cli_.require_subcommand(1);
        add_run();
        add_demo();
        add_check();
        add_simulate();
        add_scan();
        add_address();
        add_profiles();
    }

    ExitCode parse(int argc, char** argv) {
        try {
            cli_.parse(argc, argv);
        } catch (const CLI::ParseError& error) {
            const bool asked_for =
                error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
            cli_.exit(error);  // prints the help, the version, or what is wrong
            return asked_for ? kFine : kUsage;
        }
        return code_;
    }

  private:
    void add_file(CLI::App* command) {
        command->add_option("-c,--config", file_, "configuration file")->capture_default_str();
    }

    void add_run() {
        CLI::App* command = cli_.add_subcommand("run", "run the gateway");
        add_file(command);
        command->add_flag(
            "--simulate", simulated_,
            "replace every line's device by a simulated bus with the configured stations");
        command->callback([this] { code_ = run(file_, simulated_); });
    }

    void add_demo() {
        CLI::App* command = cli_.add_subcommand(
            "demo", "run the shipped demo on simulated panels: no hardware, no root, loopback");
        command->add_option("--http", http_, "ADDR:PORT of the REST API (port 0: any free one)");
        command->add_option("--modbus", modbus_, "ADDR:PORT of Modbus/TCP (port 0: any free one)");
        command->callback([this] { code_ = demo(http_, modbus_); });
    }

    void add_check() {
        CLI::App* command = cli_.add_subcommand("check", "validate a configuration");
        add_file(command);
        command->add_option("--format", format_, "text or json")
            ->check(CLI::IsMember({"text", "json"}));
        command->callback([this] { code_ = check(file_, format_ == "json"); });
    }

    void add_simulate() {
        CLI::App* command = cli_.add_subcommand("simulate", "only the simulated panels, on ptys");
        add_file(command);
        command->add_option(
            "--line", links_,
            "NAME=PTY-LINK, a link to the line's pty, or NAME=tcp://ADDR:PORT, RTU over TCP");
        command->callback([this] { code_ = simulate(file_, links_); });
    }

    void add_scan() {
        CLI::App* command = cli_.add_subcommand(
            "scan", "find stations, serial settings and panel profiles on a line; only ever reads");
        command->add_option("DEVICE", scan_.device, "a serial device, or tcp://HOST:PORT")
            ->required();
        command->add_option("--baud", scan_.baud, "rates to try, such as 9600,38400");
        command->add_option("--parity", scan_.parity, "none, even, odd or a list of them");
        command->add_option("--stations", scan_.stations,
                            "addresses to ask, such as 1-31 (the default) or 5,17,20-31");
        command->add_option(
            "--profiles", scan_.profiles,
            "directory of further panel profiles, as profiles_dir of a configuration");
        command->add_flag("--yaml", scan_.yaml, "print a configuration of the line instead");
        command->add_flag("--speak", scan_.speak, "scan although another master is talking");
        command->footer(
            "Exit codes: 0 something was found; 64 usage; 69 the device cannot be used, another "
            "master\n"
            "is talking, nothing was found, or the scan was interrupted (what was found is "
            "printed).");
        command->callback([this] { code_ = scan(scan_); });
    }

    void add_address() {
        CLI::App* command =
            cli_.add_subcommand("address", "vendor notation to Modbus table and address, and back");
        command->add_option("PROFILE", profile_)->required();
        command->add_option("NOTATION", notation_, "UB180, or back: coil/288")->required();
        command->callback([this] { code_ = address(profile_, notation_); });
    }

    void add_profiles() {
        CLI::App* command = cli_.add_subcommand("profiles", "list the panel profiles, or show one");
        command->add_option("NAME", name_);
        command->callback([this] { code_ = profiles(name_); });
    }

    CLI::App cli_{kAbout, "panelgate"};
    ExitCode code_ = kFine;
    std::string file_ = kDefaultConfig;
    bool simulated_ = false;
    std::string http_;
    std::string modbus_;
    std::string format_ = "text";
    std::vector<std::string> links_;
    ScanOptions scan_;
    std::string profile_;
    std::string notation_;
    std::string name_;
};

}  // namespace

int main(int argc, char** argv) {
    try {
        return CommandLine().parse(argc, argv);
    } catch (const std::exception& error) {
        std::cerr << "panelgate: internal error: " << error.what() << '\n';
        return kInternal;
    }
}
