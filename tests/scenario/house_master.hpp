#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agenda.hpp"
#include "house_line.hpp"
#include "house_plan.hpp"
#include "house_questions.hpp"
#include "house_seam.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/serial_server/serial_master.hpp"
#include "random.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// A serial master on a half-duplex wire of its own, and the gateway's port at the other end. It
/// takes for the answer what any master would: a good frame that fits what it said last. The judge
/// is told when that is not so, and when the gateway says anything else.
class HouseMaster {
  public:
    /// As soon as the process runs.
    using Reach = std::function<void(std::function<void()>)>;

    /// `line`: the name of the one line, which `bus` stands for. All outlive it.
    HouseMaster(const HousePlan& plan, const std::string& line, bus::BusClient& bus,
                rt::Clock& clock, Agenda& agenda, Questions& questions, HouseJudge& judge,
                Reach reach);
    HouseMaster(const HouseMaster&) = delete;
    HouseMaster& operator=(const HouseMaster&) = delete;

    void start();
    /// It asks for nothing more.
    void end() { ended_ = true; }
    /// The gateway owes it nothing.
    bool idle() const { return gateway_.idle(); }
    /// What it took for answers, values and confirmations.
    std::uint64_t answered() const { return answered_; }

  private:
    /// What it said last, and since when it wants to know just that.
    struct Asked {
        HouseJudge::Question question;
        bool ours = false;      ///< of a unit that the gateway answers for
        bool damaged = false;   ///< on the way: nobody can answer it
        bool answered = false;  ///< or refused
    };
    /// Nobody to tell of what happens on its wire.
    class Deaf final : public Witness {
        void on_served(TimePoint, std::uint8_t) override {}
        void on_executed(TimePoint, std::uint8_t, ByteView) override {}
        void on_exception(TimePoint, std::uint8_t, ByteView) override {}
        void on_copy(TimePoint, ByteView) override {}
        void on_reply(TimePoint, ByteView) override {}
        void on_said(TimePoint, ByteView) override {}
        void on_garbled(TimePoint) override {}
        void on_collision(TimePoint, std::uint8_t) override {}
    };

    serial_server::SerialMaster make_gateway(const HousePlan& plan, const std::string& line,
                                             bus::BusClient& bus, rt::Clock& clock, Reach reach);
    void go_on_at(TimePoint when, void (HouseMaster::*how)());
    void take_turn();
    void ask_anew();
    void ask(std::uint8_t unit, Bytes pdu);
    void spread();
    void ask_other();
    void answer_as_other();
    /// When its last bit has left.
    TimePoint say(const Bytes& adu);
    void spoil(Said& said);
    void on_silence();
    void hear(ByteView adu);
    void judge_reply(const modbus::RtuFrame& frame);

    MasterPlan plan_;
    std::vector<std::uint8_t> units_;
    Agenda& agenda_;
    Questions& questions_;
    HouseJudge& judge_;
    Random random_;
    Deaf nobody_;
    Wire wire_;
    HouseLine* line_ = nullptr;
    serial_server::SerialMaster gateway_;
    std::optional<Asked> asked_;
    bool patient_ = false;    ///< each of its requests has to be answered
    std::uint64_t turn_ = 0;  ///< what was put off before is not done any more
    unsigned repeats_ = 0;    ///< of what was asked last
    std::uint64_t answered_ = 0;
    bool ended_ = false;
};

}  // namespace panelgate::scenario
