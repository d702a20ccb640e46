#include "command_line.hpp"

#include <CLI/CLI.hpp>
#include <CLI/Error.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

namespace panelgate::commands {

namespace {

constexpr std::size_t kWidth = 80;
constexpr std::size_t kColumn = 30;         // where the descriptions of options begin
constexpr std::size_t kCommandColumn = 14;  // the same of commands

struct Example {
    std::string_view command;  ///< "config get": of its parent
    std::string_view text;     ///< a line each, without "panelgate"
};

constexpr std::array kExamples{
    Example{"demo", "demo\ndemo --http 127.0.0.1:8081 --modbus 127.0.0.1:1503"},
    Example{"scan",
            "scan /dev/ttyUSB0\nscan /dev/ttyUSB0 --quick --stations 1-10\n"
            "scan tcp://192.168.10.40:4001 --yaml"},
    Example{"init",
            "init /dev/ttyUSB0 -o panelgate.yaml\n"
            "init /dev/ttyUSB0 --quick --baud 38400 --parity none"},
    Example{"run", "run -c panelgate.yaml\nrun -c panelgate.yaml --simulate"},
    Example{"simulate",
            "simulate -c panelgate.yaml --line floor1=/tmp/floor1\n"
            "simulate -c panelgate.yaml --line floor1=tcp://127.0.0.1:4001"},
    Example{"read",
            "read oven/temperature\nread press UW100 --type f32 --order CDAB\n"
            "read floor1/17 holding-registers/4 --count 10"},
    Example{"write",
            "write press/setpoint 30\nwrite oven GDT120 7 -2\n"
            "write oven/mode manual --token-file ops.token"},
    Example{"watch", "watch oven/temperature press/setpoint\nwatch press UW0 UW1 oven GDT108"},
    Example{"status", "status\nstatus --http 192.168.10.2:8080"},
    Example{"top", "top\ntop --once"},
    Example{"trace", "trace --station press --errors\ntrace --line floor1 --follow"},
    Example{"report", "report\nreport -o press-trouble.json"},
    Example{"health", "health --http 127.0.0.1:8080"},
    Example{"reload", "reload -c panelgate.yaml\nreload --rollback"},
    Example{"check", "check -c panelgate.yaml\ncheck -c new.yaml --diff panelgate.yaml"},
    Example{"config", "config get lines.floor1.stations.press\nconfig keys lines.timing"},
    Example{"get", "config get -c panelgate.yaml lines.floor1.stations.press.retries"},
    Example{"keys", "config keys lines.stations.points"},
    Example{"schema", "schema > panelgate.schema.json"},
    Example{"import",
            "import /etc/mbusd.conf -o panelgate.yaml\n"
            "import /etc/systemd/system/mbusd.service -o panelgate.yaml"},
    Example{"address", "address panasonic-gt GDT108\naddress autonics-gplp-s coil/288"},
    Example{"cert",
            "cert new-ca\ncert new-server gateway.plant 10.0.0.5\n"
            "cert new-client scada --role operator\ncert revoke scada.crt"},
    Example{"new-ca", "cert new-ca"},
    Example{"new-server", "cert new-server gateway.plant 10.0.0.5"},
    Example{"new-client", "cert new-client scada --role operator"},
    Example{"revoke", "cert revoke scada.crt"},
    Example{"audit",
            "audit verify --log panelgate.log\n"
            "audit show --station press --since 1h"},
    Example{"verify",
            "audit verify -c panelgate.yaml --log panelgate.log\n"
            "audit verify audit.jsonl audit.jsonl.000000000001"},
    Example{"show",
            "audit show --station press --since 1h\naudit show --kind reload --since 7d\n"
            "audit show --client ops --json"},
    Example{"token", "token new --name scada --role operator --expires 90d"},
    Example{"new",
            "token new --name scada --role operator --expires 90d\n"
            "token new --name wall --role viewer -o /etc/panelgate/wall.hash"},
    Example{"profiles", "profiles\nprofiles autonics-gplp-s\nprofiles --check acme-meter.yaml"},
};

/// Breaks a line at blanks. What is indented is to be typed, and stays as it is.
std::string wrapped(std::string_view line, std::size_t width) {
    std::string text;
    while (line.size() > width && !line.starts_with(' ')) {
        std::size_t end = line.rfind(' ', width);
        if (end == line.npos) end = std::min(line.find(' '), line.size());
        text += std::string(line.substr(0, end)) + '\n';
        line.remove_prefix(std::min(end + 1, line.size()));
    }
    return text + std::string(line);
}

std::string wrapped_lines(std::string_view lines, std::size_t width) {
    std::string text;
    while (!lines.empty()) {
        const std::size_t end = std::min(lines.find('\n'), lines.size());
        text += wrapped(lines.substr(0, end), width) + '\n';
        lines.remove_prefix(std::min(end + 1, lines.size()));
    }
    return text;
}

class Narrow final : public CLI::Formatter {
  public:
    std::string make_option_desc(const CLI::Option* option) const override {
        return wrapped(option->get_description(), kWidth - kColumn);
    }
    std::string make_subcommand(const CLI::App* command) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, command->get_name(),
                                 wrapped(command->get_description(), kWidth - kCommandColumn),
                                 kCommandColumn);
        return out.str();
    }
    std::string make_description(const CLI::App* app) const override {
        return wrapped_lines(CLI::Formatter::make_description(app), kWidth);
    }
    std::string make_footer(const CLI::App* app) const override {
        return wrapped_lines(app->get_footer(), kWidth);
    }
};

void add_example(CLI::App& command) {
    const auto found = std::ranges::find(kExamples, command.get_name(), &Example::command);
    if (found == kExamples.end()) return;
    const std::string_view lines = found->text;
    std::string text = lines.find('\n') == lines.npos ? "Example:\n" : "Examples:\n";
    for (std::size_t begin = 0; begin < lines.size();) {
        const std::size_t end = std::min(lines.find('\n', begin), lines.size());
        text += "  panelgate " + std::string(lines.substr(begin, end - begin)) + '\n';
        begin = end + 1;
    }
    const std::string notes = command.get_footer();
    command.footer(text + (notes.empty() ? "" : '\n' + notes));
}

void shape(CLI::App& command, const std::shared_ptr<CLI::FormatterBase>& formatter) {
    command.formatter(formatter);
    for (CLI::App* sub : command.get_subcommands({})) {
        add_example(*sub);
        shape(*sub, formatter);
    }
}

}  // namespace

void shape_help(CLI::App& cli) {
    const auto formatter = std::make_shared<Narrow>();
    formatter->column_width(kColumn);
    shape(cli, formatter);
}

namespace {

/// "text,json" as "text or json".
std::string choices(std::string_view list) {
    std::string words;
    while (!list.empty()) {
        const std::size_t comma = std::min(list.find(','), list.size());
        if (!words.empty()) words += comma == list.size() ? " or " : ", ";
        words += list.substr(0, comma);
        list.remove_prefix(std::min(comma + 1, list.size()));
    }
    return words;
}

/// "--format: xml not in {text,json}"
std::string wrong_choice(const std::string& text, const std::string& option) {
    constexpr std::string_view kBetween = " not in {";
    const std::size_t between = text.find(kBetween);
    const std::size_t value = option.size() + 2;
    if (between == text.npos || !text.ends_with('}') || value > between) return text;
    const std::size_t list = between + kBetween.size();
    return option + " must be " +
           choices(std::string_view(text).substr(list, text.size() - list - 1)) + ", not '" +
           text.substr(value, between - value) + '\'';
}

}  // namespace

std::string usage_fault(const CLI::ParseError& error) {
    const std::string text = error.what();
    const std::string kind = error.get_name();
    const std::string option = text.substr(0, text.find(':'));  // or the whole text
    if (kind == "RequiredError") return text.substr(0, text.find(" is required")) + " is missing";
    if (kind == "ArgumentMismatch")
        return option + (text.find("At Most") != text.npos ? " may be given once"
                                                           : " needs a value after it");
    if (kind == "ConversionError") return "an option that takes no value was given one";
    if (kind == "RequiresError") return text;  // "--weaker requires --rollback"
    if (kind == "ValidationError") return wrong_choice(text, option);
    const int extras =
        static_cast<int>(CLI::ExitCodes::ExtrasError);  // its kind is the command's name
    if (error.get_exit_code() != extras) return "these options cannot be understood";
    const std::string word = text.substr(text.rfind(' ') + 1);
    const bool is_option = word.starts_with('-') && word != "--";
    return is_option ? "there is no option " + word + " here" : "nothing may follow '--'";
}

void refuse_empty_values(CLI::App& app) {
    for (CLI::Option* option : app.get_options()) {
        if (option->get_positional() || option->get_items_expected_min() == 0) continue;
        option->check([](const std::string& value) {
            return value.empty() ? std::string("a value is missing after it") : std::string();
        });
    }
    for (CLI::App* command : app.get_subcommands({})) refuse_empty_values(*command);
}

}  // namespace panelgate::commands
