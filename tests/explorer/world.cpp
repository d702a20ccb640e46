// What happens in a small world.

#include "world.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::explorer {
namespace {

constexpr std::size_t kFirstBytes = 3;
/// Between the end of all that is asked of it and a panel's first byte, at least.
const Duration kCharacter = character_time(small_settings().serial);

Duration wire(std::size_t bytes) { return static_cast<int>(bytes) * kCharacter; }

}  // namespace

World::World(const Rules& rules, const arbiter::Settings& told, Flaw flaw)
    : rules_(&rules), subject_(told, flaw) {
    judge_.on_line(now_);
    subject_.on_line_up(now_);
    drain();
    advance(now_ + 100ms);  // as a BusScript does
}

void World::play(Move move) {
    was_half_ = move.verb == Verb::half;
    if (is_fault(move.verb)) ++faults_;
    switch (move.verb) {
        case Verb::submit:
            submit(rules_->wishes[move.which]);
            break;
        case Verb::leave:
            leave(move.which);
            break;
        case Verb::deadline:
            advance(*subject_.next_deadline());
            break;
        case Verb::half:
            advance(now_ + half_way());
            break;
        case Verb::lost:
            replies_[move.which].pop_front();
            break;
        case Verb::reply:
        case Verb::rest:
        case Verb::damaged:
        case Verb::cut:
        case Verb::hole:
        case Verb::behind_header:
        case Verb::behind_glitch:
            deliver(move.verb, move.which);
            break;
        case Verb::partial_echo:
        case Verb::header:
        case Verb::glitch:
            noise(move.verb);
            break;
        case Verb::line_blinks:
            blink(true);
            break;
        case Verb::line_lost:
            blink(false);
            break;
    }
}

void World::run_on() {
    advance(now_ + kDeadline + 1ms);
    if (!judge_.open().empty()) judge_.fail("P3: never answered");
    if (!subject_.arbiter().idle()) judge_.fail("P3: all is answered, but it is not idle");
}

void World::submit(const Wish& wish) {
    Judge::Open open{.wish = wish, .submitted = now_};
    if (wish.write) open.value = ++writes_;
    Writer pdu;
    pdu.u8(wish.write ? 6 : 3).u16(wish.address).u16(wish.write ? open.value : wish.count);
    arbiter::Job job{.station = wish.station,
                     .request = test::request_of(pdu.take()),
                     .client = wish.client,
                     .priority = wish.write ? PriorityClass::write : PriorityClass::read};
    note({.verb = test::BusStep::Verb::submit,
          .station = wish.station,
          .bytes = job.request.pdu(),
          .client = wish.client,
          .priority = job.priority});
    const auto ticket = subject_.submit(now_, std::move(job));
    if (ticket) {
        open.ticket = *ticket;
        judge_.on_accepted(open);
    }
    drain();
}

void World::leave(std::uint8_t client) {
    note({.verb = test::BusStep::Verb::cancel, .client = client});
    gone_ = static_cast<std::uint8_t>(gone_ | 1u << client);
    judge_.on_gone(client);
    subject_.cancel(now_, client);
    drain();
}

void World::deliver(Verb verb, std::uint8_t station) {
    Replies& waiting = replies_[station];
    advance(std::max(now_, ready(waiting.front())));
    if (waiting.empty()) return;
    Reply& reply = waiting.front();
    Bytes adu = bytes_of(reply);
    adu.erase(adu.begin(), adu.begin() + reply.passed);
    if (verb == Verb::hole || verb == Verb::cut) adu.resize(kFirstBytes);
    if (verb == Verb::damaged) adu[kFirstBytes] ^= 0x10;
    if (verb == Verb::behind_header) adu.insert(adu.begin(), {station, adu[1]});
    if (verb == Verb::behind_glitch) adu.insert(adu.begin(), 0);
    const Reply was = reply;
    pass_on(was.asked);
    const Judge::Opens before = judge_.open();
    const bool must_do = is_the_answer(was) && verb != Verb::damaged && verb != Verb::cut;
    if (must_do) {
        const Duration needed = std::max(known_[station].needed, now_ - was.asked);
        known_[station] = {.needed = needed};
    }
    if (verb == Verb::hole) {
        reply.passed = kFirstBytes;
    } else {
        waiting.pop_front();
    }
    say(adu);
    // What may stand in the data of another frame is taken when a silence has ended that.
    if (verb == Verb::behind_header) advance(now_ + silent_interval(small_settings().serial));
    const bool waits = std::ranges::any_of(
        judge_.open(), [&](const Judge::Open& open) { return is_asked(open, was); });
    begun_ = verb == Verb::hole && must_do && waits;
    begun_at_ = now_;
    if (verb != Verb::hole && must_do) check_answered(was, before);
}

/// The way to the wire keeps the order of what it holds back.
void World::pass_on(TimePoint asked) {
    for (Replies& waiting : replies_) {
        for (Reply& reply : waiting) {
            if (reply.asked <= asked && reply.reached == TimePoint{}) reply.reached = now_;
        }
    }
}

/// The one reply to the one request that is out begins in time, or goes on after a hole that is to
/// be waited for, and nothing else was heard.
bool World::is_the_answer(const Reply& reply) const {
    const bool alone = replies_[reply.adu[0]].size() == 1;
    const bool last = reply.adu == last_sent_ && reply.asked == judge_.sent_until();
    if (!alone || !last || reply.probe) return false;
    if (reply.passed > 0) return is_in_hole();
    return clean_ && now_ < reply.asked + patience(reply);
}

/// The first silence costs a timeout, each further one no more than the panel has ever needed (P4).
Duration World::patience(const Reply& reply) const {
    const Known& known = known_[reply.adu[0]];
    return known.silent && known.needed > Duration::zero() ? known.needed : kTimeout;
}

/// Somebody must have got it. While nobody knows whether the line hears itself, what may be the
/// echo of a write confirms nothing.
void World::check_answered(const Reply& reply, const Judge::Opens& before) {
    const bool echo = subject_.arbiter().echo() != EchoState::absent;
    if (reply.adu[1] != 3 && echo) return;
    bool asked = false;
    for (const Judge::Open& open : before) {
        if (!is_asked(open, reply)) continue;
        if (!judge_.is_open(open.ticket)) return;
        asked = true;
    }
    if (asked) judge_.fail("P5: a good reply in time was not taken");
}

/// This request went out with the one that is replied to.
bool World::is_asked(const Judge::Open& open, const Reply& reply) {
    const Wish& wish = open.wish;
    const unsigned first = reply.adu[2] * 256u + reply.adu[3];
    const unsigned end = first + (reply.adu[1] == 3 ? reply.adu[5] : 1u);
    return open.sent && open.covers(reply.adu[0], reply.adu[1], wish.address) &&
           wish.address >= first && wish.address + unsigned{wish.count} <= end;
}

void World::noise(Verb verb) {
    const std::uint8_t station = last_sent_[0] == 0 ? 1 : last_sent_[0];
    const std::uint8_t function = last_sent_[1] == 0 ? 3 : last_sent_[1];
    if (verb == Verb::partial_echo) {
        advance(std::max(now_, last_start_ + wire(kFirstBytes)));
        return hear(ByteView(last_sent_).first(kFirstBytes));
    }
    if (!rules_->full_duplex) advance(std::max(now_, judge_.sent_until() + kCharacter));
    if (verb == Verb::header) return hear(Bytes{station, function});
    hear(Bytes{0});
}

/// What the line had not taken whole is not sent; what the panels have is answered, if it `keeps`.
void World::blink(bool keeps) {
    for (Replies& waiting : replies_) {
        if (!keeps) waiting.clear();
        if (!waiting.empty() && waiting.front().passed > 0) waiting.pop_front();
        while (!waiting.empty() && waiting.back().asked > now_) waiting.erase(&waiting.back());
    }
    clean_ = begun_ = false;
    note({.verb = test::BusStep::Verb::line_down});
    subject_.on_line_down(now_);
    drain();
    judge_.on_line(now_);
    note({.verb = test::BusStep::Verb::line_up});
    subject_.on_line_up(now_);
    drain();
}

/// A driver sees the beginning before the end.
void World::say(ByteView bytes) {
    hear(bytes.first(1));
    advance(now_ + wire(bytes.size() - 1));
    hear(bytes.subspan(1));
}

void World::hear(ByteView bytes) {
    note({.verb = test::BusStep::Verb::hear, .bytes = Bytes(bytes.begin(), bytes.end())});
    clean_ = begun_ = false;
    judge_.on_heard(now_);
    if (rules_->stalls) judge_.on_taken(now_);
    subject_.on_rx(now_, bytes);
    drain();
}

void World::advance(TimePoint to) {
    note({.verb = test::BusStep::Verb::run_for, .span = to - now_});
    constexpr int kSpins = 10;
    int spins = 0;
    while (judge_.violation().empty()) {
        const auto next = subject_.next_deadline();
        if (!next || *next > to) break;
        spins = *next > now_ ? 0 : spins + 1;
        if (spins > kSpins) return judge_.fail("P9: its deadline does not move");
        now_ = std::max(now_, *next);
        serve();
        subject_.on_deadline(now_);
        drain();
    }
    now_ = std::max(now_, to);
    serve();
    judge_.on_time(now_);
}

/// Panels take in what has reached them, in order; what is later than the late window never comes.
void World::serve() {
    for (std::uint8_t station = 1; station < replies_.size(); ++station) {
        Replies& waiting = replies_[station];
        for (Reply& reply : waiting) {
            if (reply.served != 0 || reply.asked > now_) continue;
            judge_.on_served(station, ByteView(reply.adu).subspan(1));
            reply.served = judge_.served(station);
        }
        while (!waiting.empty() && now_ > last_moment(waiting.front())) waiting.pop_front();
    }
}

void World::drain() {
    while (auto action = subject_.poll_action()) {
        std::visit([this](auto& a) { act(a); }, *action);
    }
    if (std::exchange(reset_, false)) blink(rules_->hangs);
}

void World::act(const arbiter::Transmit& transmit) {
    const TimePoint end = now_ + wire(transmit.adu.size());
    const bool probe = std::exchange(probing_, false);
    judge_.on_transmit(now_, transmit.adu, end, !probe);
    if (is_in_hole()) judge_.fail("P5: sent into a reply that had begun");
    std::copy_n(transmit.adu.begin(), last_sent_.size(), last_sent_.begin());
    last_start_ = now_;
    clean_ = true;
    begun_ = false;
    const std::uint8_t station = transmit.adu[0];
    if (station >= replies_.size() || replies_[station].full()) return;
    Known& known = known_[station];
    known.silent = std::exchange(known.unanswered, true);
    replies_[station].push_back({.adu = last_sent_, .asked = end, .probe = probe});
}

void World::act(const arbiter::Finish& finish) {
    const auto& opens = judge_.open();
    const auto open = std::ranges::find(opens, finish.ticket, &Judge::Open::ticket);
    const bool early = open != opens.end() && now_ < open->submitted + kDeadline && !open->gone;
    const bool its =
        early && open->sent && open->covers(last_sent_[0], last_sent_[1], open->wish.address);
    if (is_in_hole() && its && !finish.pdu)
        judge_.fail("P5: a reply that had begun was not waited for");
    judge_.on_finish(now_, finish);
}

void World::act(const arbiter::Note& note) {
    if (direction_of(note.kind) == FrameDirection::sent)
        probing_ = note.kind == FrameKind::probe || note.kind == FrameKind::learn_echo;
}

}  // namespace panelgate::explorer
