#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
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

/// Watches for changes where a device should be, so that a plugged-in adapter is opened at once and
/// not after a pause. Only an accelerator: without inotify or its events the pauses suffice.
/// Single-threaded.
class DeviceWatch {
  public:
    /// `changed` may be called at any time between look() and stop().
    DeviceWatch(const boost::asio::any_io_executor& executor, std::string device,
                std::function<void()> changed);
    ~DeviceWatch();
    DeviceWatch(const DeviceWatch&) = delete;
    DeviceWatch& operator=(const DeviceWatch&) = delete;

    /// Watches the device's directory, or the nearest existing parent: by-id folders vanish with
    /// their last device. Called again after each failed attempt; harmless if nothing is new.
    void look();
    /// Stops notifications until look(). Cheap: the inotify descriptor stays open.
    void stop();
    /// The same, and gives the descriptor back.
    void end();

  private:
    bool prepare();
    void remember(int watch);
    void wait();
    void take_all();

    boost::asio::posix::stream_descriptor inotify_;
    std::string device_;
    std::function<void()> changed_;
    std::vector<int> watched_;  ///< parents first, the device's folder last
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
    constexpr std::uint32_t kWatchedEvents = IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_DELETE_SELF;
    std::filesystem::path folder = std::filesystem::path(device_).parent_path();
    int watch = -1;
    while ((watch = ::inotify_add_watch(inotify_.native_handle(), folder.c_str(),
                                        kWatchedEvents | IN_ONLYDIR)) < 0) {
        if (folder == folder.parent_path()) return;
        folder = folder.parent_path();
    }
    remember(watch);
    if (*alive_) return;
    alive_ = std::make_shared<bool>(true);
    wait();
}

/// A recreated folder has a new watch number; the oldest are removed.
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

/// Closing can block for tens of milliseconds, so a thread does it.
void DeviceWatch::end() {
    stop();
    if (!inotify_.is_open()) return;
    const int descriptor = inotify_.release();
    try {
        std::thread([descriptor] { ::close(descriptor); }).detach();
    } catch (const std::system_error&) {
        ::close(descriptor);
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

/// Drains the events: what changed does not matter, the device is tried.
void DeviceWatch::take_all() {
    std::array<char, 4096> events;
    while (::read(inotify_.native_handle(), events.data(), events.size()) > 0) {
    }
}

namespace {

/// Time a driver may take beyond the wire: an adapter on a busy USB, or one that wakes up.
constexpr Duration kTransferTime = 50ms;

/// Limit for closing a device that keeps bytes it was to drop.
constexpr Duration kCloseWait = 10ms;

/// Enters an open serial device in the list of this process, for as long as the object lives: two
/// links may lead to one adapter (solax-modbus#1171). One thread drives all lines.
class OpenDevice {
  public:
    OpenDevice(int fd, const Settings& settings) {
        struct stat status{};
        if (::fstat(fd, &status) != 0 || !S_ISCHR(status.st_mode)) return;
        number_ = status.st_rdev;
        all()[*number_] = (settings.owner.empty() ? "another line" : settings.owner) +
                          " of this gateway holds it, as " + settings.device;
    }
    ~OpenDevice() {
        if (number_) all().erase(*number_);
    }
    OpenDevice(const OpenDevice&) = delete;
    OpenDevice& operator=(const OpenDevice&) = delete;

    /// Returns who of this process holds the device at this path, a clause; "" nobody.
    static std::string holder_of(const std::string& path) {
        struct stat status{};
        if (::stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return {};
        const auto found = all().find(status.st_rdev);
        return found == all().end() ? "" : found->second;
    }

  private:
    static std::map<dev_t, std::string>& all() {
        static std::map<dev_t, std::string> devices;
        return devices;
    }

    std::optional<dev_t> number_;
};

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
    void cancel_open() override { watch_.end(); }
    void close_device(bool discard) override;
    bool may_have_returned() const override { return true; }
    bool is_drained() { return unsent().value_or(Duration::zero()) == Duration::zero(); }
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
    UartErrorCount errors_;  ///< read on demand
    std::string last_warning_;
    std::string last_rs485_warning_;
    std::string last_latency_warning_;
    TimePoint drain_deadline_{};  ///< a driver with unsent bytes after this is stuck
    std::optional<OpenDevice> entry_;
    bool exclusive_ = false;  ///< set by us: another program's lock must stay
};

void TtyLine::begin_open() {
    const std::string error = try_open();
    if (!error.empty()) return open_failed("cannot open " + settings().device + ": " + error);
    watch_.stop();
    opened();
}

/// Returns an empty text if the device is ready.
std::string TtyLine::try_open() {
    const std::string& device = settings().device;
    if (std::string holder = OpenDevice::holder_of(device); !holder.empty()) return holder;
    const int access = settings().listen_only ? O_RDONLY : O_RDWR;
    const int opened = ::open(device.c_str(), access | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0) return explain_open_error(device, errno);
    if (std::string error = adopt(opened); !error.empty()) return error;
    if (flock(fd(), LOCK_EX | LOCK_NB) != 0) return holder_of_lock(fd()) + " holds it";
    entry_.emplace(fd(), settings());
    exclusive_ = ops_.control(fd(), TIOCEXCL, nullptr) >= 0;  // against programs without flock()
    return set_up();
}

std::string TtyLine::set_up() {
    const SetUp result = set_up_tty(fd(), settings().serial, ops_);
    if (!result.error.empty()) return result.error;
    if (!settings().simulated) warn_once(last_warning_, "device settings differ", result.warning);
    driver_ = look_at_driver(fd(), ops_);
    drain_deadline_ = clock().now() + kTransferTime;
    errors_.opened(fd(), ops_);
    warn_once(last_latency_warning_, "slow adapter",
              ask_low_latency(fd(), settings().device, ops_));
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

/// Warns once per device, not at each opening.
void TtyLine::warn_once(std::string& last, const std::string& what, const std::string& why) {
    if (!why.empty() && why != last) {
        rt::log(rt::LogLevel::warn, what, {{"device", settings().device}, {"why", why}});
    }
    last = why;
}

void TtyLine::close_device(bool discard) {
    rts_.closing();
    entry_.reset();
    if (std::exchange(exclusive_, false)) ops_.control(fd(), TIOCNXCL, nullptr);
    std::optional<CallInterrupter> interrupter;
    if (discard) {
        drop_unsent(fd(), ops_);
        if (!is_drained()) interrupter.emplace(kCloseWait);
        // Nothing follows: release the bus for the other stations.
        if (settings().rs485.mode == Rs485::Mode::rts)
            switch_rts(fd(), settings().rs485, false, ops_);
    }
    DescriptorLine::close_device(discard);
}

void TtyLine::write(ByteView bytes) {
    if (!is_open() || settings().listen_only) return;
    if (is_drained()) {
        drain_deadline_ =
            clock().now() + lead() + wire_time(settings().serial, bytes.size()) + kTransferTime;
    }
    if (settings().rs485.mode == Rs485::Mode::rts) return rts_.write(bytes);
    DescriptorLine::write(bytes);
}

bool TtyLine::undelivered() {
    if (!is_open()) return false;
    if (DescriptorLine::undelivered()) return true;
    return clock().now() >= drain_deadline_ && !is_drained();
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
