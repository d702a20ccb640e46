#include <sys/ioctl.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "commands.hpp"
#include "panelgate/config/profiles_dir.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/scan/scanner.hpp"

namespace panelgate::app {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// One line on stderr that is drawn again and again, when stderr is a terminal; else nothing.
class ProgressLine {
  public:
    bool is_shown() const { return shown_; }
    void draw(const scan::Progress& progress) const {
        std::cerr << '\r' << scan::format_progress(progress, width() - 1) << kClear << std::flush;
    }
    void clear() const {
        if (shown_) std::cerr << '\r' << kClear << std::flush;
    }

  private:
    static constexpr const char* kClear = "\x1b[K";  // to the end of the line
    static std::size_t width() {
        constexpr std::size_t kUsual = 80;
        winsize size{};
        const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
        return known ? size.ws_col : kUsual;
    }
    bool shown_ = ::isatty(STDERR_FILENO) == 1;
};

/// Drives a Scanner over a line until it is done, the line fails or a signal comes.
class ScanRun final : public line::Line::Events {
  public:
    /// `settings` and `profiles` outlive it.
    ScanRun(asio::io_context& io, const scan::Settings& settings,
            const profile::Catalogue& profiles, const line::Settings& device)
        : io_(io),
          settings_(settings),
          profiles_(profiles),
          line_(settings.remote ? line::make_tcp_line(io.get_executor(), device)
                                : line::make_tty_line(io.get_executor(), device)),
          alarm_(io),
          redraw_(io),
          signals_(io, SIGINT, SIGTERM) {}

    void run() {
        signals_.async_wait([this](error_code error, int) {
            if (!error) end("interrupted");
        });
        line_->start(*this);
        io_.run();
        line_->stop();
        progress_.clear();
    }
    /// Why it ended early; empty when it did not.
    const std::string& cut_short() const { return cut_short_; }
    /// The line never came up.
    bool has_begun() const { return scanner_ != nullptr; }
    scan::Result result() const { return scanner_->result(); }

    void on_up() override {
        scanner_ = std::make_unique<scan::Scanner>(profiles_, settings_, rt::now());
        if (progress_.is_shown()) redraw();
        pump();
    }
    void on_down(const std::string& why) override { end(why); }
    void on_bytes(ByteView bytes) override {
        if (!scanner_) return;
        scanner_->on_rx(rt::now(), bytes);
        pump();
    }

  private:
    void end(const std::string& why) {
        cut_short_ = why;
        io_.stop();
    }
    void act(const scan::SetFormat& set) { line_->set_format(set.format); }
    void act(const scan::Transmit& transmit) { line_->write(transmit.request.adu()); }
    void pump() {
        if (pumping_) return;
        pumping_ = true;
        while (const auto action = scanner_->poll_action())
            std::visit([this](const auto& a) { act(a); }, *action);
        pumping_ = false;
        if (scanner_->done()) return io_.stop();
        arm();
    }
    void arm() {
        const auto next = scanner_->next_deadline();
        if (!next) return;
        alarm_.expires_at(*next);
        alarm_.async_wait([this](error_code error) {
            if (error) return;
            line_->poll_input();  // what has arrived by now came before whatever is due now
            scanner_->set_latency(line_->latency());
            scanner_->on_deadline(rt::now());
            pump();
        });
    }
    void redraw() {
        constexpr Duration kPause = 200ms;
        progress_.draw(scanner_->progress(rt::now()));
        redraw_.expires_after(kPause);
        redraw_.async_wait([this](error_code error) {
            if (!error) redraw();
        });
    }

    asio::io_context& io_;
    const scan::Settings& settings_;
    const profile::Catalogue& profiles_;
    std::unique_ptr<line::Line> line_;
    std::unique_ptr<scan::Scanner> scanner_;  ///< since the line is up
    ProgressLine progress_;
    asio::steady_timer alarm_;
    asio::steady_timer redraw_;
    asio::signal_set signals_;
    std::string cut_short_;
    bool pumping_ = false;
};

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

/// The shipped profiles and those of --profiles; false (and told) when something is wrong there.
bool load_profiles(const std::string& dir, profile::Catalogue& catalogue) {
    if (dir.empty()) return true;
    yaml::Problems problems(dir);
    const auto faults = config::add_profiles(dir, config::RealFiles(), catalogue, problems);
    for (const std::string& fault : faults) std::cerr << "panelgate: --profiles: " << fault << '\n';
    std::cerr << problems.text();
    return faults.empty() && problems.empty();
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
    profile::Catalogue profiles = profile::Catalogue::shipped();
    if (!load_profiles(options.profiles, profiles)) return kBadConfig;
    rt::LogSettings quiet;
    quiet.level = rt::LogLevel::error;  // the result is what there is to say
    rt::set_up_log(quiet);
    line::Settings device;
    device.device = options.device;
    asio::io_context io(1);
    ScanRun run(io, *settings, profiles, device);
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
