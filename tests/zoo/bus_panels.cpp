// What the panels of a bus, and those who speak without being asked, do.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bus.hpp"
#include "reply_shape.hpp"

namespace zoo {
namespace {

constexpr std::size_t kRing = 16;  // requests that a panel's receiver keeps while it thinks
constexpr std::size_t kWritesKept = 10000;
constexpr std::string_view kBootText = "\r\nBoot 1.07 (c) zoo\r\nRAM ok flash ok\r\n>\r";

bool is_long_read(const Bytes& pdu, double most) {
    const bool is_read = pdu[0] == 3 || pdu[0] == 4;
    return is_read && (pdu[3] << 8 | pdu[4]) > static_cast<int>(most);
}

bool is_ignored(const Habit* ignore, const Bytes& pdu) {
    return ignore != nullptr && Panel::is_write(pdu[0]) &&
           (pdu[1] << 8 | pdu[2]) == static_cast<int>(ignore->a);
}

}  // namespace

void Bus::on_frame(const Bytes& frame, const Character& last, bool is_ours) {
    const bool is_old = habits_[frame[0] % habits_.size()].always(Kind::crc_old) != nullptr;
    const bool is_good = has_good_crc(frame, is_old) && !(is_ours && is_lost_);
    if (is_ours) note(frame_start_, last.end, is_good ? "REQ" : "BAD", frame);
    if (!is_good) {
        ++counters_.bad;
        return;
    }
    if (is_ours) ++counters_.requests;
    const Bytes pdu(frame.begin() + 1, frame.end() - 2);
    if (frame[0] == 0) return on_broadcast(pdu, last.end);
    const auto found = stations_.find(frame[0]);
    if (found == stations_.end()) {
        ++counters_.unknown;
        return;
    }
    serve(frame[0], found->second, pdu, last.end);
    if (is_ours && cuts_next_) {
        cuts_next_ = false;
        far_end_->unplug();
        far_end_->plug();
    }
}

void Bus::on_broadcast(const Bytes& pdu, Time end) {
    ++counters_.broadcasts;
    for (auto& [unit, station] : stations_) {
        const Habits& habits = habits_[static_cast<std::size_t>(unit)];
        if (habits.always(Kind::dead) != nullptr || habits.is_rebooting(end)) continue;
        const Bytes reply = station.panel.execute(pdu);
        if (Panel::is_write(pdu[0])) writes_.push_back({end, 0, pdu});
        if (habits.always(Kind::broadcast_reply) != nullptr) {
            say_reply(unit, station, reply, end + think_time(habits, settings_.think, dice_));
        }
    }
}

// Whether it hears the request at all, and has room for it.
bool Bus::takes(const Habits& habits, Station& station, Time end) {
    if (habits.find(Kind::dead) != nullptr || habits.is_rebooting(end)) return false;
    while (!station.ring.empty() && station.ring.front() <= end) station.ring.pop_front();
    const std::size_t room = habits.always(Kind::no_ring) != nullptr ? 1 : kRing;
    return station.ring.size() < room;
}

void Bus::serve(int unit, Station& station, const Bytes& pdu, Time end) {
    Habits& habits = habits_[static_cast<std::size_t>(unit)];
    Served& served = station.panel.served();
    ++served.asked;
    habits.next();
    const Habit* most = habits.find(Kind::max_registers);
    const bool is_too_long = most != nullptr && is_long_read(pdu, most->a);
    if (!takes(habits, station, end) || (is_too_long && most->b < 1) ||
        is_ignored(habits.find(Kind::ignore), pdu)) {
        ++served.dropped;
        return;
    }
    const auto before = served.executed;
    Bytes reply = station.panel.execute(pdu);
    if (is_too_long) {
        reply = {static_cast<std::uint8_t>(pdu[0] | 0x80), static_cast<std::uint8_t>(most->b)};
    }
    if (served.executed != before) {
        writes_.push_back({end, unit, pdu});
        if (writes_.size() > kWritesKept) writes_.pop_front();
    }
    if (habits.find(Kind::mute) != nullptr) return;
    ++served.answered;
    const Time begin = std::max(end, station.free_at) + think_time(habits, settings_.think, dice_);
    say_reply(unit, station, reply, begin);
    station.ring.push_back(station.free_at);
}

void Bus::say_reply(int unit, Station& station, const Bytes& reply, Time begin) {
    const Habits& habits = habits_[static_cast<std::size_t>(unit)];
    const Habit* usb = habits.find(Kind::usb);
    ear_.set_latency(usb == nullptr ? 0 : milliseconds(usb->a));
    for (const Speech& s : shape_reply(habits, unit, reply, begin, wire_.character(), dice_)) {
        const Time end = wire_.say(s);
        if (s.is_reply) station.free_at = end;
        note(s.start, end, s.is_reply ? "RSP" : "ODD", s.bytes);
    }
}

void Bus::find_sources(Time at) {
    sources_.clear();
    other_asks_ = 0;
    bool has_noise = false;
    for (const auto& [unit, station] : stations_) {
        const Habits& habits = habits_[static_cast<std::size_t>(unit)];
        for (const Kind kind : {Kind::babble, Kind::noise, Kind::other_master}) {
            const Habit* h = habits.always(kind);
            if (h == nullptr || (kind == Kind::noise && has_noise)) continue;
            has_noise = has_noise || kind == Kind::noise;
            const Time period = std::max(milliseconds(h->a), kMillisecond);
            sources_.push_back({kind, unit, std::max(at, h->since) + period, period});
        }
        if (const Habit* h = habits.always(Kind::reboot)) {
            const Time cycle = milliseconds(1000 * (h->a + h->b));
            sources_.push_back({Kind::reboot, unit, h->since + milliseconds(1000 * h->a), cycle});
            while (sources_.back().next < at) sources_.back().next += cycle;
        }
    }
}

void Bus::fire(Source& source, Time at) {
    const Time period = source.period;
    source.next += source.kind == Kind::noise ? dice_.between(period / 2, period * 3 / 2) : period;
    source.next = std::max(source.next, at);
    if (source.kind == Kind::babble) {
        const Bytes frame = sealed(source.unit, {3, 2, dice_.byte(), dice_.byte()});
        speak({.start = at, .speaker = source.unit, .bytes = frame}, "ODD");
    } else if (source.kind == Kind::noise) {
        Bytes bytes(dice_.next() % 6 + 1);
        for (auto& b : bytes) b = dice_.byte();
        speak({.start = at, .speaker = kNoise, .bytes = bytes}, "ODD");
    } else if (source.kind == Kind::reboot) {
        const Bytes text(kBootText.begin(), kBootText.end());
        speak({.start = at, .speaker = source.unit, .bytes = text}, "ODD");
    } else {
        other_asks_ = source.unit;
    }
}

// Half a gap behind the end of a reply: it knows the line's protocol and is first.
void Bus::ask_as_other_master(Time at) {
    const auto address = static_cast<std::uint8_t>(dice_.next() % 100);
    const Bytes request = sealed(other_asks_, {3, 0, address, 0, 4});
    other_asks_ = 0;
    speak({.start = at + gap_ / 2, .speaker = kOtherMaster, .bytes = request}, "ODD");
}

}  // namespace zoo
