#include <fcntl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <CLI/Error.hpp>
#include <algorithm>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <initializer_list>
#include <iostream>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "adapters.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/gateway/build_info.hpp"

namespace {

using namespace panelgate;
using namespace panelgate::commands;

constexpr const char* kAbout =
    "panelgate: a Modbus RTU-to-TCP gateway for operator panels on RS-485 lines";

constexpr const char* kExamples =
    "Examples:\n"
    "  panelgate demo                                   simulated panels, a dashboard\n"
    "  panelgate init /dev/ttyUSB0 -o panelgate.yaml    find panels, write a file\n"
    "  panelgate run -c panelgate.yaml                  serve them\n"
    "  panelgate read oven/temperature                  ask the gateway that runs\n"
    "  panelgate check -c panelgate.yaml                what a configuration means\n"
    "  panelgate address panasonic-gt GDT108            where a notation is in Modbus\n";
constexpr const char* kFirstSteps =
    "To begin:\n"
    "  panelgate demo                                   simulated panels, no hardware\n"
    "  panelgate init /dev/ttyUSB0 -o panelgate.yaml    find panels, write a file\n"
    "  panelgate run -c panelgate.yaml                  serve them\n";

/// The command line; parsing it runs the command.
class CommandLine {
  public:
    CommandLine() {
        cli_.set_version_flag("-V,--version", gateway::build_text());
        cli_.require_subcommand(1);
        add_demo();
        add_scan();
        add_init();
        add_run();
        add_simulate();
        add_asking_commands(cli_, code_);
        add_health();
        add_reload();
        add_check();
        add_config();
        add_schema();
        add_import();
        add_address();
        add_profiles();
        add_security_commands(cli_, code_);
        add_certificate_commands(cli_, code_);
        add_help();
        add_groups();
        refuse_empty_values(cli_);
        shape_help(cli_);
    }

    ExitCode parse(std::vector<std::string> words) {
        if (words.empty()) {
            std::cerr << "panelgate: a command is missing\n" << kFirstSteps;
            return listed_commands();
        }
        if (words[0] == "help") {
            words.erase(words.begin());
            words.emplace_back("--help");
        }
        if (!words[0].starts_with('-') && !has_command(words[0]))
            return which_command("there is no command '" + words[0] + '\'' +
                                 did_you_mean(words[0], commands()));
        static const std::set<std::string> kAlone{"-h", "--help", "-V", "--version"};
        if (words[0].starts_with('-') && !kAlone.contains(words[0]))
            return which_command("a command is missing before '" + words[0] + '\'' +
                                 did_you_mean(words[0], {kAlone.begin(), kAlone.end()}));
        const std::string command = words[0];
        try {
            keep_negative_values(words);
            std::ranges::reverse(words);  // the order that CLI11 expects
            cli_.parse(std::move(words));
        } catch (const CLI::ParseError& error) {
            if (error.get_exit_code() != static_cast<int>(CLI::ExitCodes::Success))
                return mistaken(command, error);
            cli_.exit(error);  // prints the help or the version
        }
        return code_;
    }

  private:
    std::vector<std::string> commands() const {
        std::vector<std::string> names;
        for (const CLI::App* command : cli_.get_subcommands({}))
            if (!command->get_group().empty()) names.push_back(command->get_name());
        return names;
    }

    /// Puts what is no option of `write` behind "--": there "-5" is a value.
    static void keep_negative_values(std::vector<std::string>& words) {
        const auto is_negative = [](const std::string& word) {
            return word.size() > 1 && word[0] == '-' && word.find_first_of("0123456789.") == 1;
        };
        if (words[0] != "write" || std::ranges::none_of(words, is_negative)) return;
        std::vector<std::string> options{words[0]};
        std::vector<std::string> values{"--"};
        for (std::size_t i = 1; i < words.size(); ++i) {
            const bool is_option = words[i].starts_with('-') && !is_negative(words[i]);
            if (words[i] == "--") continue;
            (is_option ? options : values).push_back(words[i]);
            const bool takes_next = is_option && words[i].find('=') == std::string::npos;
            if (takes_next && i + 1 < words.size()) options.push_back(words[++i]);
        }
        options.insert(options.end(), values.begin(), values.end());
        words = std::move(options);
    }

    bool has_command(const std::string& name) const {
        return std::ranges::any_of(cli_.get_subcommands({}), [&](const CLI::App* command) {
            return command->get_name() == name;
        });
    }

    static std::string did_you_mean(std::string_view typed, const std::vector<std::string>& known) {
        const std::string near =
            nearest(typed, std::vector<std::string_view>(known.begin(), known.end()));
        return near.empty() ? "" : "; did you mean '" + near + "'?";
    }

    ExitCode mistaken(const std::string& command, const CLI::ParseError& error) const {
        const bool extra = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
        const CLI::App& asked = *cli_.get_subcommand(command);
        const bool has_commands = !asked.get_subcommands({}).empty();  // one of them is needed
        if ((extra || has_commands) && !asked.remaining().empty()) return unexpected(asked);
        const std::string fault = usage_fault(error);
        std::cerr << "panelgate: " << command << ": " << fault << "; `panelgate help " << command
                  << "` says what it takes\n";
        if (fault.starts_with("DEVICE")) std::cerr << adapters_text(adapters("/dev"));
        return kUsage;
    }

    /// What may have been meant as the configuration.
    static bool looks_like_file(const std::string& word) {
        std::error_code none;
        return word.ends_with(".yaml") || word.ends_with(".yml") ||
               std::filesystem::is_regular_file(word, none);
    }

    /// Reports the first argument that `command` did not understand.
    static ExitCode unexpected(const CLI::App& command) {
        std::vector<std::string> left = command.remaining();
        const auto first = std::ranges::find_if(
            left, [](const std::string& word) { return word.starts_with('-'); });
        const bool is_option = first != left.end();
        const std::string typed = is_option ? first->substr(0, first->find('=')) : left.front();
        std::vector<std::string> names;
        for (const CLI::Option* option : command.get_options()) {
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
            for (const std::string& name : option->get_snames()) names.push_back('-' + name);
        }
        for (const CLI::App* one : command.get_subcommands({}))
            if (!one->get_group().empty()) names.push_back(one->get_name());
        const bool is_file = !is_option && looks_like_file(typed) &&
                             command.get_option_no_throw("--config") != nullptr;
        std::cerr << "panelgate: " << command.get_name()
                  << (is_option ? " has no option '" : " does not take '") << typed << '\'';
        if (is_file) {
            std::cerr << "; a file is given with -c: " << command.get_name() << " -c " << typed;
        } else {
            std::cerr << did_you_mean(typed, names);
        }
        std::cerr << "; `panelgate help " << command.get_name() << "` says what it takes\n";
        return kUsage;
    }

    ExitCode which_command(const std::string& what) const {
        std::cerr << "panelgate: " << what << '\n';
        return listed_commands();
    }

    ExitCode listed_commands() const {
        std::cerr << "Commands:";
        for (const std::string& name : commands()) std::cerr << ' ' << name;
        std::cerr << "; `panelgate help` says what they do\n";
        return kUsage;
    }

    void add_help() {
        CLI::App* version =
            cli_.add_subcommand("version", "print the version, the commit and the libraries");
        version->callback([] { std::cout << gateway::build_text() << '\n'; });
        cli_.add_subcommand("help", "say what all commands do, or what COMMAND does");
    }

    /// Commands in the order of their groups, and what to type first.
    void add_groups() {
        const auto put = [this](const char* group, std::initializer_list<const char*> names) {
            for (const char* name : names) cli_.get_subcommand(name)->group(group);
        };
        put(kBegin, {"demo", "scan", "init"});
        put(kRun, {"run", "simulate"});
        put(kAsk, {"health", "reload"});
        put(kConfiguration, {"check", "config", "schema", "import"});
        put(kTools, {"address", "profiles", "cert", "version", "help"});
        cli_.footer(kExamples);
    }

    void add_profiles_dir(CLI::App* command, std::string& dir) {
        command->add_option(
            "--profiles", dir,
            "directory of further panel profiles, as profiles_dir of a configuration");
    }

    void add_file(CLI::App* command) {
        command->add_option("-c,--config", file_, "configuration file, - for standard input")
            ->capture_default_str();
    }

    void add_run() {
        CLI::App* command = cli_.add_subcommand("run", "run the gateway");
        add_file(command);
        command->add_flag(
            "--simulate", simulated_,
            "replace every line's device by a simulated bus with the configured stations");
        command->add_flag("--watch", watch_,
                          "read the file again when it has changed, as on SIGHUP (Kubernetes: a "
                          "mounted ConfigMap)");
        command->callback([this] { code_ = run(file_, simulated_, watch_); });
    }

    void add_demo() {
        CLI::App* command = cli_.add_subcommand(
            "demo", "run the shipped demo on simulated panels: no hardware, no root, loopback");
        command->add_option("--http", http_, "ADDR:PORT of the REST API (port 0: any free one)");
        command->add_option("--modbus", modbus_, "ADDR:PORT of Modbus/TCP (port 0: any free one)");
        command->callback([this] { code_ = demo(http_, modbus_); });
    }

    void add_check() {
        CLI::App* command = cli_.add_subcommand(
            "check", "validate a configuration, and plan the load of its lines");
        add_file(command);
        command->add_option("--format", format_, "text or json")
            ->check(CLI::IsMember({"text", "json"}));
        command
            ->add_option("--diff", check_.before,
                         "say what changes from this file, in place of all that there is")
            ->check([](const std::string& file) {
                return file.empty() ? "give a file that is compared with" : std::string();
            });
        command->add_flag("--allow-overload", check_.allow_overload,
                          "a line that is planned to be busy for more than 100 % of its time is a "
                          "warning, not an error");
        command->add_option("--explain", check_.explain,
                            "say which rule of access decides, of a request such as "
                            "'from=10.0.0.7 role=operator write press/UW102'; the exit code is 0 "
                            "if it is allowed, else 1");
        command->callback([this] {
            check_.json = format_ == "json";
            code_ = check(file_, check_);
        });
    }

    void add_config() {
        CLI::App* command =
            cli_.add_subcommand("config", "look up what a configuration says, defaults included");
        command->require_subcommand(1);
        CLI::App* get = command->add_subcommand("get", "print a setting, or all below a path");
        add_file(get);
        get->add_option("PATH", path_,
                        "such as lines.floor1.stations.press.retries; all settings without");
        get->callback([this] { code_ = config_get(file_, path_); });
        CLI::App* keys = command->add_subcommand(
            "keys", "print what keys there are: values, defaults, what each is for");
        keys->add_option("PATH", path_, "such as lines.stations.points; all keys without");
        keys->add_option("--format", format_, "text or json")
            ->check(CLI::IsMember({"text", "json"}));
        keys->callback([this] { code_ = config_keys(path_, format_ == "json"); });
        // Options of other programs that users try here; the help does not list the options.
        CLI::App* set = command->add_subcommand("set", "")->group("")->allow_extras();
        set->callback([this] {
            std::cerr
                << "panelgate: a setting is changed in the file, with an editor: nothing here "
                   "would keep its comments; `panelgate check -c NEW --diff OLD` says what a "
                   "change does\n";
            code_ = kUsage;
        });
    }

    void add_simulate() {
        CLI::App* command = cli_.add_subcommand("simulate", "only the simulated panels, on ptys");
        add_file(command);
        command->add_option(
            "--line", links_,
            "NAME=PTY-LINK, a link to the line's pty, or NAME=tcp://ADDR:PORT, RTU over TCP");
        command->add_option(
            "--http", http_,
            "ADDR:PORT of a REST API for the panels' faults (port 0: any free one)");
        command->callback([this] { code_ = simulate(file_, links_, http_); });
    }

    /// The options that `scan` and `init` share.
    void add_search(CLI::App* command) {
        command
            ->add_option("DEVICE", scan_.device,
                         "a serial device, tcp://HOST:PORT or modbus-tcp://HOST:PORT")
            ->required();
        command->add_option("--baud", scan_.baud, "rates to try, such as 9600,38400");
        command->add_option("--parity", scan_.parity, "none, even, odd or a list of them");
        command->add_option("--stations", scan_.stations,
                            "addresses to ask, such as 1-31 (the default) or 5,17,20-31");
        add_profiles_dir(command, scan_.profiles);
        command->add_flag("--speak", scan_.speak, "scan although another master is talking");
        command->add_flag("--quick", scan_.quick,
                          "ask each address once: seconds, not half a minute; a slow panel may be "
                          "missed");
    }

    void add_scan() {
        CLI::App* command = cli_.add_subcommand(
            "scan", "find stations, serial settings and panel profiles on a line; only ever reads");
        add_search(command);
        command->add_flag("--yaml", scan_.yaml, "print a configuration of the line instead");
        command->footer(
            "Panels are named on stderr as soon as they are known. With --quick the table is "
            "followed by a configuration to paste.\n"
            "Exit codes: 0 something was found; 64 usage; 69 the device cannot be used, another "
            "master is talking, nothing was found, or the scan was interrupted (what was found is "
            "printed).");
        command->callback([this] { code_ = scan(scan_); });
    }

    void add_init() {
        CLI::App* command = cli_.add_subcommand(
            "init", "scan a line, and write a configuration of it with comments");
        add_search(command);
        add_output(command);
        command->footer(
            "Exit codes: 0 it is written; 64 usage, or the file is there; 69 as of scan: nothing "
            "was found, the device cannot be used, another master is talking, the scan was "
            "interrupted; 70 the file cannot be written.");
        command->callback([this] { code_ = init(scan_, output_); });
    }

    void add_output(CLI::App* command) {
        command->add_option("-o,--output", output_.file, "write this file, not standard output");
        command->add_flag("--force", output_.force, "write over a file that is there");
    }

    void add_import() {
        CLI::App* command = cli_.add_subcommand(
            "import", "make a configuration of mbusd's, Kepware's, Telegraf's or Home Assistant's");
        command
            ->add_option("FILE", imported_,
                         "mbusd.conf, or the unit or script that starts mbusd with options; a CSV, "
                         "a telegraf.conf, a configuration.yaml; - for standard input")
            ->required();
        add_output(command);
        command->footer(
            "Exit codes: 0 fine; 64 usage, or the output is there; 66 the file cannot be read; 70 "
            "the output cannot be written; 78 the file has faults.");
        command->callback([this] { code_ = import_conf(imported_, output_); });
    }

    void add_schema() {
        CLI::App* command =
            cli_.add_subcommand("schema", "print a JSON Schema of the configuration, for editors");
        command->callback([this] { code_ = schema(); });
    }

    void add_address() {
        CLI::App* command =
            cli_.add_subcommand("address", "vendor notation to Modbus table and address, and back");
        command->add_option("PROFILE", profile_, "a panel profile, by name")->required();
        command->add_option("NOTATION", notation_, "UB180, or back: coil/288")->required();
        add_profiles_dir(command, profiles_dir_);
        command->callback([this] { code_ = address(profile_, notation_, profiles_dir_); });
    }

    void add_profiles() {
        CLI::App* command =
            cli_.add_subcommand("profiles", "list the panel profiles, show one, or check a file");
        command->add_option("NAME", name_, "of the profile that is shown");
        add_profiles_dir(command, profiles_dir_);
        command->add_option(
            "--check", profile_file_,
            "judge a file that describes a panel, - for standard input, and say what would be "
            "right");
        command->footer(
            "Exit codes: 0 fine; 64 usage; 66 the file cannot be read; 78 a file has faults.");
        command->callback([this] {
            if (!profile_file_.empty() && !name_.empty())
                throw CLI::ValidationError("--check", "it takes a file, and no NAME beside it");
            code_ = profile_file_.empty() ? profiles(name_, profiles_dir_)
                                          : check_profile_file(profile_file_);
        });
    }

    void add_health() {
        CLI::App* command =
            cli_.add_subcommand("health", "ask a running gateway whether it is ready (/readyz)");
        add_file(command);
        command->add_option("--http", http_,
                            "HOST:PORT of its REST API; without: what the configuration file says, "
                            "or 127.0.0.1:8080");
        command->add_option("--ca", ca_, kCa);
        command->add_flag("--active", active_,
                          "also ask whether it drives its lines, as not the standby");
        command->footer(
            "Exit codes: 0 it is ready; 1 it is not, or says nothing for 2 s; 64 usage.");
        command->callback([this] { code_ = health({file_, http_, "", ca_}, active_); });
    }

    void add_reload() {
        CLI::App* command = cli_.add_subcommand(
            "reload", "have a running gateway read its file again, and print its verdict");
        command->add_option("-c,--config", reload_.file, "its file, which says where it listens")
            ->capture_default_str();
        command->add_option("--http", reload_.http, "HOST:PORT of its REST API");
        command->add_option("--token-file", reload_.token_file,
                            "a file whose first line is a token of the role admin");
        command->add_option("--ca", reload_.ca, kCa);
        command->add_flag("--rollback", reload_.rollback,
                          "serve what ran before the last reload, whatever the file says");
        command
            ->add_flag("--weaker", reload_.weaker,
                       "with --rollback: also where that protects less (access, allow, hosts, "
                       "guard, roles)")
            ->needs("--rollback");
        command->footer(
            "Exit codes: 0 it serves the file, or did already; 1 no gateway could be asked, or a "
            "rollback would protect less; 69 valid, but something could not be opened; 75 the "
            "gateway got the signal, and cannot be asked for the result; 78 the file has "
            "faults.\nAfter 1, 69 and 78 nothing has changed.");
        command->callback([this] { code_ = reload(reload_); });
    }

    CLI::App cli_{kAbout, "panelgate"};
    ExitCode code_ = kFine;
    std::string file_ = kDefaultConfig;
    std::string ca_;
    std::string path_;  ///< of a setting
    bool simulated_ = false;
    bool watch_ = false;
    ReloadOptions reload_{.file = kDefaultConfig, .http = {}, .token_file = {}};
    std::string http_;
    std::string modbus_;
    std::string format_ = "text";
    CheckOptions check_;
    std::vector<std::string> links_;
    ScanOptions scan_;
    OutputFile output_;
    bool active_ = false;
    std::string imported_;
    std::string profile_;
    std::string notation_;
    std::string name_;
    std::string profiles_dir_;
    std::string profile_file_;
};

/// Reopens closed standard descriptors on /dev/null, in the direction that still makes their use
/// fail: otherwise a socket would get their number, and our output.
void keep_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) >= 0) continue;
        ::open("/dev/null",
               fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // gets the lowest free number
    }
}

}  // namespace

int main(int argc, char** argv) {
    keep_standard_descriptors();
    try {
        const int code = CommandLine().parse({argv + 1, argv + argc});
        if (code != kFine || std::cout.flush()) return code;
        std::cerr << "panelgate: stdout takes nothing: what was asked for is lost\n";
        return kInternal;
    } catch (const std::exception& error) {
        std::cerr << "panelgate: internal error: " << error.what() << '\n';
        return kInternal;
    }
}
