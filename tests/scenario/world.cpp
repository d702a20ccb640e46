#include "world.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scenario {

World::World(const Plan& plan, Subject& subject, Checker& checker)
    : plan_(plan), subject_(subject), checker_(checker), random_(plan.seed ^ 0x5EED) {
    for (const PanelPlan& panel : plan_.panels)
        panels_.emplace_back(panel, plan_.settings, random_, checker_);
    for (const ClientPlan& client : plan_.clients) customers_.push_back({client, 0, 0});
}

void World::at(TimePoint when, std::function<void()> happen) {
    events_.push({when, ++order_, std::move(happen)});
}

void World::run() {
    up_ = true;
    started_ = now_;
    checker_.on_line(now_);
    subject_.on_line_up(now_);
    drain();
    for (std::size_t i = 0; i < customers_.size(); ++i) {
        become(customers_[i]);
        for (unsigned k = 0; k < customers_[i].plan.in_flight; ++k) at(now_, [this, i] { ask(i); });
    }
    if (plan_.idle_noise > 0) at(now_ + 1s, [this] { make_noise(); });
    if (plan_.line_losses > 0) at(now_ + 1s, [this] { lose_line(); });
    while (!checker_.failed() && step()) {
    }
    if (checker_.failed()) return;
    const auto dead = [&](const PanelPlan& p) { return p.dead; };
    checker_.at_end(now_, std::ranges::any_of(plan_.panels, dead));
}

/// One event, or one deadline of the arbiter. False when nothing is left to happen.
bool World::step() {
    const auto deadline = subject_.next_deadline();
    const bool asked = !asked_by_.empty();
    if (!asked && (events_.empty() || is_over())) return false;
    if (deadline && (events_.empty() || *deadline < events_.top().at)) {
        spins_ = *deadline > now_ ? 0 : spins_ + 1;
        if (spins_ > 1000) checker_.on_spin();
        now_ = std::max(now_, *deadline);
        subject_.on_deadline(now_);
    } else if (!events_.empty()) {
        const Event event = events_.top();
        events_.pop();
        now_ = event.at;
        event.happen();
    } else {
        return false;
    }
    drain();
    return true;
}

void World::tell(const std::string& what, ByteView bytes) {
    if (!keeps_history_) return;
    constexpr std::size_t kKept = 80;
    const auto us = (now_ - started_) / 1us;
    history_.push_back(std::to_string(us) + " us  " + what + "  " + to_hex(bytes));
    if (history_.size() > kKept) history_.pop_front();
}

std::string World::history() const {
    std::string text;
    for (const std::string& line : history_) text += "  " + line + '\n';
    return text;
}

void World::drain() {
    while (auto action = subject_.poll_action(now_)) {
        std::visit([this](const auto& a) { act(a); }, *action);
    }
}

void World::act(const arbiter::Note& note) {
    if (note.direction == arbiter::Note::Direction::sent) what_next_ = note.what;
}

void World::act(const arbiter::Transmit& transmit) {
    tell("sent, " + std::string(what_next_), transmit.adu);
    checker_.on_transmit(now_, transmit.adu, what_next_ == "probe");
    const FramePtr frame = put_on_wire(transmit.adu, true, false);
    if (plan_.echo) {
        if (random_.chance(plan_.damaged_echo)) {
            const auto heard = std::make_shared<Frame>(*frame);
            heard->bytes[random_.below(static_cast<unsigned>(heard->bytes.size()))] ^= 0x10;
            deliver_in_chunks(heard);
        } else {
            deliver_in_chunks(frame);
        }
    }
    at(frame->end, [this, frame] { on_request_left(frame); });
}

World::FramePtr World::put_on_wire(Bytes bytes, bool ours, bool answer) {
    auto frame = std::make_shared<Frame>();
    frame->start = now_;
    frame->end = now_ + wire_time(plan_.settings.serial, bytes.size());
    frame->bytes = std::move(bytes);
    frame->ours = ours;
    frame->answer = answer;
    std::erase_if(air_, [&](const FramePtr& other) { return other->end <= now_; });
    for (const FramePtr& other : air_) {
        if (!other->garbled_from) other->garbled_from = now_;
        frame->garbled_from = now_;
    }
    air_.push_back(frame);
    return frame;
}

/// Bytes reach the gateway in the pieces of a receive FIFO, each when its last byte is there; what
/// an adapter holds back for longer than 15 ms looks like the end of the frame to anybody.
void World::deliver_in_chunks(const FramePtr& frame) {
    const auto most = static_cast<unsigned>(15ms / character_time(plan_.settings.serial));
    std::size_t from = 0;
    while (from < frame->bytes.size()) {
        const auto left = static_cast<unsigned>(frame->bytes.size() - from);
        const std::size_t to = from + random_.between(1, std::min(left, most));
        at(frame->start + wire_time(plan_.settings.serial, to),
           [this, frame, from, to, life = life_] {
               if (life == life_) deliver(frame, from, to);
           });
        from = to;
    }
}

void World::deliver(const FramePtr& frame, std::size_t from, std::size_t to) {
    if (frame->garbled_from) {
        // Something else than what was said; never a good frame by chance.
        for (std::size_t i = from; i < to; ++i) {
            const TimePoint end = frame->start + wire_time(plan_.settings.serial, i + 1);
            if (end > *frame->garbled_from)
                frame->bytes[i] = static_cast<std::uint8_t>(random_.next());
        }
        const bool last = to == frame->bytes.size();
        if (last && frame->bytes.size() > 3 && modbus::crc_ok(frame->bytes))
            frame->bytes.back() ^= 1;
    }
    const bool whole = to == frame->bytes.size() && frame->answer && !frame->garbled_from;
    if (whole) {
        checker_.on_answered(now_);
    } else {
        checker_.on_heard(now_);
    }
    tell(whole ? "heard, the answer's end" : "heard",
         ByteView(frame->bytes).subspan(from, to - from));
    subject_.on_rx(now_, ByteView(frame->bytes).subspan(from, to - from));
}

void World::on_request_left(const FramePtr& frame) {
    if (frame->garbled_from) return;
    for (Panel& panel : panels_) {
        if (frame->bytes[0] != 0 && panel.id() != frame->bytes[0]) continue;
        for (Utterance& said : panel.hear(now_, frame->bytes)) {
            at(said.at, [this, said = std::move(said), life = life_] {
                if (life == life_) deliver_in_chunks(put_on_wire(said.bytes, false, said.answer));
            });
        }
    }
}

void World::make_noise() {
    if (is_over()) return;
    Bytes noise;
    for (unsigned i = random_.between(1, 6); i > 0; --i)
        noise.push_back(static_cast<std::uint8_t>(random_.next()));
    if (up_) deliver_in_chunks(put_on_wire(std::move(noise), false, false));
    at(now_ + random_.between(100ms, Duration(10s)), [this] { make_noise(); });
}

void World::lose_line() {
    if (is_over()) return;
    if (up_) reset_line();
    at(now_ + random_.between(5s, 60s), [this] { lose_line(); });
}

/// Down now, and up again some time later.
void World::reset_line() {
    up_ = false;
    ++life_;
    air_.clear();
    subject_.on_line_down(now_);
    at(now_ + random_.between(10ms, 2s), [this] {
        up_ = true;
        checker_.on_line(now_);
        subject_.on_line_up(now_);
    });
}

void World::become(Customer& customer) {
    customer.id = ++last_client_;
    const auto can_fail = [&](std::uint8_t id) {
        return std::ranges::any_of(plan_.panels, [&](const PanelPlan& panel) {
            return panel.id == id && (panel.dead || panel.flapping > Duration::zero());
        });
    };
    checker_.on_client(customer.id, std::ranges::none_of(customer.plan.stations, can_fail));
}

void World::ask(std::size_t index) {
    if (is_over()) return;
    Customer& customer = customers_[index];
    arbiter::Job job;
    const unsigned writes = last_write_;
    job.pdu = draw_request(customer, job.station);
    job.client = customer.id;
    const bool read = modbus::is_pure_read(job.pdu);
    job.priority = !read                 ? arbiter::PriorityClass::write
                   : customer.plan.polls ? arbiter::PriorityClass::poll
                                         : arbiter::PriorityClass::read;
    const std::size_t before = subject_.queue_depth();
    const auto ticket = subject_.submit(now_, job);
    checker_.on_queue_depth(before, subject_.queue_depth());
    if (!ticket) {
        // Refused at once: it comes again after a pause, not in the same instant. The number of
        // the write is free again: there are 65536.
        last_write_ = writes;
        at(now_ + random_.between(1ms, 50ms), [this, index] { ask(index); });
        return;
    }
    tell("request " + std::to_string(*ticket) + " of client " + std::to_string(job.client) +
             " to station " + std::to_string(job.station),
         job.pdu);
    checker_.on_accepted(now_, *ticket, job);
    asked_by_[*ticket] = index;
    ++customer.open;
    drain();
}

Bytes World::draw_request(const Customer& customer, std::uint8_t& station) {
    if (random_.chance(customer.plan.broadcasts)) {
        station = 0;
        return draw_write();
    }
    const auto& stations = customer.plan.stations;
    station = stations[random_.below(static_cast<unsigned>(stations.size()))];
    if (random_.chance(customer.plan.writes)) return draw_write();
    const unsigned function = random_.chance(0.8) ? 3 : 4;
    if (random_.chance(0.3)) {
        return Writer()
            .u8(3)
            .u16(kMemory + random_.below(kMemoryCells))
            .u16(random_.between(1, 2))
            .take();
    }
    // Few addresses, so that reads are equal, contained and adjacent often.
    return Writer().u8(function).u16(10 * random_.below(12)).u16(random_.between(1, 20)).take();
}

/// Every write is another one, so that one that comes twice is seen.
Bytes World::draw_write() {
    const unsigned id = ++last_write_;
    const unsigned cell = kMemory + random_.below(kMemoryCells);
    if (random_.chance(0.4)) return Writer().u8(5).u16(id & 0xFFFF).u16(0xFF00).take();
    if (random_.chance(0.5)) return Writer().u8(6).u16(cell).u16(id & 0xFFFF).take();
    return Writer().u8(16).u16(cell).u16(2).u8(4).u16(id & 0xFFFF).u16(~id & 0xFFFF).take();
}

void World::act(const arbiter::Finish& finish) {
    tell("answer " + std::to_string(finish.ticket) +
             (finish.pdu ? "" : " " + std::string(outcome_label(finish.pdu.error()))),
         finish.pdu ? *finish.pdu : Bytes{});
    checker_.on_finish(now_, finish);
    const auto found = asked_by_.find(finish.ticket);
    if (found == asked_by_.end()) return;
    const std::size_t index = found->second;
    asked_by_.erase(found);
    on_answer(index);
}

void World::on_answer(std::size_t index) {
    Customer& customer = customers_[index];
    --customer.open;
    if (is_over()) return;
    const TimePoint next = now_ + random_.between(0us, customer.plan.pause);
    if (!random_.chance(customer.plan.vanish)) {
        at(next, [this, index] { ask(index); });
        return;
    }
    at(now_, [this, index] {
        Customer& gone = customers_[index];
        const arbiter::Client left = std::exchange(gone.id, 0);
        become(gone);
        subject_.cancel(now_, left);
        drain();
        checker_.on_client_gone(left);
    });
    at(next, [this, index] { ask(index); });
}

}  // namespace panelgate::scenario
