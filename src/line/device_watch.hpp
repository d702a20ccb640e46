#pragma once

#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

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

}  // namespace panelgate::line
