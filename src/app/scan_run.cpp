#include "scan_run.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

#include "panelgate/line/tcp_line.hpp"
#include "panelgate/line/tty_line.hpp"

namespace panelgate::app {
namespace {

constexpr const char* kClear = "\x1b[K";  // to the end of the line

/// A line that is drawn again and again is for a terminal.
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

}  // namespace panelgate::app
