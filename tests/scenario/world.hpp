#pragma once

#include <functional>
#include <list>
#include <string>
#include <vector>

#include "agenda.hpp"
#include "checker.hpp"
#include "customers.hpp"
#include "panel.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "subject.hpp"
#include "trouble.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// One line in virtual time: an arbiter on one end, panels on the other, clients behind the
/// arbiter.
class World {
  public:
    World(const Plan& plan, Subject& subject, Checker& checker);
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    /// Until the plan's number of frames were sent and everything is answered, or a promise broke.
    void run();
    TimePoint now() const { return agenda_.now(); }
    void keep_history() { agenda_.keep_history(); }
    std::string history() const { return agenda_.history(); }

  private:
    bool step();
    bool call_deadline();
    bool holds_input() const;
    std::optional<TimePoint> wake_at() const;
    void read_device();
    void drain();
    void act(const arbiter::Transmit& transmit);
    void act(const arbiter::Finish& finish);
    void act(const arbiter::Note& note);
    void act(const arbiter::Decision& decision);
    void act(const arbiter::Reset&);
    void act(const arbiter::Exchange&) {}
    void act(const arbiter::Written&) {}
    void act(const arbiter::StationEvent& event);

    void hear(ByteView bytes, std::uint8_t answer_of);
    void ask_panels(ByteView wire, std::uint64_t connection);
    bool is_dead(std::uint8_t station) const;
    /// As soon as the process runs.
    void reach(std::function<void()> call);

    // What happens to the line and the process
    void every_so_often(double per_second, const std::function<void()>& happen);
    void lose_line();
    void take_down(Duration pause);
    void stall();
    void pause();
    void resume();

    /// Where everything is dead little is sent: then time ends it.
    bool is_over() const {
        return checker_.frames() >= plan_.transactions || now() - agenda_.started() > 10min;
    }

    Plan plan_;
    Subject& subject_;
    Checker& checker_;
    Random random_;
    Agenda agenda_;
    Wire wire_;
    std::list<Panel> panels_;
    Customers customers_;
    Trouble trouble_;
    FrameKind what_next_ = FrameKind::request;  ///< the note of the frame that is transmitted next
    bool asleep_ = false;                       ///< nobody calls the arbiter
    TimePoint asleep_from_{};
    Bytes unread_;  ///< what has come, and lies in the device
    std::vector<std::function<void()>> uncalled_;
    int spins_ = 0;  ///< deadlines in a row that did not move time
};

}  // namespace panelgate::scenario
