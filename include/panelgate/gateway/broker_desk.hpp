#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/mqtt/client.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/outbox.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/web/http/crossing.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::gateway {

class BrokerSession;

/// The answer to a write: a JSON object of `ok` and these members.
std::string answer_text(bool ok, const boost::json::object& members);

/// The faces' end of a session at an MQTT broker: the connection, what waits for the broker, and
/// the refusal of writes that are malformed or too many. Made and owned by the session, of the
/// faces' loop but for has_room() and the constructor.
class BrokerDesk {
  public:
    /// Messages on their way from the session at most. The states among further ones are dropped:
    /// the session's next sweep brings the states again.
    static constexpr std::size_t kWaiting = 16384;

    BrokerDesk(web::Loops loops, const mqtt::Settings& settings, mqtt::Subjects subjects);

    /// Any thread: whether a state may be sent to this desk.
    bool has_room() const { return waiting < kWaiting; }
    std::atomic<std::size_t> waiting = 0;  ///< messages on their way

    /// `session` gets the commands of the broker.
    void start(std::weak_ptr<BrokerSession> session);
    /// Sends the farewell; `closed` becomes true as soon as the broker has got the farewell, or is
    /// not waited for any more.
    void stop(const std::shared_ptr<std::atomic<bool>>& closed);
    void renew(const tls::Material& files) { client_.renew(files); }
    /// As BrokerSession::take_over().
    void take_over(BrokerDesk& before);
    /// Before start(): changes that waited when the program ended; from now on those that wait are
    /// kept by the session.
    void restore(const mqtt::Outbox::Texts& kept);

    void know(std::size_t subject, mqtt::State state) {
        publisher_.know(subject, std::move(state));
    }
    /// `again`: also an unchanged state is published.
    void offer(std::size_t subject, mqtt::State state, bool again = false);
    /// Publishes the current state again, for clients that ignore answers.
    void repeat(std::size_t subject);
    /// Answers a write that a panel has got, or may have got. `body`: of answer_text().
    void answer(const std::string& topic, const std::string& id, const std::string& body, bool ok);
    /// Answers a write that the session has refused.
    void answer_refused(const std::string& topic, const std::string& id, const web::Problem& why);

    mqtt::Counters counters() const;
    const std::weak_ptr<BrokerSession>& session() const { return session_; }

  private:
    void on_command(const mqtt::Command& command);
    void on_rebirth();
    void end_write();
    void refuse(const std::string& topic, const std::string& id, const web::Problem& why);
    void refuse_here(const std::string& topic, const std::string& id, const web::Problem& why,
                     std::optional<std::size_t> point);
    void tell(std::function<void(BrokerSession&)> work);
    void keep_waiting();
    void wait_for(const std::shared_ptr<std::atomic<bool>>& closed);

    web::Loops loops_;
    rt::AsioClock clock_;
    mqtt::Settings settings_;
    mqtt::Publisher publisher_;
    std::weak_ptr<BrokerSession> session_;  ///< locked by the plant's loop alone
    std::unique_ptr<rt::Alarm> alarm_;      ///< of a pending rebirth, then of the farewell
    std::unique_ptr<rt::Alarm> keeping_;    ///< of the outbox
    std::optional<mqtt::Outbox> outbox_;    ///< none: nothing is kept over a restart
    TimePoint next_rebirth_{};              ///< earliest time of the next rebirth
    bool rebirth_waits_ = false;
    std::size_t under_way_ = 0;  ///< writes at the session
    std::shared_ptr<std::atomic<std::size_t>> told_ =
        std::make_shared<std::atomic<std::size_t>>(0);  ///< refusals on their way to the session
    mqtt::Counters counters_;                           ///< of writes, and of earlier sessions
    mqtt::Client client_;
    std::shared_ptr<mqtt::GracefulClose> closing_;
};

}  // namespace panelgate::gateway
