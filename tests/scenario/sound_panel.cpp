#include "sound_panel.hpp"

#include <algorithm>

namespace panelgate::sound {
namespace {

unsigned word(const Bytes& pdu, std::size_t at) { return pdu[at] * 256u + pdu[at + 1]; }
bool is_write(const Bytes& pdu) { return pdu[0] > 4; }

}  // namespace

std::vector<Bytes> draw_questions(Random& random, std::size_t client) {
    constexpr std::uint8_t kFunctions[] = {3, 3, 3, 4, 1, 2};
    const unsigned place = static_cast<unsigned>(kMemory + 2 * client);
    const bool alike = random.chance(0.5);  // blocks of one length in one table
    std::uint8_t function = 3;
    unsigned count = 2;
    std::vector<Bytes> questions;
    for (unsigned left = random.between(1, 6); left > 0; --left) {
        if (!alike || questions.empty()) {
            function = kFunctions[random.below(std::size(kFunctions))];
            count = function <= 2 ? 8 * random.between(1, 2) : random.between(1, 8);
        }
        questions.push_back(Writer().u8(function).u16(random.below(64)).u16(count).take());
    }
    if (random.chance(0.3)) questions.push_back(Writer().u8(3).u16(place).u16(2).take());
    return questions;
}

/// libmodbus's server waits for the reply of a panel that it hears being asked, and takes whatever
/// begins within 500 ms for that reply: a request to the server itself is lost.
bool Panel::hears_request(const Bytes& adu, TimePoint start, TimePoint end) {
    constexpr Duration kPatience = 500ms;
    if (plan_.kind == Kind::libmodbus) {
        const bool taken_for_reply = start < expects_until_;
        expects_until_ = {};
        if (taken_for_reply) return false;
        if (adu[0] != plan_.id) expects_until_ = end + kPatience;
    }
    if (adu[0] != plan_.id || plan_.kind == Kind::dead || thinking_) return false;
    if (start < replied_ + plan_.deaf) return false;
    thinking_ = true;
    return true;
}

void Panel::hears_reply(TimePoint start) {
    if (start < expects_until_) expects_until_ = {};
}

Bytes Panel::serve(const Bytes& pdu) {
    Served next;
    if (!past_.empty()) next.memory = past_.back().memory;
    if (is_write(pdu)) {
        next.write = pdu;
        store(pdu, next.memory);
    }
    past_.push_back(std::move(next));
    return reply_at(pdu, past_.size() - 1);
}

void Panel::store(const Bytes& pdu, Memory& memory) const {
    const unsigned count = pdu[0] == 16 ? word(pdu, 3) : 1;
    for (unsigned i = 0; i < count; ++i)
        memory.at(word(pdu, 1) + i - kMemory) =
            static_cast<std::uint16_t>(word(pdu, pdu[0] == 16 ? 6 + 2 * i : 3));
    if (plan_.kind == Kind::resetting) memory[kCommand - kMemory] = 0;
}

bool Panel::has_said(const Bytes& pdu, const Bytes& reply, std::size_t since) const {
    for (std::size_t turn = since; turn < past_.size(); ++turn) {
        if (is_write(pdu) && past_[turn].write != pdu) continue;
        if (reply_at(pdu, turn) == reply) return true;
    }
    return false;
}

Bytes Panel::reply_at(const Bytes& pdu, std::size_t turn) const {
    if (is_write(pdu)) return {pdu.begin(), pdu.begin() + 5};
    const unsigned from = word(pdu, 1);
    const unsigned count = word(pdu, 3);
    const bool refused = from + count > kRefused && from < kMemory;
    if (plan_.kind == Kind::refusing && refused) return Writer().u8(pdu[0] | 0x80u).u8(2).take();
    Writer out;
    out.u8(pdu[0]);
    if (pdu[0] <= 2) {
        out.u8(count / 8);
        for (unsigned at = from; at < from + count; at += 8) {
            unsigned byte = 0;
            for (unsigned bit = 0; bit < 8; ++bit) byte |= (value(at + bit, turn) & 1u) << bit;
            out.u8(byte);
        }
        return out.take();
    }
    out.u8(2 * count);
    for (unsigned i = 0; i < count; ++i) out.u16(value(from + i, turn));
    return out.take();
}

std::uint16_t Panel::value(unsigned address, std::size_t turn) const {
    if (address >= kMemory && address < kMemory + kCells)
        return past_[turn].memory[address - kMemory];
    if (plan_.values == Kind::equal) return 0;
    const std::size_t moved = plan_.values == Kind::moving ? turn * 11 : 0;
    return static_cast<std::uint16_t>(address * 31 + plan_.id * 257u + 7 + moved);
}

}  // namespace panelgate::sound
