#include "voice.hpp"

#include <utility>

#include "speech.hpp"

namespace panelgate::scenario {

Duration Voice::time_of(std::size_t bytes) const { return wire_time(line_.serial, bytes); }

Said Voice::said(Bytes bytes) const {
    Said s;
    s.bytes = std::move(bytes);
    s.rate = plan_.own_rate;
    s.station = plan_.id;
    return s;
}

Bytes Voice::random_bytes(unsigned least, unsigned most) {
    Bytes bytes;
    for (unsigned i = random_.between(least, most); i > 0; --i)
        bytes.push_back(static_cast<std::uint8_t>(random_.next()));
    return bytes;
}

std::uint8_t Voice::glitch() { return random_.chance(0.5) ? 0x00 : 0xFF; }

std::vector<Utterance> Voice::speak(const Bytes& reply_pdu, Duration spare) {
    std::vector<Utterance> all;
    const Bytes good = spoken(line_.serial, plan_.id, reply_pdu, plan_.crc_order);
    add_preface(all, reply_pdu, spare);
    // Behind a piece that could be this reply, the reply is a frame of its own.
    const bool first = all.empty() || all.back().said.answer_to == 0;
    all.push_back({first ? Duration{} : silent_interval(line_.serial), main_part(reply_pdu, good)});
    add_epilogue(all, reply_pdu, good);
    return all;
}

/// What goes before the reply. It has to end in time: see `spare`.
void Voice::add_preface(std::vector<Utterance>& all, const Bytes& reply, Duration spare) {
    const Bytes good = spoken(line_.serial, plan_.id, reply, plan_.crc_order);
    const Duration frame = time_of(good.size());
    if (random_.chance(plan_.fragment)) {
        const Duration pause = random_.between(1ms, 30ms);
        if (pause + 2 * frame < spare) {
            // Then silence: the pause in front of the next piece is put behind this one.
            constexpr std::ptrdiff_t kAsciiHead = 5;  // ':', address and function
            const auto head_size = line_.serial.mode == SerialMode::ascii ? kAsciiHead : 2;
            Said head = said(Bytes(good.begin(), good.begin() + head_size));
            all.push_back({Duration{}, std::move(head)});
            all.push_back({pause, said({})});
        }
    }
    if (random_.chance(plan_.noise)) all.push_back({Duration{}, said(random_bytes(1, 5))});
    if (random_.chance(plan_.foreign)) {
        all.push_back({Duration{}, said(spoken(line_.serial,
                                               static_cast<std::uint8_t>(plan_.id + 100), reply))});
        all.push_back({silent_interval(line_.serial), said({})});
    }
    if (random_.chance(plan_.damaged_first) && 2 * frame + 60ms < spare) {
        Bytes bad = good;
        bad[2 + random_.below(static_cast<unsigned>(bad.size()) - 2)] ^=
            static_cast<std::uint8_t>(1u << random_.below(8));
        all.push_back({Duration{}, said(std::move(bad))});
        all.back().said.damaged = true;
        all.push_back({60ms, said({})});
    }
}

/// The reply itself, with what clings to it.
Said Voice::main_part(const Bytes& reply, const Bytes& good) {
    const bool other = random_.chance(plan_.wrong_id);
    const Bytes meant =
        other ? spoken(line_.serial, static_cast<std::uint8_t>(plan_.id + 101), reply) : good;
    Bytes frame = damage(meant);
    bool damaged = frame != meant;
    bool whole = frame == good;
    if (random_.chance(plan_.padded_inside)) {
        Bytes longer = reply;
        longer.insert(longer.end(), {0, 0});
        if (random_.chance(0.5) && reply[0] < 5)
            longer[1] = static_cast<std::uint8_t>(longer[1] + 2);
        frame = spoken(line_.serial, plan_.id, longer, plan_.crc_order);
        whole = damaged = false;
    }
    Said s = said({});
    if (random_.chance(plan_.glitch_before)) s.bytes.push_back(glitch());
    const std::size_t from = s.bytes.size();
    s.bytes.insert(s.bytes.end(), frame.begin(), frame.end());
    s.damaged = damaged;
    if (whole) {
        s.answer_from = from;
        s.answer_to = s.bytes.size();
    }
    if (frame.size() > 1 && random_.chance(plan_.hole)) {
        s.hole_before = from + random_.between(1, static_cast<unsigned>(frame.size()) - 1);
        s.hole = random_.between(0us, plan_.hole_limit);
    }
    if (random_.chance(plan_.padded_behind)) s.bytes.insert(s.bytes.end(), {0, 0});
    if (random_.chance(plan_.glitch_behind)) s.bytes.push_back(glitch());
    return s;
}

/// What a second panel with this address says: other values.
Bytes Voice::of_another(Bytes reply) const {
    constexpr std::uint8_t kReads = 4;
    for (std::size_t i = 2; reply[0] <= kReads && i < reply.size(); ++i) reply[i] ^= 0x5A;
    return spoken(line_.serial, plan_.id, reply, plan_.crc_order);
}

void Voice::add_epilogue(std::vector<Utterance>& all, const Bytes& reply, const Bytes& good) {
    if (random_.chance(plan_.duplicate)) {
        Said copy = said(plan_.duplicate_differs ? of_another(reply) : good);
        copy.copy = !plan_.duplicate_differs;
        // Always about as much later: what has been seen once can be waited for.
        all.push_back({plan_.duplicate_delay * random_.between(85, 100) / 100, std::move(copy)});
    }
    if (random_.chance(plan_.tail))
        all.push_back({random_.between(500us, Duration(5ms)), said(random_bytes(1, 3))});
}

/// Damage that a CRC-16 always detects: up to three bits, or a missing end; an LRC only one bit, or
/// one character. What they let pass (one of 65536 or 256 of anything else) is no arbiter's affair.
Bytes Voice::damage(Bytes adu) {
    const bool ascii = line_.serial.mode == SerialMode::ascii;
    if (random_.chance(plan_.flip)) {
        if (ascii && random_.chance(0.5)) {  // a character is lost
            const auto lost = random_.below(static_cast<unsigned>(adu.size()));
            adu.erase(adu.begin() + static_cast<std::ptrdiff_t>(lost));
            return adu;
        }
        const unsigned most = ascii ? 1 : 3;
        for (unsigned i = random_.between(1, most); i > 0; --i) {
            adu[random_.below(static_cast<unsigned>(adu.size()))] ^=
                static_cast<std::uint8_t>(1u << random_.below(8));
        }
    }
    if (random_.chance(plan_.truncate))
        adu.resize(random_.between(1, static_cast<unsigned>(adu.size()) - 1));
    return adu;
}

Said Voice::text() {
    Bytes text;
    while (text.size() < 40) text.push_back(static_cast<std::uint8_t>(random_.between(' ', '~')));
    Said s = said(std::move(text));
    s.station = 0;
    return s;
}

}  // namespace panelgate::scenario
