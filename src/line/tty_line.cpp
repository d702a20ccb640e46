#include "panelgate/line/tty_line.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "descriptor_line.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::line {
namespace {

class TtyLine final : public DescriptorLine {
  public:
    using DescriptorLine::DescriptorLine;
    ~TtyLine() override { stop(); }

  private:
    void begin_open() override {
        const std::string error = try_open();
        if (error.empty()) {
            opened();
        } else {
            open_failed(error);
        }
    }
    std::string try_open();

    std::string last_warning_;
};

/// Empty when the device is ready.
std::string TtyLine::try_open() {
    const std::string& device = settings().device;
    const std::string cannot = "cannot open " + device + ": ";
    const int opened = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (opened < 0) return cannot + std::strerror(errno);
    if (const std::string error = adopt(opened); !error.empty()) return cannot + error;
    if (flock(fd(), LOCK_EX | LOCK_NB) != 0) return cannot + "another program holds it";
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
