#include "reply_shape.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace zoo {
namespace {

std::uint8_t byte_of(double value) { return static_cast<std::uint8_t>(static_cast<int>(value)); }

Bytes frame_of(const Habits& habits, int unit, Bytes reply) {
    if (const Habit* h = habits.find(Kind::wrong_function)) reply = {byte_of(h->a), 2};
    if (const Habit* h = habits.find(Kind::refuse)) {
        reply = {static_cast<std::uint8_t>(reply[0] | 0x80), byte_of(h->a)};
    }
    if (const Habit* h = habits.find(Kind::pad_inside)) {
        reply.insert(reply.end(), static_cast<std::size_t>(h->a), 0x20);
    }
    const bool swapped =
        habits.find(Kind::crc_swapped) != nullptr || habits.always(Kind::crc_old) != nullptr;
    Bytes frame = sealed(unit, reply, swapped);
    if (habits.find(Kind::crc_bad) != nullptr) frame.back() ^= 0x5A;
    if (const Habit* h = habits.find(Kind::pad_behind)) {
        frame.insert(frame.end(), static_cast<std::size_t>(h->a), 0x20);
    }
    if (const Habit* h = habits.find(Kind::pre)) frame.insert(frame.begin(), byte_of(h->a));
    if (const Habit* h = habits.find(Kind::post)) frame.push_back(byte_of(h->a));
    return frame;
}

void add_pauses(const Habits& habits, Speech& speech, Dice& dice) {
    const std::size_t size = speech.bytes.size();
    if (const Habit* h = habits.find(Kind::holes)) {
        speech.pauses.resize(size);
        for (std::size_t i = 1; i < size; ++i) {
            speech.pauses[i] = dice.between(milliseconds(h->a), milliseconds(h->b));
        }
    }
    if (const Habit* h = habits.find(Kind::stall)) {
        if (dice.next() % static_cast<std::uint32_t>(std::max(1.0, h->a)) == 0) {
            speech.pauses.resize(size);
            speech.pauses[1 + dice.next() % (size - 1)] =
                dice.between(milliseconds(h->b), milliseconds(h->c));
        }
    }
    if (const Habit* h = habits.find(Kind::split)) {
        speech.holds.resize(size);
        for (std::uint32_t i = dice.next() % 3 + 1; i > 0; --i) {
            speech.holds[1 + dice.next() % (size - 1)] =
                dice.between(milliseconds(h->a), milliseconds(h->b));
        }
    }
}

Bytes random_bytes(std::size_t count, Dice& dice) {
    Bytes bytes(count);
    for (auto& b : bytes) b = dice.byte();
    return bytes;
}

}  // namespace

Time think_time(const Habits& habits, Time usual, Dice& dice) {
    const bool is_first_part = [&habits] {
        const Habit* h = habits.always(Kind::slow_then_quick);
        if (h == nullptr) h = habits.always(Kind::quick_then_slow);
        return h != nullptr && habits.served() <= static_cast<int>(h->a);
    }();
    if (const Habit* h = habits.find(Kind::think)) return milliseconds(h->a);
    if (const Habit* h = habits.find(Kind::think_random)) {
        return dice.between(milliseconds(h->a), milliseconds(h->b));
    }
    if (const Habit* h = habits.find(Kind::think_every)) {
        const int every = std::max(1, static_cast<int>(h->a));
        return milliseconds(habits.served() % every == 0 ? h->b * h->c : h->b);
    }
    if (const Habit* h = habits.find(Kind::slow_then_quick)) {
        return milliseconds(is_first_part ? h->c : h->b);
    }
    if (const Habit* h = habits.find(Kind::quick_then_slow)) {
        return milliseconds(is_first_part ? h->b : h->c);
    }
    if (const Habit* h = habits.find(Kind::twin)) return milliseconds(h->a);
    return usual;
}

std::vector<Speech> shape_reply(const Habits& habits, int unit, const Bytes& reply, Time start,
                                Time character, Dice& dice) {
    std::vector<Speech> all;
    if (const Habit* h = habits.find(Kind::pregap)) {
        all.push_back({.start = start, .speaker = unit, .bytes = {byte_of(h->a)}});
        start += character + milliseconds(h->b);
    }
    Speech speech{
        .start = start, .speaker = unit, .bytes = frame_of(habits, unit, reply), .is_reply = true};
    if (const Habit* h = habits.find(Kind::rate)) speech.rate = 1 + h->a / 100;
    add_pauses(habits, speech, dice);
    Time end = start + static_cast<Time>(speech.bytes.size()) * character;
    for (const Time pause : speech.pauses) end += pause;
    all.push_back(speech);
    if (const Habit* h = habits.find(Kind::tail)) {
        all.push_back({.start = end + dice.between(milliseconds(h->a), milliseconds(h->b)),
                       .speaker = unit,
                       .bytes = random_bytes(dice.next() % 3 + 1, dice)});
    }
    if (const Habit* h = habits.find(Kind::duplicate)) {
        speech.start = end + milliseconds(h->a);
        speech.is_reply = false;
        all.push_back(speech);
    }
    if (const Habit* h = habits.find(Kind::twin)) {
        speech.start = start + milliseconds(h->b - h->a);
        speech.speaker = kTwin + unit;
        speech.is_reply = false;
        all.push_back(std::move(speech));
    }
    return all;
}

std::vector<Echo> shape_echo(const Habits& habits, std::size_t size) {
    std::vector<Echo> echo(size);
    const auto hear = [&echo, size](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < std::min(to, size); ++i) echo[i].is_heard = true;
    };
    if (habits.always(Kind::echo_full) != nullptr) hear(0, size);
    if (habits.always(Kind::echo_first) != nullptr) hear(0, 1);
    if (habits.always(Kind::echo_last) != nullptr) hear(size - 1, size);
    if (habits.always(Kind::echo_cut_last) != nullptr) hear(0, size - 1);
    if (const Habit* h = habits.always(Kind::echo_partial)) {
        hear(0, static_cast<std::size_t>(h->a));
    }
    if (const Habit* h = habits.always(Kind::echo_bit_error)) {
        hear(0, size);
        // served() counts up to the request before this one.
        const int every = std::max(1, static_cast<int>(h->a));
        if ((habits.served() + 1) % every == 0) echo[size / 2].damage = 0x10;
    }
    return echo;
}

}  // namespace zoo
