#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "checker.hpp"
#include "panel.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "subject.hpp"

namespace panelgate::scenario {

/// One half-duplex wire in virtual time: an arbiter on one end, panels on the other, clients
/// behind the arbiter. Whoever speaks while another speaks damages both.
class World {
  public:
    World(const Plan& plan, Subject& subject, Checker& checker);

    /// Until the plan's number of frames were sent and everything is answered, or a promise broke.
    void run();
    TimePoint now() const { return now_; }
    /// Keeps the last things that happened, for a replay.
    void keep_history() { keeps_history_ = true; }
    std::string history() const;

  private:
    struct Frame {
        Bytes bytes;
        TimePoint start;
        TimePoint end;
        std::optional<TimePoint> garbled_from;
        bool answer = false;
        bool ours = false;
    };
    using FramePtr = std::shared_ptr<Frame>;
    struct Event {
        TimePoint at;
        std::uint64_t order = 0;
        std::function<void()> happen;
        bool operator>(const Event& other) const {
            return at != other.at ? at > other.at : order > other.order;
        }
    };
    struct Customer {
        ClientPlan plan;
        arbiter::Client id = 0;
        unsigned open = 0;
    };

    void at(TimePoint when, std::function<void()> happen);
    bool step();
    void drain();
    void act(const arbiter::Transmit& transmit);
    void act(const arbiter::Finish& finish);
    void act(const arbiter::Note& note);
    void act(const arbiter::Decision&) {}
    void act(const arbiter::Reset&) { reset_line(); }
    void act(const arbiter::StationEvent&) {}

    FramePtr put_on_wire(Bytes bytes, bool ours, bool answer);
    void deliver_in_chunks(const FramePtr& frame);
    void deliver(const FramePtr& frame, std::size_t from, std::size_t to);
    void on_request_left(const FramePtr& frame);
    void tell(const std::string& what, ByteView bytes = {});
    void make_noise();
    void lose_line();
    void reset_line();

    void become(Customer& customer);
    void ask(std::size_t index);
    Bytes draw_request(const Customer& customer, std::uint8_t& station);
    Bytes draw_write();
    void on_answer(std::size_t index);
    /// Where everything is dead little is sent: then time ends it.
    bool is_over() const {
        return checker_.frames() >= plan_.transactions || now_ - started_ > 10min;
    }

    Plan plan_;
    Subject& subject_;
    Checker& checker_;
    Random random_;
    TimePoint now_{1h};
    TimePoint started_{};
    std::uint64_t order_ = 0;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
    std::list<FramePtr> air_;
    std::vector<Panel> panels_;
    std::vector<Customer> customers_;
    std::map<arbiter::Ticket, std::size_t> asked_by_;
    std::string_view what_next_;  ///< the note of the frame that is transmitted next
    arbiter::Client last_client_ = 0;
    unsigned last_write_ = 0;
    bool up_ = false;
    bool keeps_history_ = false;
    std::deque<std::string> history_;
    int spins_ = 0;           ///< deadlines in a row that did not move time
    std::uint64_t life_ = 0;  ///< of the line: what was said before it was lost is not heard
};

}  // namespace panelgate::scenario
