#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <utility>

#include "descriptor_line.hpp"
#include "device_watch.hpp"
#include "open_error.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::line {
namespace {

class TtyLine final : public DescriptorLine {
  public:
    TtyLine(const boost::asio::any_io_executor& executor, Settings settings)
        : DescriptorLine(executor, settings),
          watch_(executor, settings.device, [this] { open_soon(); }) {}
    ~TtyLine() override { stop(); }

  private:
    void begin_open() override {
        const std::string error = try_open();
        if (error.empty()) {
            watch_.stop();
            opened();
        } else {
            open_failed(error);
        }
    }
    void waiting() override { watch_.look(); }
    void cancel_open() override { watch_.stop(); }
    void before_close() override { ::ioctl(fd(), TIOCNXCL); }
    std::string try_open();

    DeviceWatch watch_;
    std::string last_warning_;
};

/// Empty when the device is ready.
std::string TtyLine::try_open() {
    const std::string& device = settings().device;
    const std::string cannot = "cannot open " + device + ": ";
    const int opened = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0) return cannot + explain_open_error(device, errno);
    if (const std::string error = adopt(opened); !error.empty()) return cannot + error;
    if (flock(fd(), LOCK_EX | LOCK_NB) != 0) return cannot + holder_of_lock(fd()) + " holds it";
    ::ioctl(fd(), TIOCEXCL);  // for programs that do not ask for the lock
    const SetUp result = set_up_tty(fd(), settings().serial);
    if (!result.error.empty()) return cannot + result.error;
    if (!result.warning.empty() && result.warning != last_warning_) {
        rt::log(rt::LogLevel::warn, "device settings differ",
                {{"device", device}, {"why", result.warning}});
    }
    last_warning_ = result.warning;
    return {};
}

}  // namespace

std::unique_ptr<Line> make_tty_line(boost::asio::any_io_executor executor, Settings settings) {
    return std::make_unique<TtyLine>(executor, std::move(settings));
}

}  // namespace panelgate::line
