#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::gateway {

/// Decides which of a line's two devices is used: the second one while the first cannot be opened,
/// and the first one again when it is there. One thread; the executor and the clock outlive it.
class SecondWay : private line::Line::Events {
  public:
    static constexpr Duration kPatience = 500ms;  ///< of a device that is down
    static constexpr Duration kLook = 2s;         ///< first pause between looks for the first one
    static constexpr Duration kLongest = 1min;    ///< longest pause
    /// A device server whose only connection is taken accepts a second one and closes it at once.
    static constexpr Duration kSteady = 500ms;  ///< the first device keeps a connection so long

    /// `use` changes the device; the line's own driver does so when no reply is outstanding.
    SecondWay(boost::asio::any_io_executor executor, rt::Clock& clock,
              std::function<void(bool second)> use);
    ~SecondWay() override;

    /// The line's first device is used from now on; `first`: its settings.
    void start(line::Settings first, bool is_remote);
    void stop();
    /// The device that is used has been opened or cannot be.
    void on_line(bool up);
    bool second() const { return second_; }

  private:
    void on_up() override;
    void on_down(const std::string& why) override;
    void on_bytes(ByteView) override {}

    void change();
    void look_later();
    void look();
    void found();
    void end_look();

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::function<void(bool second)> use_;
    std::unique_ptr<rt::Alarm> alarm_;
    line::Settings first_;
    bool is_remote_ = false;
    bool running_ = false;
    bool second_ = false;
    Duration patience_ = kPatience;      ///< doubles while neither can be opened
    Duration pause_ = kLook;             ///< doubles while the first device does not last
    std::unique_ptr<line::Line> probe_;  ///< connects to the first device, and sends nothing
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace panelgate::gateway
