#include "panelgate/gateway/second_way.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <filesystem>
#include <system_error>
#include <utility>

#include "panelgate/line/tcp_line.hpp"

namespace panelgate::gateway {

SecondWay::SecondWay(boost::asio::any_io_executor executor, rt::Clock& clock,
                     std::function<void(bool second)> use)
    : executor_(std::move(executor)),
      clock_(clock),
      use_(std::move(use)),
      alarm_(clock.make_alarm()) {}

SecondWay::~SecondWay() { stop(); }

void SecondWay::start(line::Settings first, bool is_remote) {
    stop();
    first_ = std::move(first);
    is_remote_ = is_remote;
    running_ = true;
    second_ = false;
    patience_ = kPatience;
    pause_ = kLook;
    on_line(false);
}

void SecondWay::stop() {
    running_ = false;
    alarm_->cancel();
    end_look();
}

void SecondWay::on_line(bool up) {
    if (!running_) return;
    end_look();
    if (!up) return alarm_->arm(clock_.now() + patience_, [this] { change(); });
    alarm_->cancel();
    patience_ = kPatience;
    if (second_) look_later();
}

void SecondWay::change() {
    patience_ = std::min(2 * patience_, kLongest);
    second_ = !second_;
    use_(second_);
}

void SecondWay::look_later() {
    alarm_->arm(clock_.now() + pause_, [this] { look(); });
}

/// A serial device is there with its file: opening it might switch its transceiver. A device server
/// is there if it keeps a connection, which is closed before the line's own is made.
void SecondWay::look() {
    if (is_remote_) {
        probe_ = line::make_tcp_line(executor_, clock_, first_);
        probe_->start(*this);
        return;
    }
    std::error_code none;
    std::filesystem::exists(first_.device, none) ? found() : look_later();
}

void SecondWay::on_up() {
    boost::asio::post(executor_, [this, life = std::weak_ptr(alive_)] {
        if (!life.expired() && probe_) alarm_->arm(clock_.now() + kSteady, [this] { found(); });
    });
}

void SecondWay::on_down(const std::string&) {
    boost::asio::post(executor_, [this, life = std::weak_ptr(alive_)] {
        if (life.expired() || !probe_) return;
        end_look();
        look_later();
    });
}

void SecondWay::found() {
    end_look();
    pause_ = std::min(2 * pause_, kLongest);  // of the next look, if the device does not last
    second_ = false;
    use_(false);
}

void SecondWay::end_look() {
    if (probe_) probe_->stop();
    probe_.reset();
}

}  // namespace panelgate::gateway
