#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agenda.hpp"
#include "house_clients.hpp"
#include "house_line.hpp"
#include "house_master.hpp"
#include "house_plan.hpp"
#include "house_questions.hpp"
#include "house_seam.hpp"
#include "panel.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/points/poller.hpp"
#include "panelgate/points/relays.hpp"
#include "random.hpp"
#include "support/manual_clock.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// The gateway's own shells in virtual time, on the wire of a Plan: pipelines of connections, a
/// serial master's port, a poller and a relay over one bus. The loop is a real one whose time is
/// made.
class House {
  public:
    House(const HousePlan& plan, HouseSeam::Flaw flaw);
    House(const House&) = delete;
    House& operator=(const House&) = delete;

    /// Until the plan's time is over and everything is answered, or a promise broke.
    void run();
    void keep_history() { agenda_.keep_history(); }

    const std::string& violation() const { return judge_.violation(); }
    std::string history() const { return agenda_.history(); }
    std::uint64_t answers() const { return seam_.answers(); }
    std::uint64_t good() const { return judge_.good; }
    std::uint64_t polls() const { return seam_.polls(); }
    std::uint64_t relayed() const { return seam_.relayed(); }
    /// Answers that a serial master took.
    std::uint64_t to_master() const { return master_ ? master_->answered() : 0; }

  private:
    bus::Settings bus_settings();
    tcp_server::Settings listener_settings() const;
    std::shared_ptr<tcp_server::Shared> make_shared_state();
    std::unique_ptr<points::Poller> make_poller();
    std::vector<points::RelayRoute> routes();
    void judge_poll(std::uint8_t station, const std::vector<std::size_t>& wants);
    void judge_points();

    bool is_master_idle() const { return !master_ || master_->idle(); }
    void settle();
    bool step(TimePoint until);
    void run_until(TimePoint until, const std::function<bool()>& done);
    void reach(std::function<void()> call);
    void every_so_often(double per_second, const std::function<void()>& happen);
    void pause();
    void resume(TimePoint from);

    HousePlan plan_;
    Random random_;
    Agenda agenda_;
    test::ManualClock clock_;  ///< shows what the agenda shows
    boost::asio::io_context io_{1};
    HouseJudge judge_;
    Wire wire_;
    std::list<Panel> panels_;
    HouseLine* line_ = nullptr;
    std::function<void(const bus::WriteEvent&)> hear_write_;  ///< the bus tells to its end
    bus::Bus bus_;
    HouseSeam seam_;
    Questions questions_;
    HouseClients clients_;
    std::optional<HouseMaster> master_;
    std::unique_ptr<points::Poller> poller_;
    points::Relays relays_;
    std::uint64_t judged_ = 0;  ///< answers, when the points were last looked at
    bool polling_ = true;       ///< the poller hears of writes
    bool asleep_ = false;       ///< nobody runs the loop
    std::vector<std::function<void()>> uncalled_;
};

}  // namespace panelgate::scenario
