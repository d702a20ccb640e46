#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/explain/translations.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/mqtt/client.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/point_order.hpp"

namespace panelgate::gateway {

/// A write of a topic that was refused before it came to a line. Valid for the call only.
struct TopicRefusal {
    WhoRef who;
    std::string_view topic;
    const web::Problem& why;
    const Station* station = nullptr;  ///< null: no such topic, or one that is malformed
    const points::Point* point = nullptr;
};
using TopicRefusals = std::function<void(const TopicRefusal&)>;

/// A plant's session at an MQTT broker: publishes its points and the states of its stations and
/// lines, and carries out writes of points. The clock outlives it. One thread.
class BrokerSession {
  public:
    /// `snapshot` must have `mqtt:`.
    BrokerSession(boost::asio::any_io_executor executor, rt::Clock& clock,
                  std::shared_ptr<const Snapshot> snapshot, TopicRefusals refused);

    /// True if this session can serve the snapshot unchanged: show() is enough.
    bool fits(const Snapshot& snapshot) const;
    /// Uses this snapshot from now on; fits(*snapshot) must be true.
    void show(std::shared_ptr<const Snapshot> snapshot);
    /// Files for the next connection to the broker.
    void renew(const tls::Material& files);
    /// Call before start(): takes over unpublished values of a session that is stopped next. At the
    /// same broker the new session answers outstanding writes of the former session, too.
    void take_over(BrokerSession& before);

    void start();
    /// Ends the session. The returned object keeps the connection until the broker has got the last
    /// message; null: there is none.
    std::shared_ptr<mqtt::GracefulClose> stop();

    /// Publishes what has happened on a line.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    /// Publishes the points among these wants of a station's polls.
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    mqtt::Counters counters() const;

  private:
    /// The source of a subject's state.
    struct Place {
        const Station* station = nullptr;  ///< null: a line
        const points::Point* point = nullptr;
    };
    struct Order;
    /// The running writes. Passed from session to session, for answers that come later.
    struct Writes {
        BrokerSession* session;  ///< that gets their results
        bus::ClientId client;
        std::size_t open = 0;
    };

    /// The subjects of a station; its points in the order of the configuration.
    struct Numbers {
        std::size_t station = 0;
        std::vector<std::size_t> points;
    };

    std::optional<mqtt::State> seen(std::size_t subject) const;
    void look(std::size_t subject);
    void sweep();
    mqtt::State state_of(const Station& station, const points::Point& point) const;
    void offer(std::size_t subject, mqtt::State state);
    void on_command(const mqtt::Command& command);
    void on_rebirth();
    void write(const mqtt::WriteCommand& command);
    /// Tells the client, and the log.
    void answer_refused(const std::string& topic, const std::string& id, const web::Problem& why);
    void refuse(const std::string& topic, const std::string& id, const web::Problem& why,
                const Place& place);
    void finish(const Order& order, const bus::Answer& answer);

    rt::Clock& clock_;
    std::shared_ptr<const Snapshot> snapshot_;  ///< what the places refer to
    mqtt::Settings settings_;
    std::vector<Place> places_;  ///< by subject
    std::map<const Station*, Numbers> numbers_;
    mqtt::Publisher publisher_;
    std::unique_ptr<rt::Alarm> alarm_;  ///< of the sweep
    std::size_t swept_ = 0;
    std::unique_ptr<rt::Alarm> rebirth_alarm_;  ///< of the pending rebirth
    TimePoint next_rebirth_{};                  ///< earliest time of the next rebirth
    bool rebirth_waits_ = false;
    std::int64_t certificate_expiry_ = 0;
    mqtt::Counters counters_;         ///< of writes, and of earlier sessions
    TopicRefusals refused_;           ///< null: nobody wants to know
    WhoRef who_;                      ///< who writes: whoever may publish at the broker
    std::shared_ptr<Writes> writes_;  ///< null once another session has taken them over
    mqtt::Client client_;
};

/// The plant's MQTT service, across all reloads. The clock outlives it. One thread.
class Northbound {
  public:
    /// `refused` is told of writes that are refused before they come to a line.
    Northbound(boost::asio::any_io_executor executor, rt::Clock& clock, TopicRefusals refused = {});

    /// Serves this snapshot from now on; without `mqtt:` nothing. If broker, points and stations
    /// are the same, the connection stays; else it is made anew, and queued messages are kept.
    void show(const std::shared_ptr<const Snapshot>& snapshot);
    void start();
    /// Sends the last message. No effect if it was sent already.
    void stop();
    /// True if the broker has got the last message, or it is not waited for any more.
    bool left() const { return !closing_ || closing_->done(); }

    /// Files for the next connection to the broker; none is closed.
    void renew(const tls::Material& files);

    /// Reports an event of a line of the snapshot.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    /// Nothing without a broker.
    std::optional<mqtt::Counters> counters() const;

  private:
    void leave();

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    TopicRefusals refused_;
    std::unique_ptr<BrokerSession> session_;        ///< null without a broker
    std::shared_ptr<mqtt::GracefulClose> closing_;  ///< of the previous or the last session
    bool running_ = false;
};

}  // namespace panelgate::gateway
