#include "panelgate/mbusd/conf.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::mbusd {

using config::Endpoint;

namespace {

/// Parses a number as mbusd does (strtoul() with base 0; cfg.c, cfg_handle_param()): 0x1F6, 010 for
/// 8; text after the digits is ignored. Nothing without a digit (0 to mbusd), if negative or beyond
/// 2^31 - 1.
std::optional<std::int64_t> parse_number(const std::string& text) {
    char* stop = nullptr;
    const long long value = std::strtoll(text.c_str(), &stop, 0);
    constexpr long long kMost = std::numeric_limits<std::int32_t>::max();
    if (stop == text.c_str() || text[0] == '-' || value > kMost) return std::nullopt;
    return value;
}

/// One NAME = VALUE of an mbusd.conf.
struct Line {
    std::string name;
    std::string value;
    yaml::Mark mark;        ///< of the name
    yaml::Mark value_mark;  ///< or of the end of the line
};

/// Only a line that begins with '#' is a comment: text after a value belongs to the value. A
/// leading byte order mark is skipped. Invalid lines are added to `problems`.
std::vector<Line> lines_of(std::string_view text, yaml::Problems& problems) {
    std::vector<Line> lines;
    text.remove_prefix(byte_order_mark(text));
    for (int number = 1; !text.empty(); ++number) {
        std::string_view whole = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(whole.size() + 1, text.size()));
        if (whole.ends_with('\r')) whole.remove_suffix(1);
        const std::string_view typed = trimmed(whole);
        if (typed.empty() || typed[0] == '#') continue;
        const std::size_t sign = std::min(typed.find('='), typed.size());
        const std::string_view name = trimmed(typed.substr(0, sign));
        const std::string_view value = trimmed(typed.substr(std::min(sign + 1, typed.size())));
        const auto mark = [&](const char* at) {
            return yaml::Mark{number, static_cast<int>(at - whole.data()) + 1};
        };
        const yaml::Mark behind = mark(value.empty() ? typed.data() + typed.size() : value.data());
        if (sign == typed.size() || name.empty())
            problems.add(mark(typed.data()),
                         "a line must be NAME = VALUE such as speed = 19200, or a comment that "
                         "begins with '#', not " +
                             yaml::quote(typed));
        else if (std::ranges::any_of(value, is_control))
            problems.add(behind,
                         std::string(name) + " must be plain text; it holds control characters");
        else
            lines.push_back({std::string(name), std::string(value), mark(typed.data()), behind});
    }
    return lines;
}

/// What a file of another program holds, and no mbusd.conf.
struct Foreign {
    std::string_view sign;
    std::string_view program;
    std::string_view page;
};
constexpr std::string_view kOthers = "docs/start/from-other-programs";
constexpr auto kForeign = std::to_array<Foreign>({
    {"[[inputs.modbus", "Telegraf", kOthers},
    {"metricType:", "modbus_exporter", kOthers},
    {"bytesize:", "Home Assistant", kOthers},
    {"rtuovertcp", "Home Assistant", kOthers},
    {"input_type:", "Home Assistant", kOthers},
    {"accepter:", "ser2net", "docs/start/from-ser2net"},
    {":raw:", "ser2net", "docs/start/from-ser2net"},
    {":telnet:", "ser2net", "docs/start/from-ser2net"},
});

/// Tells whose file this is, where it is none of mbusd. One problem then says more than one a line.
bool is_foreign(std::string_view text, yaml::Problems& problems) {
    for (const auto& [sign, program, page] : kForeign) {
        const std::size_t at = text.find(sign);
        if (at == text.npos) continue;
        const auto line = 1 + std::ranges::count(text.substr(0, at), '\n');
        problems.add({static_cast<int>(line), 1}, "this is a file of " + std::string(program) +
                                                      ", which import does not read so; " +
                                                      std::string(page) +
                                                      " says which key is which here");
        return true;
    }
    return false;
}

/// An option of mbusd's command line (main.c, getopt()) and the setting that it stands for.
struct Option {
    char letter;
    std::string_view name;   ///< of the setting; "" none
    std::string_view value;  ///< "" the option's argument
    bool takes_argument = value.empty();
};
constexpr auto kOptions = std::to_array<Option>({
    {'p', "device", ""},
    {'s', "speed", ""},
    {'m', "mode", ""},
    {'A', "address", ""},
    {'P', "port", ""},
    {'C', "maxconn", ""},
    {'N', "retries", ""},
    {'R', "pause", ""},
    {'W', "wait", ""},
    {'T', "timeout", ""},
    {'v', "loglevel", ""},
    {'L', "logfile", ""},
    {'c', "", ""},
    {'S', "enable_rs485", "yes"},
    {'t', "trx_control", "rts_1"},
    {'r', "trx_control", "rts_0"},
    {'y', "trx_control", "sysfs_1", true},
    {'Y', "trx_control", "sysfs_0", true},
    {'b', "replyonbroadcast", "yes"},
    {'d', "", "no"},
});

struct Word {
    std::string text;
    yaml::Mark mark;
};

/// The words of a line, without quotes around them.
std::vector<Word> words_of(std::string_view line, int number) {
    constexpr std::string_view kBlanks = " \t\r";
    std::vector<Word> words;
    for (std::size_t at = line.find_first_not_of(kBlanks); at < line.size();
         at = line.find_first_not_of(kBlanks, at)) {
        const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
        std::string word(line.substr(at, end - at));
        std::erase_if(word, [](char c) { return c == '"' || c == '\''; });
        words.push_back({std::move(word), {number, static_cast<int>(at) + 1}});
        at = end;
    }
    return words;
}

/// The words behind "mbusd" where it is started, as by a shell, or by ExecStart= of systemd; else
/// nothing. A line may go on behind a backslash.
std::vector<Word> command_line(std::string text) {
    for (std::size_t at = 0; (at = text.find("\\\n", at)) != text.npos;) text.replace(at, 2, "  ");
    int number = 0;
    for (std::string_view rest = text; !rest.empty();) {
        const std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(line.size() + 1, rest.size()));
        std::vector<Word> words = words_of(line, ++number);
        const auto is_mbusd = [](const Word& word) {
            return word.text.substr(word.text.find_last_of("/=") + 1) == "mbusd";
        };
        const auto found = std::ranges::find_if(words, is_mbusd);
        if (found == words.end() || words[0].text.starts_with('#')) continue;
        words.erase(words.begin(), found + 1);
        if (!words.empty() && words[0].text.starts_with('-')) return words;
    }
    return {};
}

/// Returns the settings that mbusd's options stand for. Adds unknown options to `problems`.
std::vector<Line> lines_of(const std::vector<Word>& words, yaml::Problems& problems) {
    std::vector<Line> lines;
    for (auto word = words.begin(); word != words.end(); ++word) {
        const std::string& text = word->text;
        const char letter = text.size() > 1 && text[0] == '-' ? text[1] : ' ';
        const auto* const option = std::ranges::find(kOptions, letter, &Option::letter);
        if (option == kOptions.end()) {
            problems.add(word->mark, "mbusd has no option " + yaml::quote(text));
            continue;
        }
        std::string argument = option->takes_argument ? text.substr(2) : "";
        if (option->takes_argument && argument.empty() && word + 1 != words.end())
            argument = (++word)->text;
        if (letter == 'c')
            problems.add(word->mark,
                         "the settings are in " + yaml::quote(argument) + ": import that file");
        else if (letter == 'p' && !argument.starts_with('/'))
            argument.insert(0, "/dev/");
        if (option->name.empty()) continue;
        lines.push_back({std::string(option->name),
                         option->value.empty() ? argument : std::string(option->value), word->mark,
                         word->mark});
    }
    return lines;
}

/// mbusd's settings, with its defaults (cfg.c, cfg_init(); README).
struct Settings {
    std::string device = "/dev/ttyS0";
    std::int64_t speed = 19200;
    std::string mode = "8N1";
    std::string rs485 = "{mode: off}";
    std::string address = "0.0.0.0";
    std::int64_t port = 502;
    std::int64_t connections = 32;
    std::int64_t retries = 3;
    std::int64_t wait = 500;  ///< ms
    bool replies_to_broadcasts = false;
    std::string level = "info";
};

/// Returns text that a comment may hold, whatever the file's encoding.
std::string as_ascii(std::string text) {
    std::ranges::replace_if(text, [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

/// In single quotes only quotes and variables need escaping.
std::string quoted(std::string_view text) {
    std::string made = "'";
    for (const char c : text) made += c == '\'' ? "''" : c == '$' ? "$$" : std::string(1, c);
    return made + '\'';
}

/// Parses an address, IPv6 with brackets or without.
std::optional<Endpoint> endpoint_of(const std::string& address, std::int64_t port) {
    const std::string end = ':' + std::to_string(port);
    const bool bare = address.find(':') != address.npos && address[0] != '[';
    return config::parse_endpoint(bare ? '[' + address + ']' + end : address + end);
}

class Reader {
  public:
    explicit Reader(yaml::Problems& problems) : problems_(problems) {}

    void take(const Line& line) {
        line_ = &line;
        using Read = void (*)(Reader&);
        static constexpr auto kKeys = std::to_array<std::pair<std::string_view, Read>>({
            {"device", [](Reader& in) { in.device(); }},
            {"speed", [](Reader& in) { in.integer(in.mbusd_.speed, 50, 4'000'000); }},
            {"mode", [](Reader& in) { in.mode(); }},
            {"enable_rs485", [](Reader& in) { in.yes_or_no(in.kernel_); }},
            {"trx_control", [](Reader& in) { in.trx_control(); }},
            {"trx_sysfile", [](Reader&) {}},  // trx_control says what becomes of it
            {"address", [](Reader& in) { in.address(); }},
            {"port", [](Reader& in) { in.integer(in.mbusd_.port, 1, 65535); }},
            {"maxconn", [](Reader& in) { in.integer(in.mbusd_.connections, 1, 65535); }},
            {"timeout", [](Reader& in) { in.timeout(); }},
            {"retries", [](Reader& in) { in.retries(); }},
            {"pause", [](Reader& in) { in.pause(); }},
            {"wait", [](Reader& in) { in.integer(in.mbusd_.wait, 1, 120'000); }},
            {"replyonbroadcast", [](Reader& in) { in.yes_or_no(in.mbusd_.replies_to_broadcasts); }},
            {"loglevel", [](Reader& in) { in.loglevel(); }},
            {"logfile",
             [](Reader&
                    in) { in.note("the log goes to standard error: under systemd to the journal"); }},
            {"daemon", [](Reader& in) { in.note("deploy/ has a unit for systemd"); }},
            {"enable_rmtaddr_in_log",
             [](Reader&
                    in) { in.note("the log and the status always name clients by their addresses"); }},
        });
        std::vector<std::string_view> names;
        for (const auto& [name, read] : kKeys) {
            names.push_back(name);
            if (name != line.name) continue;
            if (line.value.empty() && name != "trx_sysfile" && name != "logfile")
                wrong("has no value; leave the line out for the default");
            else
                read(*this);
            return;
        }
        problems_.add(line.mark, "mbusd has no setting " + yaml::quote(line.name) +
                                     yaml::did_you_mean(line.name, names, "settings"));
    }

    /// Returns the settings. A driver that switches the transceiver wins over RTS.
    const Settings& mbusd() {
        if (kernel_) mbusd_.rs485 = "{mode: kernel}";
        return mbusd_;
    }
    const std::vector<std::string>& notes() const { return notes_; }

  private:
    void wrong(const std::string& what) {
        problems_.add(line_->value_mark, line_->name + ' ' + what);
    }
    void wrong_value(const std::string& wanted) {
        wrong("must be " + wanted + ", not " + yaml::quote(line_->value));
    }
    /// Records what has no counterpart, and why.
    void note(const std::string& why) {
        notes_.push_back(problems_.file() + ':' + std::to_string(line_->mark.line) + ": " +
                         as_ascii(line_->name + " = " + line_->value) + ": " + why);
    }
    void integer(std::int64_t& value, std::int64_t min, std::int64_t max) {
        const auto number = parse_number(line_->value);
        if (!number || *number < min || *number > max)
            return wrong_value("a whole number from " + std::to_string(min) + " to " +
                               std::to_string(max));
        value = *number;
    }
    void yes_or_no(bool& yes) {
        static const std::set<std::string, std::less<>> kYes{"yes", "y", "true", "on", "1"};
        static const std::set<std::string, std::less<>> kNo{"no", "n", "false", "off", "0"};
        yes = kYes.contains(to_lower(line_->value));
        if (!yes && !kNo.contains(to_lower(line_->value))) wrong_value("yes or no");
    }
    void device() {
        const std::string& path = mbusd_.device = line_->value;
        const bool is_tty = path.starts_with("/dev/tty");
        // systemd's %i stands for what the unit is started with.
        const bool more = is_tty && path.find_first_of(":,;# %") != path.npos;
        if (path[0] != '/' || more || as_ascii(path) != path)
            wrong_value("the absolute path of a device alone, such as /dev/ttyS0");
    }
    void mode() {
        const std::string& typed = line_->value;
        constexpr std::string_view kParityLetters = "nNeEoO";
        const bool right = typed.size() == 3 && typed[0] == '8' &&
                           kParityLetters.find(typed[1]) != kParityLetters.npos &&
                           (typed[2] == '1' || typed[2] == '2');
        if (right)
            mbusd_.mode = typed;
        else
            wrong_value("8 data bits, parity n, e or o, and 1 or 2 stop bits, such as 8n1");
    }
    void trx_control() {
        static const std::set<std::string, std::less<>> kWords{"addc",  "rts",     "rts_0",
                                                               "rts_1", "sysfs_0", "sysfs_1"};
        const std::string typed = to_lower(line_->value);
        if (!kWords.contains(typed))
            return wrong_value("addc, rts_0, rts_1 (or rts), sysfs_0 or sysfs_1");
        mbusd_.rs485 = "{mode: off}";
        if (typed.starts_with("rts"))
            mbusd_.rs485 = std::string("{mode: rts, rts_on_send: ") +
                           (typed == "rts_0" ? "low" : "high") + '}';
        if (typed.starts_with("sysfs"))
            note(
                "a GPIO that is switched through a file is late by what the machine is busy; the "
                "driver does it to the bit: bind it to the UART (device tree: rts-gpios, "
                "linux,rs485-enabled-at-boot-time) and write rs485: {mode: kernel}");
    }
    void address() {
        if (endpoint_of(line_->value, 1))
            mbusd_.address = line_->value;
        else
            wrong_value("an IP address such as 0.0.0.0 or 127.0.0.1");
    }
    void timeout() {
        std::int64_t idle = 0;
        integer(idle, 0, 1'000'000);
        if (idle == 0) return;  // nor does mbusd close any then
        note(
            "connections are not closed for being idle; TCP keep-alive finds those whose client "
            "is gone within 90 s");
    }
    void retries() {
        integer(mbusd_.retries, 0, 15);
        if (mbusd_.retries > 10) note("10 is the most");
        mbusd_.retries = std::min<std::int64_t>(mbusd_.retries, 10);
    }
    void pause() {
        std::int64_t pause = 100;
        integer(pause, 0, 10'000);
        if (pause == 0) return;  // no more than t3.5, as here
        note(
            "between two requests is t3.5, as the standard says, and nothing else; panels that "
            "need more get timing: {frame_gap: " +
            std::to_string(pause) + "ms}, which costs its share of every second");
    }
    void loglevel() {
        constexpr std::array<const char*, 4> kLevels{"error", "warn", "info", "debug"};
        std::int64_t level = 2;
        integer(level, 0, 9);
        mbusd_.level = kLevels[static_cast<std::size_t>(std::min<std::int64_t>(level, 3))];
    }
    yaml::Problems& problems_;
    const Line* line_ = nullptr;
    Settings mbusd_;
    bool kernel_ = false;
    std::vector<std::string> notes_;
};

/// All attempts must fit; empty if the default is enough.
std::string deadline_text(const Settings& mbusd) {
    constexpr std::int64_t kDefault = 2000;
    const std::int64_t needed = (mbusd.retries + 1) * (mbusd.wait + 100) + 100;
    if (needed <= kDefault) return "";
    constexpr std::int64_t kMost = 600;  // 10 min
    const std::int64_t seconds = std::min((needed + 999) / 1000, kMost);
    return "    queue: {deadline: " + std::to_string(seconds) +
           "s}   # all tries fit into it; clients have to wait for longer\n";
}

constexpr std::string_view kForm = R"(# made of an mbusd.conf by panelgate import
lines:
  - name: line1
    device: $
    serial: {baud: $, data_bits: 8, parity: $, stop_bits: $}
    rs485: $
    timing: {response_timeout: $ms}
    retries: $   # of reads; mbusd repeats writes, too: here a station says retry_writes: true
$    # stations:   # none are needed: all addresses pass. Listed, they have names, points,
    #   - {id: 1, name: press, profile: autonics-gplp-s}   # limits: panelgate init
modbus_tcp:
  - listen: '$'
    broadcast: $
    max_connections: $
$log: {level: $}
)";
constexpr std::string_view kHttp =
    "http:   # status, metrics and a dashboard, which mbusd has not\n  listen: 127.0.0.1:8080\n";

/// Puts the values in place of the '$' of the form.
std::string filled(std::string_view form, std::initializer_list<std::string> values) {
    std::string text;
    for (const std::string& value : values) {
        const std::size_t at = form.find('$');
        text += std::string(form.substr(0, at)) + value;
        form.remove_prefix(at + 1);
    }
    return text + std::string(form);
}

std::string yaml_of(const Settings& mbusd, const std::vector<std::string>& notes) {
    const char parity = to_lower(mbusd.mode)[1];
    const auto listen = endpoint_of(mbusd.address, mbusd.port);
    std::string text = filled(
        kForm, {quoted(mbusd.device), std::to_string(mbusd.speed),
                parity == 'n'   ? "none"
                : parity == 'e' ? "even"
                                : "odd",
                std::string(1, mbusd.mode[2]), mbusd.rs485, std::to_string(mbusd.wait),
                std::to_string(mbusd.retries), deadline_text(mbusd),
                listen ? endpoint_text(listen->address, listen->port) : "",
                mbusd.replies_to_broadcasts ? "reply" : "silent", std::to_string(mbusd.connections),
                mbusd.port == 8080 ? "" : std::string(kHttp), mbusd.level});
    if (!notes.empty()) text += "\n# Without a counterpart, or not as it was written:\n";
    for (const std::string& note : notes) text += "# " + note.substr(note.find(": ") + 2) + '\n';
    return text;
}

}  // namespace

std::optional<Imported> import_conf(std::string_view text, yaml::Problems& problems) {
    if (is_foreign(text, problems)) return std::nullopt;
    Reader reader(problems);
    const std::vector<Word> words = command_line(std::string(text));
    for (const Line& line : words.empty() ? lines_of(text, problems) : lines_of(words, problems))
        reader.take(line);
    if (!problems.empty()) return std::nullopt;
    return Imported{yaml_of(reader.mbusd(), reader.notes()), reader.notes()};
}

}  // namespace panelgate::mbusd
