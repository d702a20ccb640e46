#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/alarms/alarms.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/gateway/broker_desk.hpp"
#include "panelgate/gateway/journal.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/points/report.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/http/crossing.hpp"

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

/// A plant's session at an MQTT broker: reads the states of its points, stations and lines for the
/// broker's desk, and carries out writes of points. The clock outlives it. Of the plant's loop.
class BrokerSession : public std::enable_shared_from_this<BrokerSession> {
  public:
    /// `snapshot` must have `mqtt:`. `serving`: of the faces' loop, gets the desk at its start.
    /// The journal outlives it.
    BrokerSession(web::Loops loops, rt::Clock& clock, Journal& journal,
                  const std::shared_ptr<const Snapshot>& snapshot, TopicRefusals refused,
                  std::shared_ptr<std::weak_ptr<BrokerDesk>> serving);
    ~BrokerSession();

    /// True if this session can serve the snapshot unchanged: show() is enough.
    bool fits(const Snapshot& snapshot) const;
    /// Uses this snapshot from now on; fits(*snapshot) must be true.
    void show(std::shared_ptr<const Snapshot> snapshot);
    /// Files for the next connection to the broker.
    void renew(const tls::Material& files);
    /// Call before start(): takes over unpublished values of a session that is stopped next. At the
    /// same broker the new session answers outstanding writes of the former session, too.
    void take_over(BrokerSession& before);

    /// Before start(): what a former program has kept of changes for the broker.
    void restore(const mqtt::Outbox::Texts& kept);
    void start();
    /// Ends the session. No effect if it has ended.
    void stop();
    /// True once the broker has got the last message, or is not waited for any more.
    bool has_left() const { return closed_ && *closed_; }

    /// Publishes the state of an alarm of this name, if the broker may see the alarm.
    void on_alarm(const std::string& name, mqtt::State state);
    /// Publishes what has happened on a line.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    /// Publishes the points among these wants of a station's polls.
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    // What the desk tells:
    /// Carries out a write of a point (a subject's number), and answers it at the desk.
    void write(const mqtt::WriteCommand& command, const std::string& topic);
    /// The desk has refused a write; `point`: a subject's number, if it named one.
    void refused(const std::string& topic, const web::Problem& why,
                 std::optional<std::size_t> point);
    /// Keeps and forgets these texts in the store.
    void keep(const mqtt::Outbox::Texts& texts);
    /// The desk's counters.
    void keep(mqtt::Counters counters);

    /// As the desk told them last.
    const mqtt::Counters& counters() const { return counters_; }

  private:
    /// The source of a subject's state.
    struct Place {
        const Station* station = nullptr;  ///< null: a line or an alarm
        const points::Point* point = nullptr;
    };
    struct Order;
    /// The running writes. Passed from session to session, for answers that come later.
    struct Writes {
        BrokerSession* session;  ///< that gets their results
        bus::ClientId client;
    };

    /// The subjects of a station; its points in the order of the configuration.
    struct Numbers {
        std::size_t station = 0;
        std::vector<std::size_t> points;
    };

    void at_desk(std::function<void(BrokerDesk&)> work) const;
    std::optional<mqtt::State> seen(std::size_t subject) const;
    void look(std::size_t subject);
    void look_by_rule(std::size_t subject, const Place& place);
    void look_at_stations(const std::string& line, std::optional<std::uint8_t> id);
    void sweep();
    mqtt::State state_of(const points::PointReading& reading) const;
    void answer_refused(const std::string& topic, const std::string& id,
                        const web::Problem& why) const;
    void finish(const Order& order, const bus::Answer& answer);

    web::Loops loops_;
    rt::Clock& clock_;
    Journal& journal_;
    std::shared_ptr<const Snapshot> snapshot_;  ///< what the places refer to
    mqtt::Settings settings_;
    mqtt::Subjects subjects_;
    std::vector<Place> places_;  ///< by subject
    std::map<const Station*, Numbers> numbers_;
    std::map<std::size_t, points::Told> told_;  ///< by subject, of points with a report rule
    std::unique_ptr<rt::Alarm> alarm_;          ///< of the sweep
    std::size_t swept_ = 0;
    bool is_started_ = false;
    std::map<std::size_t, mqtt::State> early_;  ///< of lines, before the start
    mqtt::Counters counters_;
    TopicRefusals refused_;             ///< null: nobody wants to know
    WhoRef who_;                        ///< who writes: whoever may publish at the broker
    std::shared_ptr<Writes> writes_;    ///< null once another session has taken them over
    std::shared_ptr<BrokerDesk> desk_;  ///< of the faces' loop
    std::shared_ptr<std::weak_ptr<BrokerDesk>> serving_;
    std::shared_ptr<std::atomic<bool>> closed_;  ///< null until stop()
};

/// The plant's MQTT service, across all reloads. The clock outlives it. Of the plant's loop.
class Northbound {
  public:
    /// `refused` is told of writes that are refused before they come to a line. The journal
    /// outlives it, and keeps changes that wait for the broker when the program ends.
    Northbound(web::Loops loops, rt::Clock& clock, Journal& journal, TopicRefusals refused = {});

    /// Serves this snapshot from now on; without `mqtt:` nothing. If broker, points and stations
    /// are the same, the connection stays; else it is made anew, and queued messages are kept.
    void show(const std::shared_ptr<const Snapshot>& snapshot);
    /// Connects to the broker as soon as the journal has told what waits from before; nothing is
    /// published earlier. Then `started` is called: alarms are to be reported once more.
    void start(std::function<void()> started);
    /// Sends the last message. No effect if it was sent already.
    void stop();
    /// True if the broker has got the last message, or it is not waited for any more.
    bool left() const { return !leaving_ || leaving_->has_left(); }

    /// Files for the next connection to the broker; none is closed.
    void renew(const tls::Material& files);

    /// Reports an alarm, as web::AlarmSource knows it.
    void on_alarm(const alarms::Settings& alarm, const alarms::Status& status);
    /// Reports an event of a line of the snapshot.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    /// Of the faces' loop: takes the present counters there; the function returned keeps them here,
    /// in the plant's loop, for counters(). The function is empty without a broker.
    std::function<std::function<void()>()> collector() const;
    /// As collected last; nothing without a broker.
    std::optional<mqtt::Counters> counters() const;

  private:
    void leave();

    web::Loops loops_;
    rt::Clock& clock_;
    Journal& journal_;
    TopicRefusals refused_;
    std::shared_ptr<BrokerSession> session_;  ///< null without a broker
    std::shared_ptr<std::weak_ptr<BrokerDesk>> serving_ =
        std::make_shared<std::weak_ptr<BrokerDesk>>();  ///< of the faces' loop
    std::shared_ptr<BrokerSession> leaving_;  ///< the previous or the last session, as it ends
    bool running_ = false;                    ///< the journal has answered
    bool stopped_ = false;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace panelgate::gateway
