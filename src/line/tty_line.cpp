#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "panelgate/line/reopen.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::line {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

class TtyLine final : public Line {
  public:
    TtyLine(const asio::any_io_executor& executor, Settings settings)
        : settings_(std::move(settings)),
          descriptor_(executor),
          timer_(executor),
          reopen_(settings_.reopen_min, settings_.reopen_max) {}
    ~TtyLine() override { stop(); }

    void start(Events& events) override {
        events_ = &events;
        alive_ = std::make_shared<bool>(true);
        open();
    }

    void stop() override {
        if (alive_) *alive_ = false;
        events_ = nullptr;
        timer_.cancel();
        close();
    }

    void poll_input() override {
        if (descriptor_.is_open()) read_all();
    }

    void write(ByteView bytes) override;
    const Counters& counters() const override { return counters_; }

  private:
    void open();
    std::string try_open();
    void opened();
    void lost(const std::string& why);
    void retry_later();
    void close();
    void wait_readable();
    void read_all();
    void flush();

    Settings settings_;
    asio::posix::stream_descriptor descriptor_;
    asio::steady_timer timer_;
    Reopen reopen_;
    Events* events_ = nullptr;
    std::shared_ptr<bool> alive_;  ///< completions outlive the line; they ask here first
    Counters counters_;
    Bytes unsent_;                ///< what the driver did not take at once; at most one frame
    std::uint64_t openings_ = 0;  ///< a completion of an earlier one is stale
    std::string last_error_;
    std::string last_warning_;
};

void TtyLine::open() {
    const std::string error = try_open();
    if (error.empty()) {
        opened();
        return;
    }
    close();
    if (error != last_error_) events_->on_down(error);
    last_error_ = error;
    if (events_ != nullptr) retry_later();
}

/// Empty when the device is ready.
std::string TtyLine::try_open() {
    const std::string cannot = "cannot open " + settings_.device + ": ";
    const int fd = ::open(settings_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return cannot + std::strerror(errno);
    error_code error;
    descriptor_.assign(fd, error);
    if (error) {
        ::close(fd);
        return cannot + error.message();
    }
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) return cannot + "another program holds it";
    const SetUp result = set_up_tty(fd, settings_.serial);
    if (!result.error.empty()) return cannot + result.error;
    if (!result.warning.empty() && result.warning != last_warning_) {
        rt::log(rt::LogLevel::warn, "device settings differ",
                {{"device", settings_.device}, {"why", result.warning}});
    }
    last_warning_ = result.warning;
    return {};
}

void TtyLine::opened() {
    if (openings_++ > 0) ++counters_.reopens;
    last_error_.clear();
    reopen_.succeeded();
    wait_readable();
    events_->on_up();
}

void TtyLine::lost(const std::string& why) {
    close();
    last_error_ = settings_.device + " is gone: " + why;
    if (events_ != nullptr) events_->on_down(last_error_);
    if (events_ != nullptr) retry_later();
}

void TtyLine::retry_later() {
    timer_.expires_after(reopen_.next_pause());
    timer_.async_wait([this, alive = alive_](error_code error) {
        if (!error && *alive) open();
    });
}

void TtyLine::close() {
    unsent_.clear();
    error_code ignored;  // close() itself may fail on an unplugged device
    descriptor_.close(ignored);
}

void TtyLine::wait_readable() {
    descriptor_.async_wait(asio::posix::stream_descriptor::wait_read,
                           [this, alive = alive_, opening = openings_](error_code error) {
                               const auto current = [&] {
                                   return *alive && opening == openings_ && descriptor_.is_open();
                               };
                               if (error == asio::error::operation_aborted || !current()) return;
                               read_all();
                               if (current()) wait_readable();
                           });
}

void TtyLine::read_all() {
    std::array<std::uint8_t, 1024> buffer;
    constexpr int kMaxReads = 16;  // a babbling line must not keep the loop from the others
    for (int i = 0; i < kMaxReads; ++i) {
        const ssize_t n = ::read(descriptor_.native_handle(), buffer.data(), buffer.size());
        if (n > 0) {
            counters_.bytes_received += static_cast<std::uint64_t>(n);
            events_->on_bytes(ByteView(buffer).first(static_cast<std::size_t>(n)));
            if (events_ == nullptr || !descriptor_.is_open()) return;
            if (static_cast<std::size_t>(n) < buffer.size()) return;
            continue;
        }
        if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
        lost(n == 0 ? "hang-up" : std::strerror(errno));
        return;
    }
}

void TtyLine::write(ByteView bytes) {
    if (!descriptor_.is_open()) return;
    counters_.bytes_sent += bytes.size();
    unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
    flush();
}

void TtyLine::flush() {
    while (!unsent_.empty()) {
        const ssize_t n = ::write(descriptor_.native_handle(), unsent_.data(), unsent_.size());
        if (n > 0) {
            unsent_.erase(unsent_.begin(), unsent_.begin() + n);
            continue;
        }
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 && errno == EAGAIN) break;
        lost(n == 0 ? "hang-up" : std::strerror(errno));
        return;
    }
    if (unsent_.empty()) return;
    descriptor_.async_wait(
        asio::posix::stream_descriptor::wait_write,
        [this, alive = alive_, opening = openings_](error_code error) {
            if (!error && *alive && opening == openings_ && descriptor_.is_open()) flush();
        });
}

}  // namespace

std::unique_ptr<Line> make_tty_line(boost::asio::any_io_executor executor, Settings settings) {
    return std::make_unique<TtyLine>(executor, std::move(settings));
}

}  // namespace panelgate::line
