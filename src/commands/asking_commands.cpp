#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace panelgate::commands {

namespace {

constexpr const char* kStation = "a station's name, its id, or LINE/ID";
constexpr const char* kPlace =
    "a notation such as UW100, TABLE/ADDRESS such as holding-registers/4, or a point's name; also "
    "in one word with the station: oven/temperature";
constexpr const char* kExitCodes =
    "Exit codes: 0 fine; 1 the gateway refuses, or there is no such place; 64 usage; 66 the token "
    "file cannot be read; 69 no gateway answers.";

/// What one command has typed: lives as long as its App.
struct Typed {
    GatewayOptions at;
    std::string station;
    std::optional<std::string> place;
    std::vector<std::string> more;
    std::string type;
    std::string order;
    unsigned count = 0;
    std::string format = "text";
    TraceOptions trace;
    std::string file;
    bool once = false;

    std::vector<std::string> words() const {
        std::vector<std::string> all{station};
        if (place) all.push_back(*place);
        all.insert(all.end(), more.begin(), more.end());  // an empty text is a value
        return all;
    }
};

/// A check of `--count`, in words.
auto from_1_to(unsigned most) {
    return [most](const std::string& typed) {
        unsigned number = 0;
        const char* const end = typed.data() + typed.size();
        const auto [stop, error] = std::from_chars(typed.data(), end, number);
        if (error == std::errc() && stop == end && number >= 1 && number <= most)
            return std::string();
        return "it is a whole number from 1 to " + std::to_string(most) + ", not '" + typed + '\'';
    };
}

class Adder {
  public:
    Adder(CLI::App& cli, ExitCode& code) : cli_(cli), code_(code) {}

    /// A command, with the options that say which gateway.
    CLI::App* add(const char* name, const char* about, const std::shared_ptr<Typed>& typed) {
        CLI::App* command = cli_.add_subcommand(name, about);
        command->group(kAsk);
        command->add_option("-c,--config", typed->at.file, "its file, which says where it listens")
            ->capture_default_str();
        command->add_option("--http", typed->at.http,
                            "HOST:PORT of its REST API; without: what the configuration file says, "
                            "or 127.0.0.1:8080");
        command->add_option("--token-file", typed->at.token_file,
                            "a file whose first line is a token");
        command->add_option("--ca", typed->at.ca, kCa);
        command->footer(kExitCodes);
        return command;
    }

    void add_place(CLI::App* command, const std::shared_ptr<Typed>& typed) {
        command->add_option("STATION", typed->station, kStation)->required();
        command->add_option("PLACE", typed->place, kPlace);
        command->add_option("--type", typed->type,
                            "of the values: u16, i16, u32, i32, f32, bool, string, ...");
        command->add_option("--order", typed->order, "of the bytes of a longer type, such as CDAB");
    }

    template <class Run>
    void on_call(CLI::App* command, Run run) {
        command->callback([&code = code_, run = std::move(run)] { code = run(); });
    }

  private:
    CLI::App& cli_;
    ExitCode& code_;
};

void add_format(CLI::App* command, const std::shared_ptr<Typed>& typed) {
    command->add_option("--format", typed->format, "text or json")
        ->check(CLI::IsMember({"text", "json"}));
}

void add_read(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command = adder.add("read", "read a value of a panel", typed);
    adder.add_place(command, typed);
    command->add_option("--count", typed->count, "how many values")->check(from_1_to(65536));
    add_format(command, typed);
    command->footer(
        "Exit codes: 0 it is read; 1 the gateway refuses, the panel does not answer, or a point "
        "has no current value; 64 usage; 66 the token file cannot be read; 69 no gateway answers.");
    adder.on_call(command, [typed] {
        return read(typed->at, {.words = typed->words(),
                                .type = typed->type,
                                .order = typed->order,
                                .count = typed->count,
                                .json = typed->format == "json"});
    });
}

void add_write(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command = adder.add("write", "write a value to a panel", typed);
    adder.add_place(command, typed);
    command->add_option("VALUE", typed->more,
                        "a number, true or false, on or off, or a text; several go to places that "
                        "follow each other");
    command->footer(
        "Exit codes: 0 the panel has confirmed it; 1 refused, or not confirmed: the message says "
        "whether it was transmitted; 64 usage; 66 the token file cannot be read; 69 no gateway "
        "answers.");
    adder.on_call(command, [typed] {
        return write(typed->at,
                     {.words = typed->words(), .type = typed->type, .order = typed->order});
    });
}

void add_watch(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command =
        adder.add("watch", "print a line whenever a value of a panel changes", typed);
    adder.add_place(command, typed);
    command->add_option("MORE", typed->more,
                        "further places of the station, or further stations, each with its places");
    command->add_option("--count", typed->count, "end after so many lines")
        ->check(from_1_to(1'000'000'000));
    command->footer(
        "Points are printed as the gateway polls them, other places are read once a second. Times "
        "are UTC.\nCtrl-C ends it with 0. Other exit codes: 1 the gateway refuses, or there is no "
        "such place; 64 usage; 66 the token file cannot be read; 69 no gateway answers.");
    adder.on_call(command, [typed] {
        return watch(typed->at, {.words = typed->words(),
                                 .type = typed->type,
                                 .order = typed->order,
                                 .count = typed->count});
    });
}

void add_status(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command =
        adder.add("status", "say how lines and stations are, and what is not well", typed);
    add_format(command, typed);
    command->footer(
        "Exit codes: 0 all is well; 1 a line, a station, a relay or a listener is not, or there "
        "are findings or alarms; 64 usage; 66 the token file cannot be read; 69 no gateway "
        "answers.");
    adder.on_call(command, [typed] { return status(typed->at, typed->format == "json"); });
    const auto shown = std::make_shared<Typed>();
    command = adder.add(
        "top", "show load, clients and slow panels of the last minute, drawn each second", shown);
    command->add_flag("--once", shown->once, "one look, as on a pipe");
    adder.on_call(command, [shown] { return top(shown->at, shown->once); });
}

void add_trace(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    typed->trace.count = 20;
    CLI::App* command = adder.add("trace", "print the last transactions, with their frames", typed);
    command->add_option("--station", typed->trace.station, std::string("only of ") + kStation);
    command->add_option("--line", typed->trace.line, "only of this line");
    command->add_flag("--errors", typed->trace.errors, "only what failed");
    command->add_option("--count", typed->trace.count, "how many, at most")
        ->capture_default_str()
        ->check(from_1_to(500));
    command->add_flag("--follow", typed->trace.follow, "go on with what comes");
    adder.on_call(command, [typed] { return trace(typed->at, typed->trace); });
}

void add_report(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command = adder.add(
        "report", "write all that a gateway knows about itself into a file, for support", typed);
    command->add_option("-o,--output", typed->file,
                        "a file that is not there yet, - for standard output; without: "
                        "panelgate-report-TIME.json");
    command->footer(
        "The file is JSON: configuration without secrets, state, findings, incidents, traces, "
        "metrics.\nExit codes: 0 it is written; 1 the gateway refuses; 64 usage, or the file is "
        "there; 66 the token file cannot be read; 69 no gateway answers; 70 the file cannot be "
        "written.");
    adder.on_call(command, [typed] { return report(typed->at, typed->file); });
}

/// For the shell's completion; not in the help.
void add_names(Adder& adder) {
    const auto typed = std::make_shared<Typed>();
    CLI::App* command = adder.add("names", "print names of stations, or of points", typed);
    command->group("");
    command->add_option("STATION", typed->station, "whose points");
    adder.on_call(command, [typed] { return names(typed->at, typed->station); });
}

}  // namespace

void add_asking_commands(CLI::App& cli, ExitCode& code) {
    Adder adder(cli, code);
    add_read(adder);
    add_write(adder);
    add_watch(adder);
    add_status(adder);
    add_trace(adder);
    add_report(adder);
    add_names(adder);
}

}  // namespace panelgate::commands
