#include "starter.hpp"

#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "adapters.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/scan/scanner.hpp"

namespace panelgate::commands {

/// Drives a Scanner over a line until it is done, the line fails or a signal comes. Shows the
/// progress on stderr: on a terminal as it is, elsewhere a line every 5 s.
class ScanRun final : public line::Line::Events {
  public:
    /// `settings` and `profiles` outlive it.
    ScanRun(boost::asio::io_context& io, const scan::Settings& settings,
            const profile::Catalogue& profiles, const line::Settings& device);

    void run();
    /// Why it ended early; empty when it did not.
    const std::string& cut_short() const { return cut_short_; }
    /// The line came up.
    bool has_begun() const { return scanner_ != nullptr; }
    scan::Result result() const { return scanner_->result(); }

    void on_up() override;
    void on_down(const std::string& why) override { end(why); }
    void on_bytes(ByteView bytes) override;

    // Host of the scanner's drive
    void act(const scan::SetFormat& set) { line_->set_format(set.format); }
    void act(const scan::Transmit& transmit) { line_->write(scan::on_wire(transmit)); }
    void on_deadline(TimePoint now);
    void settled(TimePoint now);

  private:
    void name_panels();
    void end(const std::string& why);
    void redraw();
    void tell();
    std::string progress(std::size_t width) const { return scanner_->progress().substr(0, width); }

    boost::asio::io_context& io_;
    const scan::Settings& settings_;
    const profile::Catalogue& profiles_;
    rt::AsioClock clock_;
    std::unique_ptr<line::Line> line_;
    std::unique_ptr<scan::Scanner> scanner_;  ///< since the line is up
    std::optional<line::Drive<scan::Scanner, ScanRun>> drive_;
    std::unique_ptr<rt::Alarm> redraw_;
    std::size_t named_ = 0;  ///< panels that were told of
    boost::asio::signal_set signals_;
    std::string cut_short_;
};

namespace {

constexpr const char* kClear = "\x1b[K";  // erases to the end of the line

/// The progress line is redrawn, which needs a terminal.
bool shows_progress() {
    static const bool shown = ::isatty(STDERR_FILENO) == 1;
    return shown;
}

std::size_t width() {
    constexpr std::size_t kUsual = 80;
    winsize size{};
    const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
    return known ? size.ws_col : kUsual;
}

}  // namespace

ScanRun::ScanRun(boost::asio::io_context& io, const scan::Settings& settings,
                 const profile::Catalogue& profiles, const line::Settings& device)
    : io_(io),
      settings_(settings),
      profiles_(profiles),
      clock_(io.get_executor()),
      line_(settings.remote ? line::make_tcp_line(io.get_executor(), clock_, device)
                            : line::make_tty_line(io.get_executor(), clock_, device)),
      redraw_(clock_.make_alarm()),
      signals_(io, SIGINT, SIGTERM) {}

void ScanRun::run() {
    signals_.async_wait([this](boost::system::error_code error, int) {
        if (!error) end("interrupted");
    });
    line_->start(*this);
    io_.run();
    line_->stop();
    if (shows_progress()) std::cerr << '\r' << kClear << std::flush;
}

void ScanRun::end(const std::string& why) {
    cut_short_ = why;
    io_.stop();
}

void ScanRun::on_up() {
    scanner_ = std::make_unique<scan::Scanner>(profiles_, settings_, clock_.now());
    drive_.emplace(clock_, *line_, *scanner_, *this);
    shows_progress() ? redraw() : tell();
    drive_->hear([](TimePoint) {});
}

void ScanRun::on_bytes(ByteView bytes) {
    if (!drive_) return;
    drive_->hear([this, bytes](TimePoint now) { scanner_->on_rx(now, bytes); });
}

void ScanRun::on_deadline(TimePoint now) {
    scanner_->set_latency(line_->latency());
    scanner_->on_deadline(now);
}

/// Tells of each panel as soon as it is known.
void ScanRun::name_panels() {
    const auto& panels = scanner_->examined();
    for (; named_ < panels.size(); ++named_) {
        const std::string found = "panelgate: found " + scan::found_text(panels[named_]);
        if (!shows_progress()) {
            std::cerr << found << '\n';
            continue;
        }
        std::cerr << '\r' << found.substr(0, width() - 1) << kClear << "\r\n"
                  << progress(width() - 1) << kClear << std::flush;
    }
}

void ScanRun::settled(TimePoint) {
    name_panels();
    if (scanner_->done()) io_.stop();
}

void ScanRun::redraw() {
    constexpr Duration kPause = 200ms;
    std::cerr << '\r' << progress(width() - 1) << kClear << std::flush;
    redraw_->arm(clock_.now() + kPause, [this] { redraw(); });
}

/// The same for a pipe: a line now and then.
void ScanRun::tell() {
    constexpr Duration kPause = 5s;
    constexpr std::size_t kWidth = 120;
    redraw_->arm(clock_.now() + kPause, [this] {
        std::cerr << "panelgate: " << trimmed(progress(kWidth)) << '\n' << std::flush;
        tell();
    });
}

namespace {

bool is_modbus_tcp(const std::string& device) { return device.starts_with("modbus-tcp://"); }

/// The settings from the command line; nothing, with a message on stderr, if they are wrong.
std::optional<scan::Settings> parse_options(const ScanOptions& options) {
    scan::Settings settings;
    settings.remote = options.device.starts_with("tcp://") || is_modbus_tcp(options.device);
    settings.speak_anyway = options.speak;
    settings.quick = options.quick;
    std::optional<std::string> wrong;
    if (settings.remote && !line::parse_tcp_device(options.device)) {
        wrong =
            "DEVICE must be tcp://HOST:PORT or modbus-tcp://HOST:PORT, with a port from 1 to "
            "65535, not '" +
            options.device + '\'';
    } else if (options.device.empty() || options.device == "sim") {
        wrong =
            "DEVICE must be a serial device such as /dev/ttyUSB0, tcp://HOST:PORT, or "
            "modbus-tcp://HOST:PORT";
    } else if (settings.remote && !(options.baud.empty() && options.parity.empty())) {
        wrong =
            "--baud and --parity are the far end's own on a tcp:// or modbus-tcp:// device: leave "
            "them out";
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

/// False, with a message on stderr, if the line could not be opened.
bool run_scan(const ScanOptions& options, const scan::Settings& settings, ScanOutcome& outcome) {
    line::Settings device;
    device.device = options.device;
    device.modbus_tcp = device.as_rtu = is_modbus_tcp(options.device);
    boost::asio::io_context io(1);
    ScanRun run(io, settings, *outcome.profiles, device);
    run.run();
    outcome.cut_short = run.cut_short();
    if (run.has_begun()) {
        outcome.result = run.result();
        return true;
    }
    std::cerr << "panelgate: " << run.cut_short() << '\n';
    std::error_code none;
    if (!settings.remote && !std::filesystem::exists(options.device, none))
        std::cerr << adapters_text(adapters("/dev"));
    return false;
}

}  // namespace

ScanOutcome search(const ScanOptions& options) {
    ScanOutcome outcome;
    outcome.code = kUsage;
    const auto settings = parse_options(options);
    if (!settings) return outcome;
    outcome.code = kBadConfig;
    outcome.profiles = explain::load_catalogue(options.profiles);
    if (!outcome.profiles) return outcome;
    rt::LogSettings quiet;
    quiet.level = rt::LogLevel::error;  // the result is the output
    rt::set_up_log(quiet);
    outcome.device = settings->remote ? options.device : absolute(options.device);
    outcome.profiles_dir = absolute(options.profiles);
    outcome.code = kUnavailable;
    if (!run_scan(options, *settings, outcome)) return outcome;
    const bool complete = outcome.cut_short.empty() && scan::found_any(*outcome.result);
    if (complete) outcome.code = kFine;
    return outcome;
}

void print_advice(const ScanOptions& options, const scan::Result& result) {
    for (const std::string& sentence : scan::advice(options.device, result))
        std::cerr << "panelgate: " << sentence << '\n';
    if (options.quick && result.ending == scan::Result::Ending::finished)
        std::cerr << "panelgate: --quick has asked each address once: where a panel is missing, "
                     "scan without it\n";
}

namespace {

constexpr std::size_t kMostExamples = 4;

/// In double quotes, with '$' escaped.
std::string quoted(const std::string& text) {
    std::string made = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') made += '\\';
        made += c;
        if (c == '$') made += c;
    }
    return made + '"';
}

/// A point name made from a notation: "at-gdt0" for GDT0.
std::string name_of(std::string_view notation) {
    std::string name = "at-";
    for (const char c : notation) {
        const char small = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        const bool plain = (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9');
        name += plain ? small : '-';
    }
    return name;
}

bool is_clock(const profile::PanelProfile& profile, const profile::Area& area) {
    using MotionKind = profile::Simulation::Motion::Kind;
    return std::ranges::any_of(profile.simulation.motion, [&](const auto& motion) {
        return motion.kind == MotionKind::clock && motion.area == area.name;
    });
}

/// One example line; "" if nothing in the area is readable.
std::string example_of(const profile::PanelProfile& profile, const profile::Area& area) {
    const bool bits = modbus::is_bit_table(area.table);
    const auto first = static_cast<std::uint16_t>(
        area.writable ? std::max(area.writable->first, area.readable.first) : area.readable.first);
    if (!area.readable.contains(first)) return "";
    const std::string at = profile::format_notation(area, first);
    const bool measures = !bits && !is_clock(profile, area);
    std::string text = "{name: " + name_of(at) + ", at: " + quoted(at);
    text += measures ? ", type: i16, scale: 0.1, unit: celsius" : "";
    return "        #   - " + text + ", every: 1s}   # " + area.description + '\n';
}

std::string examples_of(const profile::PanelProfile& profile) {
    std::string text = "        # points:   # values by name, for REST, events and /metrics\n";
    std::size_t count = 0;
    for (const profile::Area& area : profile.areas) {
        const std::string example = count < kMostExamples ? example_of(profile, area) : "";
        if (!example.empty()) ++count;
        text += example;
    }
    return text;
}

std::string station_of(const scan::StationFinding& finding, const profile::Catalogue& profiles) {
    const std::string id = std::to_string(finding.station);
    const bool read = finding.evidence.good > 0;
    const auto& candidates = finding.candidates;
    const std::string profile = candidates.empty() ? "generic" : candidates.front().profile;
    std::string text = "      # " + id + ": " + scan::evidence_text(finding) + '\n';
    if (finding.duplicate)
        text += "      # Two panels seem to have this address: give one of them another.\n";
    if (!read) return text + "      # - {id: " + id + "}   # answers, and nothing was readable\n";
    text += "      - id: " + id + "\n        name: station-" + id +
            "   # as you call it: a-z, 0-9 and '-'\n        profile: " + profile;
    if (candidates.size() > 1) text += "   # or";
    for (std::size_t i = 1; i < candidates.size(); ++i) text += ' ' + candidates[i].profile;
    text += "\n        access: read_write   # or read_only\n";
    if (finding.evidence.late > 0)
        text +=
            "        timing: {response_timeout: 2s}   # it answered late: 500 ms are too short\n";
    if (finding.crc_order == modbus::CrcOrder::high_first)
        text += "        crc_order: high_first   # of the panel's firmware\n";
    const profile::PanelProfile* known = profiles.find(profile);
    return text + (known != nullptr ? examples_of(*known) : "");
}

constexpr std::string_view kServers =
    R"(
# For SCADA systems and other Modbus/TCP clients: unit id = address of the panel. Other machines reach
# it with listen: 0.0.0.0:502 and a list of who may.
modbus_tcp:
  - listen: 127.0.0.1:1502
    # allow: [192.168.10.0/24]

# A dashboard at http://127.0.0.1:8080/, REST, and /metrics for Prometheus. Everybody who reaches it
# may read; who may write has a token (or anonymous: operator, on a desk).
http:
  listen: 127.0.0.1:8080
  anonymous: viewer
  # tokens: [{name: ops, role: operator, file: /run/secrets/ops}]

log: {level: info}
)";

}  // namespace

std::string starter_yaml(const Found& found) {
    std::string text =
        "# Written by panelgate init. `panelgate check -c FILE` says what a change means and what\n"
        "# is wrong with it, `panelgate run -c FILE` runs it; config/panelgate.example.yaml has "
        "every\n"
        "# key, `panelgate profiles NAME` what a panel has.\n";
    if (found.result.ending == scan::Result::Ending::running)
        text += "# Incomplete: the scan was interrupted.\n";
    if (!found.profiles_dir.empty()) text += "profiles_dir: " + quoted(found.profiles_dir) + '\n';
    text +=
        "lines:\n  - name: line1\n    device: " + quoted(found.device) + '\n' +
        scan::serial_yaml(found.device, found.result) +
        "    timing: {response_timeout: 500ms}   # a panel that is silent for longer has failed\n"
        "    stations:\n";
    for (const scan::StationFinding& finding : found.result.stations)
        text += station_of(finding, found.profiles);
    return text + std::string(kServers);
}

}  // namespace panelgate::commands
