#include "world.hpp"

#include <algorithm>
#include <utility>

#include "speech.hpp"

namespace panelgate::scenario {

World::World(const Plan& plan, Subject& subject, Checker& checker)
    : plan_(plan),
      subject_(subject),
      checker_(checker),
      random_(plan.seed ^ 0x5EED),
      wire_(plan_, agenda_, random_, checker_),
      customers_(
          plan_, agenda_, subject_, random_, checker_,
          [this](std::function<void()> call) { reach(std::move(call)); },
          [this] { return is_over(); }),
      trouble_(plan_, agenda_, wire_, random_, [this] { return is_over(); }) {
    for (const PanelPlan& panel : plan_.panels)
        panels_.emplace_back(panel, plan_, agenda_, wire_, random_, checker_);
    wire_.connect([this](ByteView bytes, std::uint8_t answer_of) { hear(bytes, answer_of); },
                  [this](ByteView adu, std::uint64_t connection) { ask_panels(adu, connection); },
                  [this] {
                      for (Panel& panel : panels_) panel.overhear();
                  });
}

void World::run() {
    checker_.on_line_up(now());
    subject_.on_line_up(now());
    drain();
    customers_.start();
    trouble_.start();
    for (Panel& panel : panels_) panel.start();
    every_so_often(plan_.line.losses, [this] { lose_line(); });
    every_so_often(plan_.line.stalls, [this] { stall(); });
    every_so_often(plan_.line.pauses, [this] { pause(); });
    while (!checker_.failed() && step()) {
    }
    if (!checker_.failed()) checker_.at_end(now());
}

/// One event, or one deadline of the arbiter. False when nothing is left to happen.
bool World::step() {
    constexpr int kMostSpins = 1000;
    const auto next = agenda_.next();
    if (!customers_.are_waiting() && uncalled_.empty() && (!next || is_over())) return false;
    const auto deadline = asleep_ ? std::nullopt : wake_at();
    if (deadline && (!next || *deadline < *next)) {
        spins_ = *deadline > now() ? 0 : spins_ + 1;
        if (spins_ > kMostSpins) checker_.on_spin();
        agenda_.advance_to(*deadline);
        read_device();
        subject_.on_deadline(now());
        drain();
        return true;
    }
    if (!next) return false;
    if (*next > now()) spins_ = 0;
    agenda_.happen_next();
    return true;
}

bool World::holds_input() const {
    const auto busy = subject_.busy_until();
    return busy && *busy > now();
}

/// The alarm: the arbiter's deadline, or when what lies in the device is to be read.
std::optional<TimePoint> World::wake_at() const {
    const auto deadline = subject_.next_deadline();
    if (!holds_input()) return deadline;
    const TimePoint busy = *subject_.busy_until();
    return deadline ? std::min(*deadline, busy) : busy;
}

/// Before any verb.
void World::read_device() {
    const Bytes bytes = std::exchange(unread_, {});
    if (bytes.empty()) return;
    agenda_.tell("read", bytes);
    subject_.on_rx(now(), bytes);
    drain();
}

/// Behind every verb.
void World::drain() {
    subject_.check_invariants();
    while (auto action = subject_.poll_action(now())) {
        std::visit([this](const auto& a) { act(a); }, *action);
    }
}

void World::reach(std::function<void()> call) {
    if (asleep_) {
        uncalled_.push_back(std::move(call));
        return;
    }
    read_device();
    call();
    drain();
    checker_.on_settled();
}

void World::act(const arbiter::Note& note) {
    if (direction_of(note.kind) == FrameDirection::sent) {
        what_next_ = note.kind;
    } else {
        agenda_.tell("taken for: " + std::string(label(note.kind)), note.bytes);
    }
}

void World::act(const arbiter::Decision& decision) {
    if (decision.kind != arbiter::Decision::Kind::line_rests) return;
    agenda_.tell("the line rests for " + std::to_string(decision.time / 1us) +
                 " us because of station " + std::to_string(decision.station));
}

void World::act(const arbiter::StationEvent& event) {
    agenda_.tell("station " + std::to_string(event.station) + " is " +
                 std::string(label(event.kind)) + ", " + std::to_string(event.by / 1us) + " us");
}

void World::act(const arbiter::Transmit& transmit) {
    agenda_.tell("sent, " + std::string(label(what_next_)), transmit.adu);
    const Bytes adu = understood(plan_.settings.serial, transmit.adu);
    checker_.on_transmit(now(), adu, what_next_, is_dead(adu[0]));
    wire_.send(transmit.adu);
}

void World::act(const arbiter::Finish& finish) {
    agenda_.tell("answer " + std::to_string(finish.ticket) +
                     (finish.pdu ? "" : " " + std::string(label(finish.pdu.error()))),
                 finish.pdu ? *finish.pdu : Bytes{});
    checker_.on_finish(now(), finish);
    customers_.on_finish(finish.ticket);
}

void World::act(const arbiter::Reset&) {
    agenda_.tell("the line is reset");
    // Acting may not call in again before the arbiter has said all.
    agenda_.at(now(), [this] {
        reach([this] {
            wire_.forget_connection();
            take_down(random_.between(1ms, Duration(200ms)));
        });
    });
}

void World::hear(ByteView bytes, std::uint8_t answer_of) {
    if (asleep_) {
        unread_.insert(unread_.end(), bytes.begin(), bytes.end());
        if (answer_of != 0) checker_.on_answered(now(), answer_of);
        return;
    }
    if (answer_of != 0) {
        checker_.on_answered(now(), answer_of);
    } else {
        checker_.on_heard(now(), bytes.size());
    }
    agenda_.tell(answer_of != 0 ? "heard, the answer's end" : "heard", bytes);
    const bool hold = holds_input();
    unread_.insert(unread_.end(), bytes.begin(), bytes.end());
    if (!hold) read_device();
}

void World::ask_panels(ByteView wire, std::uint64_t connection) {
    const Bytes adu = understood(plan_.settings.serial, wire);
    for (Panel& panel : panels_) {
        if (panel.takes(adu)) panel.hear(adu, connection);
    }
}

bool World::is_dead(std::uint8_t station) const {
    if (station == 0) return false;
    return std::ranges::all_of(panels_,
                               [&](const Panel& p) { return p.id() != station || p.is_dead(); });
}

void World::every_so_often(double per_second, const std::function<void()>& happen) {
    if (per_second <= 0) return;
    const auto mean = std::chrono::duration<double>(1 / per_second);
    const Duration wait = random_.between(0us, std::chrono::duration_cast<Duration>(2 * mean));
    agenda_.at(now() + wait, [this, per_second, happen] {
        if (is_over()) return;
        happen();
        every_so_often(per_second, happen);
    });
}

/// Gone for a while; or back at once, and what the panels are saying is heard on the new way (a
/// device server whose connection was cut, a hang-up).
void World::lose_line() {
    if (!wire_.is_up() || asleep_) return;
    const bool handover = random_.chance(plan_.line.handover);
    if (!handover) wire_.forget_connection();
    take_down(handover ? random_.between(0us, Duration(20ms))
                       : random_.between(10ms, Duration(2s)));
}

void World::take_down(Duration pause) {
    if (!wire_.is_up()) return;
    agenda_.tell("the line goes down");
    wire_.go_down();
    checker_.on_line_down(now());
    subject_.on_line_down(now());
    drain();
    // Where nothing gets through, no connection is made either, but to one that hangs.
    const TimePoint open = plan_.line.hangs ? TimePoint{} : wire_.stalled_until() + 1us;
    const TimePoint back = std::max(now() + pause, open);
    agenda_.at(back, [this] {
        reach([this] {
            agenda_.tell("the line is up");
            wire_.come_up();
            checker_.on_line_up(now());
            subject_.on_line_up(now());
        });
    });
}

void World::stall() {
    if (now() < wire_.stalled_until()) return;
    checker_.on_stall(now());
    agenda_.tell("the line stalls");
    const TimePoint until = now() + random_.between(300ms, Duration(4s));
    agenda_.at(until, [this] {
        checker_.on_stall(now());
        agenda_.tell("the line goes on");
    });
    wire_.stall(until);
}

void World::pause() {
    if (asleep_) return;
    asleep_ = true;
    asleep_from_ = now();
    agenda_.tell("the process stops");
    agenda_.at(now() + random_.between(100ms, Duration(5s)), [this] { resume(); });
}

/// All that has come is handed in before the clock is.
void World::resume() {
    asleep_ = false;
    checker_.on_paused(asleep_from_, now());
    agenda_.tell("the process goes on, with", unread_);
    if (!unread_.empty()) checker_.on_heard(now(), unread_.size());
    read_device();
    subject_.on_deadline(now());
    drain();
    for (const auto& call : std::exchange(uncalled_, {})) reach(call);
}

}  // namespace panelgate::scenario
