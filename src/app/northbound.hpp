#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "panelgate/mqtt/client.hpp"
#include "panelgate/mqtt/counters.hpp"
#include "panelgate/mqtt/publisher.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/api/point_order.hpp"
#include "scene.hpp"

namespace panelgate::app {

/// A plant at an MQTT broker: its points and the states of its stations and lines, and writes of
/// points that come back. The clock outlives it. One thread.
class BrokerSession {
  public:
    /// Of a scene that has `mqtt:`.
    BrokerSession(boost::asio::any_io_executor executor, rt::Clock& clock,
                  std::shared_ptr<const Scene> scene);

    /// This one says the same of the same: show() will do.
    bool fits(const Scene& scene) const;
    /// What it tells of is looked up in this scene from now on; fits(scene).
    void show(std::shared_ptr<const Scene> scene);
    /// Before start(): tells what another one, which is stopped next, has not told any more. At the
    /// same broker its writes are this one's from now on.
    void take_over(BrokerSession& before);

    void start();
    /// What is given keeps the connection until the broker has heard of it; null: there is none.
    std::unique_ptr<mqtt::Leaving> stop();

    /// Of the gateway's lines: what has happened.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    /// What has become of these wants of a station's polls.
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    mqtt::Counters counters() const;

  private:
    /// Where what a subject tells is found.
    struct Place {
        const Station* station = nullptr;  ///< null: a line
        const points::Point* point = nullptr;
    };
    struct Order;
    /// Those under way. Passed on from session to session, for answers that come later.
    struct Writes {
        BrokerSession* session;  ///< that is told what becomes of them
        bus::ClientId client;
        std::size_t open = 0;
    };

    std::optional<mqtt::State> seen(std::size_t subject) const;
    void look(std::size_t subject);
    void sweep();
    mqtt::State state_of(const Station& station, const points::Point& point) const;
    void offer(std::size_t subject, mqtt::State state);
    void on_command(const mqtt::Command& command);
    void on_rebirth();
    void write(const mqtt::WriteCommand& command);
    void refuse(const std::string& topic, const std::string& id, const web::Problem& why);
    void finish(const Order& order, const bus::Answer& answer);

    rt::Clock& clock_;
    std::shared_ptr<const Scene> scene_;  ///< where the places are
    mqtt::Settings settings_;
    std::vector<Place> places_;  ///< by subject
    /// The first of a station's points; they follow each other.
    std::map<const Station*, std::size_t> first_points_;
    mqtt::Publisher publisher_;
    std::unique_ptr<rt::Alarm> alarm_;  ///< of the sweep
    std::size_t swept_ = 0;
    std::unique_ptr<rt::Alarm> rebirth_alarm_;  ///< of the one that others have joined
    TimePoint next_rebirth_{};                  ///< not before
    bool rebirth_waits_ = false;
    mqtt::Counters counters_;         ///< of writes, and of sessions before
    std::shared_ptr<Writes> writes_;  ///< null once they are another's
    mqtt::Client client_;
};

/// What is served at the plant's broker, through all reloads. The clock outlives it. One thread.
class Northbound {
  public:
    Northbound(boost::asio::any_io_executor executor, rt::Clock& clock);

    /// From now on this; without `mqtt:` nothing. Where broker, points and stations are the same,
    /// the connection stays; else it is made anew, and what waited is kept.
    void show(const std::shared_ptr<const Scene>& scene);
    void start();
    /// Says the last word. Harmless when it was said.
    void stop();
    /// The broker has heard that last word, or it is not waited for any more.
    bool left() const { return !leaving_ || leaving_->done(); }

    /// Of the lines of the scene.
    void on_bus_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const Station& station, const std::vector<std::size_t>& wants);

    /// Nothing without a broker.
    std::optional<mqtt::Counters> counters() const;

  private:
    void leave();

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<BrokerSession> session_;  ///< null without a broker
    std::unique_ptr<mqtt::Leaving> leaving_;  ///< of the session before, or of the last
    bool running_ = false;
};

}  // namespace panelgate::app
