// What may happen next in a small world, which states of it are the same, and its words.

#include <algorithm>
#include <initializer_list>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "world.hpp"

namespace panelgate::explorer {
namespace {

const Duration kCharacter = character_time(small_settings().serial);
const Duration kGap = silent_interval(small_settings().serial);

class Hash {
  public:
    template <class... T>
    void add(T... values) {
        (mix(static_cast<std::uint64_t>(values)), ...);
    }
    /// How long ago, at most `limit`; negative when it is to come.
    void add_age(TimePoint now, TimePoint at, Duration limit) {
        add(std::min(now - at, limit).count());
    }
    std::uint64_t value() const { return state_ ^ state_ >> 29; }

  private:
    void mix(std::uint64_t value) {
        state_ = (state_ ^ value) * 0x9E3779B97F4A7C15u;
        state_ ^= state_ >> 32;
    }
    std::uint64_t state_ = 0xCBF29CE484222325u;
};

}  // namespace

bool World::allows(Verb verb) const {
    return (rules_->verbs & bit(verb)) != 0 && (!is_fault(verb) || faults_ < rules_->faults);
}

/// A panel answers no sooner than the gap after the request, and on a pair of wires not while
/// another one is leaving.
TimePoint World::ready(const Reply& reply) const {
    const TimePoint own = reply.asked + kGap + kCharacter;
    return rules_->full_duplex ? own : std::max(own, judge_.sent_until() + kCharacter);
}

Bytes World::bytes_of(const Reply& reply) const {
    Writer pdu;
    pdu.u8(reply.adu[1]);
    if (reply.adu[1] == 3) {
        pdu.u8(2u * reply.adu[5]);
        for (unsigned i = 0; i < reply.adu[5]; ++i)
            pdu.u16(value_of(reply.adu[3] + i, reply.served));
    } else {
        pdu.raw(ByteView(reply.adu).subspan(2));
    }
    return modbus::encode_adu(reply.adu[0], pdu.take());
}

TimePoint World::last_moment(const Reply& reply) const {
    if (!rules_->stalls) return reply.asked + kTimeout + kLateWindow;
    const bool held = reply.reached == TimePoint{};
    return held ? TimePoint::max() : reply.reached + kTimeout + kLateWindow;
}

bool World::comes_in_time(const Reply& reply) const {
    const std::size_t size = reply.adu[1] == 3 ? 5 + std::size_t{2} * reply.adu[5] : 8;
    const TimePoint end = std::max(now_, ready(reply)) + static_cast<int>(size) * kCharacter;
    return end <= last_moment(reply);
}

Duration World::half_way() const {
    const auto next = subject_.next_deadline();
    return next ? std::min((*next - now_) / 2, kTimeout / 2) : kTimeout / 2;
}

World::Moves World::moves() const {
    Moves moves;
    add_submits(moves);
    add_replies(moves);
    add_noise(moves);
    for (const Verb verb : {Verb::line_blinks, Verb::line_lost}) {
        if (allows(verb)) moves.push_back({verb, 0});
    }
    const auto next = subject_.next_deadline();
    if (next) moves.push_back({Verb::deadline, 0});
    if (allows(Verb::half) && !was_half_ && half_way() > 4ms) moves.push_back({Verb::half, 0});
    return moves;
}

void World::add_submits(Moves& moves) const {
    const auto open_of = [this](std::uint8_t client) {
        return std::ranges::count_if(
            judge_.open(), [&](const Judge::Open& open) { return open.wish.client == client; });
    };
    std::uint8_t seen = 0;
    for (std::uint8_t i = 0; i < rules_->wishes.size(); ++i) {
        const std::uint8_t client = rules_->wishes[i].client;
        if ((gone_ >> client & 1) != 0) continue;
        const auto open = static_cast<std::size_t>(open_of(client));
        if (open < rules_->open_per_client) moves.push_back({Verb::submit, i});
        const bool first = (seen >> client & 1) == 0;
        if (first && open > 0 && allows(Verb::leave)) moves.push_back({Verb::leave, client});
        seen = static_cast<std::uint8_t>(seen | 1u << client);
    }
}

void World::add_replies(Moves& moves) const {
    for (std::uint8_t station = 1; station < replies_.size(); ++station) {
        const Replies& waiting = replies_[station];
        if (waiting.empty()) continue;
        if (allows(Verb::lost)) moves.push_back({Verb::lost, station});
        if (!comes_in_time(waiting.front())) continue;
        if (waiting.front().passed > 0) {
            moves.push_back({Verb::rest, station});
            continue;
        }
        moves.push_back({Verb::reply, station});
        for (const Verb verb :
             {Verb::damaged, Verb::cut, Verb::hole, Verb::behind_header, Verb::behind_glitch}) {
            if (allows(verb)) moves.push_back({verb, station});
        }
    }
}

void World::add_noise(Moves& moves) const {
    const bool leaving = now_ < judge_.sent_until() + kGap;
    if (allows(Verb::partial_echo) && clean_ && leaving) moves.push_back({Verb::partial_echo, 0});
    if (allows(Verb::header)) moves.push_back({Verb::header, 0});
    if (allows(Verb::glitch)) moves.push_back({Verb::glitch, 0});
}

std::uint64_t World::digest() const {
    constexpr Duration kQuiet = 60ms;
    constexpr Duration kOwed = kTimeout + kLateWindow;
    const arbiter::Arbiter& arbiter = subject_.arbiter();
    Hash hash;
    const auto next = subject_.next_deadline();
    hash.add(next ? (*next - now_).count() : 1);
    hash.add_age(now_, judge_.sent_until(), kQuiet);
    hash.add_age(now_, judge_.heard_until(), kQuiet);
    hash.add_age(now_, last_start_, kOwed);
    hash.add(clean_, gone_, was_half_, begun_);
    if (begun_) hash.add_age(now_, begun_at_, kQuiet);
    for (const Judge::Open& open : judge_.open()) {
        hash.add(open.wish.client, open.wish.station, open.wish.address, open.wish.write, open.sent,
                 open.gone);
        hash.add_age(now_, open.submitted, kDeadline);
    }
    for (std::uint8_t station = 1; station < replies_.size(); ++station) {
        hash.add(replies_[station].size());
        for (const Reply& reply : replies_[station]) {
            hash.add(reply.adu[1], reply.adu[3], reply.passed);
            if (reply.adu[1] == 3) hash.add(reply.adu[5]);
            hash.add_age(now_, reply.asked, kOwed);
            if (rules_->stalls) hash.add_age(now_, reply.reached, kOwed);
        }
    }
    if (const auto inner = inner_digest(arbiter, now_)) {
        hash.add(*inner);
        return hash.value();
    }
    for (std::uint8_t station = 1; station < replies_.size(); ++station) {
        const arbiter::StationHealth health = arbiter.health(station);
        hash.add(health.state(), health.silent_in_a_row());
        if (health.offline()) hash.add_age(now_, health.next_probe(), 0ms);
        hash.add(arbiter.response_timeout(station).count());
    }
    hash.add(arbiter.queue_depth(), arbiter.echo(), prospect());
    return hash.value();
}

std::uint64_t World::prospect() const {
    constexpr int kDeadlines = 10;
    World ahead(*this);
    ahead.steps_ = nullptr;
    for (const Wish& wish : rules_->wishes) {
        if ((gone_ >> wish.client & 1) == 0 && !ahead.judge_.open().full()) ahead.submit(wish);
    }
    Hash hash;
    for (int i = 0; i < kDeadlines; ++i) {
        const auto next = ahead.subject_.next_deadline();
        if (!next) break;
        hash.add((*next - now_).count());
        ahead.advance(*next);
        hash.add_age(ahead.now_, ahead.last_start_, kTimeout);
        hash.add(ahead.last_sent_[0], ahead.last_sent_[3], ahead.judge_.open().size());
        for (const Judge::Open& open : ahead.judge_.open()) hash.add(open.wish.address, open.sent);
    }
    return hash.value();
}

std::string World::describe(Move move) const {
    const std::string station = "station " + std::to_string(move.which);
    switch (move.verb) {
        case Verb::submit: {
            const Wish& wish = rules_->wishes[move.which];
            return "client " + std::to_string(wish.client) + (wish.write ? " writes" : " reads") +
                   " register " + std::to_string(wish.address) + " of station " +
                   std::to_string(wish.station);
        }
        case Verb::leave:
            return "client " + std::to_string(move.which) + " leaves";
        case Verb::reply:
            return station + " answers";
        case Verb::rest:
            return "the rest of the reply of " + station;
        case Verb::deadline:
            return "time to the next deadline";
        case Verb::half:
            return "time, half-way to the next deadline";
        case Verb::lost:
            return "a reply of " + station + " never comes";
        case Verb::damaged:
            return station + " answers, one bit damaged";
        case Verb::cut:
            return station + " begins to answer, and no more";
        case Verb::hole:
            return station + " begins to answer, with a hole";
        case Verb::behind_header:
            return station + " answers behind what looks like a header";
        case Verb::behind_glitch:
            return station + " answers behind a glitch";
        case Verb::partial_echo:
            return "the first bytes of the request come back";
        case Verb::header:
            return "noise that looks like a header";
        case Verb::glitch:
            return "a glitch";
        case Verb::line_blinks:
            return "the line is lost and back; replies under way still come";
        case Verb::line_lost:
            return "the line is lost and back; replies under way do not come";
    }
    return {};
}

}  // namespace panelgate::explorer
