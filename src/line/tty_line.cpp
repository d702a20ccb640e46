#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "descriptor_line.hpp"
#include "driver.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "panelgate/rt/log.hpp"
#include "rs485.hpp"
#include "rts_sender.hpp"
#include "tty_trouble.hpp"

namespace panelgate::line {

/// Notices that something changed where a device should be, so that a plugged-in adapter is opened
/// at once and not at the end of a pause. Only an accelerator: without inotify, or where nothing is
/// told, the pauses do it alone. One thread.
class DeviceWatch {
  public:
    /// `changed` may be called at any time between look() and stop().
    DeviceWatch(const boost::asio::any_io_executor& executor, std::string device,
                std::function<void()> changed);
    ~DeviceWatch();
    DeviceWatch(const DeviceWatch&) = delete;
    DeviceWatch& operator=(const DeviceWatch&) = delete;

    /// Watches the directory of the device, or the nearest one above that exists: by-id folders go
    /// with their last device. Again after each failed attempt; harmless when nothing is new.
    void look();
    /// Nothing more is told until look(). Cheap: closing an inotify descriptor, which the kernel
    /// makes wait for tens of milliseconds at times, is left to the end.
    void stop();

  private:
    bool prepare();
    void remember(int watch);
    void wait();
    void take_all();

    boost::asio::posix::stream_descriptor inotify_;
    std::string device_;
    std::function<void()> changed_;
    std::vector<int> watched_;  ///< one folder after another, the device's own at last
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(false);  ///< between look() and stop()
};

namespace asio = boost::asio;
using boost::system::error_code;

DeviceWatch::DeviceWatch(const asio::any_io_executor& executor, std::string device,
                         std::function<void()> changed)
    : inotify_(executor), device_(std::move(device)), changed_(std::move(changed)) {}

DeviceWatch::~DeviceWatch() { *alive_ = false; }

bool DeviceWatch::prepare() {
    if (inotify_.is_open()) return true;
    const int fd = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (fd < 0) return false;
    error_code error;
    inotify_.assign(fd, error);
    if (error) ::close(fd);
    return !error;
}

void DeviceWatch::look() {
    if (!prepare()) return;
    if (!*alive_) take_all();  // what stop() left behind
    constexpr std::uint32_t kNews = IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF;
    std::filesystem::path folder = std::filesystem::path(device_).parent_path();
    int watch = -1;
    while ((watch = ::inotify_add_watch(inotify_.native_handle(), folder.c_str(),
                                        kNews | IN_ONLYDIR)) < 0) {
        if (folder == folder.parent_path()) return;
        folder = folder.parent_path();
    }
    remember(watch);
    if (*alive_) return;
    alive_ = std::make_shared<bool>(true);
    wait();
}

/// Folders that come and go have a new number each time.
void DeviceWatch::remember(int watch) {
    constexpr std::size_t kMost = 16;
    if (std::ranges::find(watched_, watch) != watched_.end()) return;
    watched_.push_back(watch);
    if (watched_.size() <= kMost) return;
    ::inotify_rm_watch(inotify_.native_handle(), watched_.front());
    watched_.erase(watched_.begin());
}

void DeviceWatch::stop() {
    *alive_ = false;
    if (!inotify_.is_open()) return;
    error_code ignored;
    inotify_.cancel(ignored);
    for (const int watch : std::exchange(watched_, {})) {
        ::inotify_rm_watch(inotify_.native_handle(), watch);
    }
}

void DeviceWatch::wait() {
    inotify_.async_wait(asio::posix::stream_descriptor::wait_read,
                        [this, alive = alive_](error_code error) {
                            if (error || !*alive) return;
                            take_all();
                            changed_();
                            if (*alive) wait();
                        });
}

/// What changed does not matter: the device is tried.
void DeviceWatch::take_all() {
    std::array<char, 4096> events;
    while (::read(inotify_.native_handle(), events.data(), events.size()) > 0) {
    }
}

namespace {

/// What a driver may take longer than the wire: an adapter on a busy USB or one that wakes up.
constexpr Duration kTransferTime = 50ms;

/// For the closing of a device that keeps what it was given although it was told to drop it.
constexpr Duration kCloseWait = 10ms;

class TtyLine final : public DescriptorLine {
  public:
    TtyLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
            const Settings& settings, PortOps& ops)
        : DescriptorLine(executor, clock, settings),
          ops_(ops),
          watch_(executor, settings.device, [this] { open_soon(); }),
          rts_(clock, DescriptorLine::settings(),
               {[this](ByteView bytes) { DescriptorLine::write(bytes); },
                [this](const std::string& why) { lost(why); }},
               ops) {}
    ~TtyLine() override { stop(); }

    void write(ByteView bytes) override;
    bool set_format(const SerialFormat& format) override;
    Duration lead() const override {
        const bool off = settings().rs485.mode == Rs485::Mode::off;
        return off ? Duration::zero() : settings().rs485.delay_before_send;
    }
    std::optional<Duration> unsent() override;
    bool undelivered() override;

  private:
    void begin_open() override;
    void waiting() override { watch_.look(); }
    void cancel_open() override { watch_.stop(); }
    void close_device(bool discard) override;
    bool may_be_back() const override { return true; }
    bool holds_nothing() { return unsent().value_or(Duration::zero()) == Duration::zero(); }
    std::optional<UartErrors> uart_errors() override {
        return is_open() ? errors_.look(fd(), ops_) : errors_.last();
    }
    std::string try_open();
    std::string set_up();
    std::string set_up_sending();
    void warn_once(std::string& last, const std::string& what, const std::string& why);

    PortOps& ops_;
    DeviceWatch watch_;
    RtsSender rts_;
    Driver driver_;
    UartErrorCount errors_;  ///< asked when somebody asks
    std::string last_warning_;
    std::string last_rs485_warning_;
    std::string last_slow_;
    TimePoint gone_by_{};     ///< a driver that still holds something then is stuck
    bool exclusive_ = false;  ///< by us: another program's hold is not ours to lift
};

void TtyLine::begin_open() {
    const std::string error = try_open();
    if (!error.empty()) return open_failed("cannot open " + settings().device + ": " + error);
    watch_.stop();
    opened();
}

/// Empty when the device is ready.
std::string TtyLine::try_open() {
    const std::string& device = settings().device;
    const int access = settings().listen_only ? O_RDONLY : O_RDWR;
    const int opened = ::open(device.c_str(), access | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0) return explain_open_error(device, errno);
    if (std::string error = adopt(opened); !error.empty()) return error;
    if (flock(fd(), LOCK_EX | LOCK_NB) != 0) return holder_of_lock(fd()) + " holds it";
    exclusive_ = ops_.control(fd(), TIOCEXCL, nullptr) >= 0;  // for those who ask for no lock
    return set_up();
}

std::string TtyLine::set_up() {
    const SetUp result = set_up_tty(fd(), settings().serial, ops_);
    if (!result.error.empty()) return result.error;
    if (!settings().simulated) warn_once(last_warning_, "device settings differ", result.warning);
    driver_ = look_at_driver(fd(), ops_);
    gone_by_ = clock().now() + kTransferTime;
    errors_.opened(fd(), ops_);
    warn_once(last_slow_, "slow adapter", ask_low_latency(fd(), settings().device, ops_));
    return set_up_sending();
}

std::string TtyLine::set_up_sending() {
    switch (settings().rs485.mode) {
        case Rs485::Mode::off:
            return {};
        case Rs485::Mode::kernel: {
            const SetUp result = set_up_rs485(fd(), settings().rs485, ops_);
            warn_once(last_rs485_warning_, "device settings differ", result.warning);
            return result.error;
        }
        case Rs485::Mode::rts:
            return rts_.opened(fd(), driver_);
    }
    std::abort();
}

/// Once a device, not at each of its openings.
void TtyLine::warn_once(std::string& last, const std::string& what, const std::string& why) {
    if (!why.empty() && why != last) {
        rt::log(rt::LogLevel::warn, what, {{"device", settings().device}, {"why", why}});
    }
    last = why;
}

void TtyLine::close_device(bool discard) {
    rts_.closing();
    if (std::exchange(exclusive_, false)) ops_.control(fd(), TIOCNXCL, nullptr);
    std::optional<Impatience> impatience;
    if (discard) {
        drop_unsent(fd(), ops_);
        if (!holds_nothing()) impatience.emplace(kCloseWait);
        // Nothing follows: whoever else is on the line must not find it held.
        if (settings().rs485.mode == Rs485::Mode::rts)
            switch_rts(fd(), settings().rs485, false, ops_);
    }
    DescriptorLine::close_device(discard);
}

void TtyLine::write(ByteView bytes) {
    if (!is_open() || settings().listen_only) return;
    if (holds_nothing()) {
        gone_by_ =
            clock().now() + lead() + wire_time(settings().serial, bytes.size()) + kTransferTime;
    }
    if (settings().rs485.mode == Rs485::Mode::rts) return rts_.write(bytes);
    DescriptorLine::write(bytes);
}

bool TtyLine::undelivered() {
    if (!is_open()) return false;
    if (DescriptorLine::undelivered()) return true;
    return clock().now() >= gone_by_ && !holds_nothing();
}

bool TtyLine::set_format(const SerialFormat& format) {
    if (!is_open()) return false;
    const SetUp result = set_up_tty(fd(), format, ops_);
    if (!result.error.empty()) {
        lost(result.error);
        return false;
    }
    remember(format);
    return true;
}

std::optional<Duration> TtyLine::unsent() {
    if (!is_open() || !driver_.tells_queue) return std::nullopt;
    return unsent_time(fd(), driver_, character_time(settings().serial), ops_);
}

}  // namespace

std::unique_ptr<Line> make_tty_line(boost::asio::any_io_executor executor, rt::Clock& clock,
                                    Settings settings, PortOps& ops) {
    return std::make_unique<TtyLine>(executor, clock, settings, ops);
}

}  // namespace panelgate::line
