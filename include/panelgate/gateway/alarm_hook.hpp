#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <memory>
#include <optional>

#include "panelgate/alarms/webhook.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"

namespace panelgate::gateway {

/// Posts what alarms::Webhook decides to send, one request at a time, from a thread of its own. An
/// object of the plant's loop.
class AlarmHook {
  public:
    /// The clock outlives the hook.
    AlarmHook(boost::asio::any_io_executor executor, rt::Clock& clock);
    AlarmHook(const AlarmHook&) = delete;
    AlarmHook& operator=(const AlarmHook&) = delete;

    /// True if another webhook begins: it has to be told what is active.
    bool apply(const std::optional<alarms::WebhookSettings>& settings);
    void on_change(const alarms::Change& change);
    void stop();

  private:
    void look();
    void send(std::string body);
    void settle(const std::string& why);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    std::optional<alarms::Webhook> hook_;
    bool under_way_ = false;
    bool failing_ = false;
    std::unique_ptr<rt::Worker> worker_;
    boost::asio::any_io_executor executor_;
};

}  // namespace panelgate::gateway
