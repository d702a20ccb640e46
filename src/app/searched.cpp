#include "searched.hpp"

#include <sys/ioctl.h>
#include <unistd.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "load.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/scan/scanner.hpp"

namespace panelgate::app {

/// Drives a Scanner over a line until it is done, the line fails or a signal comes. Shows the
/// progress on stderr if that is a terminal.
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
    void end(const std::string& why);
    void redraw();

    boost::asio::io_context& io_;
    const scan::Settings& settings_;
    const profile::Catalogue& profiles_;
    rt::AsioClock clock_;
    std::unique_ptr<line::Line> line_;
    std::unique_ptr<scan::Scanner> scanner_;  ///< since the line is up
    std::optional<line::Drive<scan::Scanner, ScanRun>> drive_;
    std::unique_ptr<rt::Alarm> redraw_;
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
    if (shows_progress()) redraw();
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

void ScanRun::settled(TimePoint) {
    if (scanner_->done()) io_.stop();
}

void ScanRun::redraw() {
    constexpr Duration kPause = 200ms;
    std::cerr << '\r' << scan::format_progress(scanner_->progress(clock_.now()), width() - 1)
              << kClear << std::flush;
    redraw_->arm(clock_.now() + kPause, [this] { redraw(); });
}

namespace {

/// The settings from the command line; nothing, with a message on stderr, if they are wrong.
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

/// False, with a message on stderr, if the line could not be opened.
bool run_scan(const ScanOptions& options, const scan::Settings& settings, ScanOutcome& outcome) {
    line::Settings device;
    device.device = options.device;
    boost::asio::io_context io(1);
    ScanRun run(io, settings, *outcome.profiles, device);
    run.run();
    outcome.cut_short = run.cut_short();
    if (run.has_begun()) {
        outcome.result = run.result();
        return true;
    }
    std::cerr << "panelgate: " << run.cut_short() << '\n';
    return false;
}

}  // namespace

ScanOutcome search(const ScanOptions& options) {
    ScanOutcome outcome;
    outcome.code = kUsage;
    const auto settings = parse_options(options);
    if (!settings) return outcome;
    outcome.code = kBadConfig;
    outcome.profiles = load_catalogue(options.profiles);
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
}

}  // namespace panelgate::app
