#include "panel.hpp"

#include <algorithm>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::scenario {
namespace {

std::uint16_t word(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] * 256 + bytes[at + 1]);
}

}  // namespace

Panel::Panel(const PanelPlan& plan, const arbiter::Settings& line, Random& random, Checker& checker)
    : plan_(plan), line_(line), random_(random), checker_(checker) {}

bool Panel::is_dead(TimePoint now) const {
    if (plan_.dead) return true;
    if (plan_.flapping <= Duration::zero()) return false;
    return (now.time_since_epoch() / plan_.flapping) % 2 == 1;
}

std::vector<Utterance> Panel::hear(TimePoint now, ByteView adu) {
    const ByteView pdu = adu.subspan(1, adu.size() - 3);
    if (is_dead(now)) return {};
    if (adu[0] == 0) {
        write(now, pdu);
        return {};
    }
    if (random_.chance(plan_.drop)) return {};
    const Duration gap = silent_interval(line_.serial);
    const Bytes reply = serve(now + gap, pdu);
    if (random_.chance(plan_.mute)) return {};

    std::vector<Utterance> said;
    TimePoint at = std::max(now + gap + think(), busy_until_);
    const auto say = [&](Bytes bytes, bool answer) {
        const Duration takes = wire_time(line_.serial, bytes.size());
        said.push_back({at, std::move(bytes), answer});
        at += takes;
    };
    if (random_.chance(plan_.noise)) {
        Bytes noise;
        for (unsigned i = random_.between(1, 5); i > 0; --i)
            noise.push_back(static_cast<std::uint8_t>(random_.next()));
        say(std::move(noise), false);
    }
    if (random_.chance(plan_.foreign)) {
        say(modbus::encode_adu(static_cast<std::uint8_t>(plan_.id + 100), reply), false);
        at += gap;
    }
    const Bytes good = modbus::encode_adu(plan_.id, reply);
    const bool other = random_.chance(plan_.wrong_id);
    Bytes frame =
        damage(other ? modbus::encode_adu(static_cast<std::uint8_t>(plan_.id + 101), reply) : good);
    const bool whole = frame == good;
    say(std::move(frame), whole);
    if (random_.chance(plan_.duplicate)) {
        at += random_.between(0us, gap);
        say(good, false);
    }
    busy_until_ = at + gap;
    return said;
}

Bytes Panel::serve(TimePoint now, ByteView pdu) {
    const auto exception = [&](std::uint8_t code) {
        checker_.on_exception(now, plan_.id);
        return Bytes{static_cast<std::uint8_t>(pdu[0] | 0x80), code};
    };
    if (random_.chance(plan_.exception)) return exception(6);
    if (pdu[0] > 4) {
        write(now, pdu);
        return {pdu.begin(), pdu.begin() + 5};
    }
    if (word(pdu, 3) > plan_.max_registers) return exception(3);
    checker_.on_served(now, plan_.id);
    ++served_;
    return read(pdu);
}

Bytes Panel::read(ByteView pdu) {
    Writer out;
    out.u8(pdu[0]).u8(2u * word(pdu, 3));
    for (unsigned i = 0; i < word(pdu, 3); ++i) {
        const auto address = static_cast<std::uint16_t>(word(pdu, 1) + i);
        out.u16(address >= kMemory ? cells_.at(address - kMemory)
                                   : moving_value(plan_.id, pdu[0], address, served_));
    }
    return out.take();
}

void Panel::write(TimePoint now, ByteView pdu) {
    checker_.on_executed(now, plan_.id, pdu);
    if (pdu[0] == 5) return;
    const unsigned count = pdu[0] == 16 ? word(pdu, 3) : 1;
    for (unsigned i = 0; i < count; ++i)
        cells_.at(word(pdu, 1) + i - kMemory) = word(pdu, pdu[0] == 16 ? 6 + 2 * i : 3);
}

Duration Panel::think() {
    if (!random_.chance(plan_.late)) return plan_.think;
    const double most = plan_.late_limit - 0.5;
    const double timeouts = 0.5 + most * random_.share();
    return Duration(static_cast<Duration::rep>(
               static_cast<double>(line_.unlisted.response_timeout.count()) * timeouts)) -
           silent_interval(line_.serial);
}

/// Damage that a CRC-16 always detects: up to three bits, or a missing end. What it lets pass (one
/// of 65536 of anything else) is no arbiter's affair.
Bytes Panel::damage(Bytes adu) {
    if (random_.chance(plan_.flip)) {
        for (unsigned i = random_.between(1, 3); i > 0; --i) {
            adu[random_.below(static_cast<unsigned>(adu.size()))] ^=
                static_cast<std::uint8_t>(1u << random_.below(8));
        }
    }
    if (random_.chance(plan_.truncate))
        adu.resize(random_.between(1, static_cast<unsigned>(adu.size()) - 1));
    return adu;
}

}  // namespace panelgate::scenario
