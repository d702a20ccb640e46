#include "house.hpp"

#include <utility>
#include <variant>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scenario {
namespace {

constexpr const char* kLine = "floor1";

std::unique_ptr<HouseLine> make_line(HouseLine*& made, Agenda& agenda, Wire& wire, Random& random,
                                     Duration wake, HouseLine::Reach reach, bool deaf) {
    auto line = std::make_unique<HouseLine>(agenda, wire, random, wake, std::move(reach));
    line->deaf = deaf;
    made = line.get();
    return line;
}

}  // namespace

House::House(const HousePlan& plan, HouseSeam::Flaw flaw)
    : plan_(plan),
      random_(plan.line.seed ^ 0x4005E),
      judge_(plan_, agenda_),
      wire_(plan_.line, agenda_, random_, judge_),
      bus_(io_.get_executor(), clock_, bus_settings(),
           make_line(
               line_, agenda_, wire_, random_, plan_.wake,
               [this](std::function<void()> call) { reach(std::move(call)); },
               flaw == HouseSeam::Flaw::deaf)),
      seam_(bus_, plan_, judge_, agenda_, flaw),
      questions_(random_),
      clients_(plan_, agenda_, random_, questions_, judge_, make_shared_state(),
               [this](std::function<void()> call) { reach(std::move(call)); }),
      poller_(make_poller()),
      relays_(clock_, routes()) {
    for (const PanelPlan& panel : plan_.line.panels)
        panels_.emplace_back(panel, plan_.line, agenda_, wire_, random_, judge_);
    if (plan_.master) {
        if (flaw == HouseSeam::Flaw::serves_others) {
            plan_.master->serves_others = plan_.master->on_failure_exception = true;
            plan_.master->others = 0.5;
        }
        master_.emplace(plan_, kLine, seam_, clock_, agenda_, questions_, judge_,
                        [this](std::function<void()> call) { reach(std::move(call)); });
    }
    if (flaw != HouseSeam::Flaw::untold) hear_write_ = poller_->write_listener();
    wire_.connect([this](ByteView bytes, bool) { line_->come(bytes); },
                  [this](ByteView adu, std::uint64_t connection) {
                      if (adu[0] == 0) judge_.on_broadcast(modbus::pdu_of(adu));
                      for (Panel& panel : panels_) {
                          if (adu[0] == 0 || panel.id() == adu[0]) panel.hear(adu, connection);
                      }
                  });
}

bus::Settings House::bus_settings() {
    bus::Settings settings;
    settings.name = kLine;
    settings.arbiter = plan_.line.settings;
    settings.observe = [this](const bus::BusEvent& event) {
        const auto* write = std::get_if<bus::WriteEvent>(&event);
        if (write != nullptr && hear_write_) hear_write_(*write);
    };
    return settings;
}

tcp_server::Settings House::listener_settings() const {
    tcp_server::Settings settings;
    settings.lines = {kLine};
    return settings;
}

std::shared_ptr<tcp_server::Shared> House::make_shared_state() {
    tcp_server::LineInfo info;
    info.name = kLine;
    info.bus = &seam_;
    for (const PanelPlan& panel : plan_.line.panels) info.stations.push_back(panel.id);
    tcp_server::UnitMap units(listener_settings(), {info});
    const tcp_server::Settings settings = listener_settings();
    auto own = std::make_shared<tcp_server::OwnAnswers>(clock_, settings.own_answers,
                                                        settings.own_answers_period);
    return std::make_shared<tcp_server::Shared>(tcp_server::Shared{
        settings, std::move(units), {}, clock_, {}, clock_.now(), std::move(own)});
}

std::unique_ptr<points::Poller> House::make_poller() {
    std::vector<points::PolledStation> stations;
    for (std::size_t i = 0; i < plan_.polled.size(); ++i) {
        if (plan_.polled[i] == Duration::zero()) continue;
        points::PolledStation station;
        station.id = plan_.line.panels[i].id;
        station.wants = {
            {{modbus::Table::holding_registers, kPolled, kPolledCount}, plan_.polled[i]}};
        if (!plan_.calm) {
            station.wants.push_back(
                {{modbus::Table::holding_registers, kPolledMemory, kPolledCount}, plan_.polled[i]});
        }
        station.limits =
            points::make_plan_limits(profile::PanelProfile(), plan_.line.settings.serial,
                                     plan_.line.settings.unlisted.frame_gap.value_or(2ms));
        stations.push_back(std::move(station));
    }
    auto poller = std::make_unique<points::Poller>(clock_, seam_, std::move(stations));
    poller->on_update([this](std::uint8_t station, const std::vector<std::size_t>& wants) {
        judge_poll(station, wants);
    });
    return poller;
}

void House::judge_poll(std::uint8_t station, const std::vector<std::size_t>& wants) {
    for (const std::size_t want : wants) {
        const points::Reading& reading = poller_->find(station)->reading(want);
        const auto address =
            static_cast<std::uint16_t>(poller_->find(station)->wants()[want].span.first);
        if (reading.sampled && address < kMemory)
            judge_.judge_values(station, address, reading.values, *reading.sampled);
    }
}

/// P10: what is called good is what the panel holds now, whoever wrote it.
void House::judge_points() {
    if (!polling_ || std::exchange(judged_, seam_.answers()) == seam_.answers()) return;
    for (const Panel& panel : panels_) {
        const auto polls = poller_->find(panel.id());
        if (polls == nullptr || plan_.calm) continue;
        const points::Want& want = polls->wants()[1];
        const points::Reading& reading = polls->reading(1);
        if (quality_of(reading, want.every, agenda_.now()) != points::Quality::good) continue;
        judge_.judge_values(panel.id(), kPolledMemory, reading.values, agenda_.now());
    }
}

std::vector<points::RelayRoute> House::routes() {
    if (!plan_.relay) return {};
    points::RelayRoute route;
    route.relay.from = {"first", "", modbus::Table::holding_registers, kRelayFrom};
    route.relay.to = {"last", "", modbus::Table::holding_registers, kRelayTo};
    route.relay.count = kRelayCount;
    route.relay.every = random_.between(50ms, 1s);
    route.from = route.to = &seam_;
    route.from_station = plan_.line.panels.front().id;
    route.to_station = plan_.line.panels.back().id;
    return {route};
}

void House::run() {
    bus_.start();
    for (Panel& panel : panels_) panel.start();
    clients_.start();
    if (master_) master_->start();
    poller_->start();
    relays_.start();
    every_so_often(plan_.line.line.losses,
                   [this] { reach([this] { line_->lose(random_.between(10ms, 2s), "pulled"); }); });
    every_so_often(plan_.line.line.pauses, [this] { pause(); });
    const TimePoint end = agenda_.now() + plan_.length;
    run_until(end, [] { return false; });
    clients_.end();
    if (master_) master_->end();
    poller_->stop();
    polling_ = false;
    relays_.stop();
    run_until(end + 1min, [this] {
        return seam_.idle() && clients_.idle() && is_master_idle() && bus_.idle() &&
               uncalled_.empty();
    });
    if (!seam_.idle()) judge_.fail("a request was never answered");
    if (!clients_.idle()) judge_.fail("a client was never answered");
    if (!is_master_idle()) judge_.fail("the port of the serial master still has something to do");
    if (!bus_.idle()) judge_.fail("the bus still has something to do");
}

void House::run_until(TimePoint until, const std::function<bool()>& done) {
    settle();
    while (judge_.violation().empty() && !done() && step(until)) {
    }
}

/// What is posted happens at once, as far as anybody runs the loop.
void House::settle() {
    if (asleep_) return;
    io_.restart();
    io_.poll();
}

/// Of one instant, what happens on the wire goes first. False when nothing is left until then.
bool House::step(TimePoint until) {
    const auto next = agenda_.next();
    const auto alarm = asleep_ ? std::nullopt : clock_.next();
    if ((!next || *next > until) && (!alarm || *alarm > until)) return false;
    if (next && (!alarm || *next <= *alarm)) {
        clock_.pass(*next - clock_.now());
        agenda_.happen_next();
    } else {
        agenda_.advance_to(*alarm);
        clock_.jump();
    }
    settle();
    judge_points();
    return true;
}

void House::reach(std::function<void()> call) {
    if (asleep_) {
        uncalled_.push_back(std::move(call));
    } else {
        call();
    }
}

void House::every_so_often(double per_second, const std::function<void()>& happen) {
    if (per_second <= 0) return;
    const std::chrono::duration<double> mean(1 / per_second);
    const Duration wait = random_.between(0us, std::chrono::duration_cast<Duration>(2 * mean));
    agenda_.at(agenda_.now() + wait, [this, per_second, happen] {
        happen();
        every_so_often(per_second, happen);
    });
}

void House::pause() {
    if (std::exchange(asleep_, true)) return;
    agenda_.tell("the process stops");
    agenda_.at(agenda_.now() + random_.between(100ms, 5s),
               [this, from = agenda_.now()] { resume(from); });
}

/// Alarms that are overdue may ring before the loop looks at the device, or behind.
void House::resume(TimePoint from) {
    asleep_ = false;
    judge_.on_paused(from, agenda_.now());
    agenda_.tell("the process goes on");
    const bool alarms_first = random_.chance(0.5);
    while (alarms_first && clock_.next() && *clock_.next() <= clock_.now()) clock_.jump();
    for (const auto& call : std::exchange(uncalled_, {})) reach(call);
}

}  // namespace panelgate::scenario
