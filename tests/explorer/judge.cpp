#include "judge.hpp"

#include <algorithm>

#include "panelgate/base/serial_format.hpp"

namespace panelgate::explorer {
namespace {

unsigned word(ByteView bytes, std::size_t at) { return bytes[at] * 256u + bytes[at + 1]; }

}  // namespace

void Judge::on_accepted(Open open) {
    open.served = served_[open.wish.station];
    open_.push_back(open);
}

void Judge::on_gone(std::uint8_t client) {
    for (Open& open : open_) open.gone = open.gone || open.wish.client == client;
}

void Judge::on_line(TimePoint now) {
    heard_until_ = now;
    sent_until_ = std::min(sent_until_, now);
}

void Judge::on_transmit(TimePoint now, ByteView adu, TimePoint end, bool for_somebody) {
    static const Duration gap = silent_interval(small_settings().serial);
    if (now < sent_until_ + gap || now < heard_until_ + gap) fail("P5: sent within the gap");
    sent_until_ = end;
    if (adu[1] == 6) {
        check_write(adu.subspan(1));
    } else if (for_somebody) {
        check_read(adu);
    }
}

void Judge::check_write(ByteView pdu) {
    const auto open = std::ranges::find_if(
        open_, [&](const Open& o) { return o.wish.write && o.value == word(pdu, 3); });
    if (open == open_.end()) return fail("P2: a write was sent after its answer");
    if (open->sent) fail("P2: a write was sent twice");
    if (open->gone) fail("P2: a write was sent for a client that has left");
    open->sent = true;
}

void Judge::check_read(ByteView adu) {
    bool wanted = false;
    for (Open& open : open_) {
        const unsigned end = word(adu, 2) + word(adu, 4);
        const bool asked = open.covers(adu[0], adu[1], open.wish.address) &&
                           open.wish.address >= word(adu, 2) &&
                           open.wish.address + unsigned{open.wish.count} <= end;
        wanted = wanted || (asked && !open.gone);
        if (asked) open.sent = true;
    }
    if (!wanted) fail("P5: a read was sent for nobody");
}

void Judge::on_served(std::uint8_t station, ByteView pdu) {
    ++served_[station];
    for (Open& open : open_) {
        if (pdu[0] == 6 && open.wish.write && open.value == word(pdu, 3)) open.executed = true;
    }
}

void Judge::on_finish(TimePoint now, const arbiter::Finish& finish) {
    const auto found = std::ranges::find(open_, finish.ticket, &Open::ticket);
    if (found == open_.end()) return fail("P3: answered twice, or what nobody asked");
    const Open open = *found;
    open_.erase(found);
    if (now > open.submitted + kDeadline) fail("P3: answered after its deadline");
    if (!finish.pdu || open.gone) return;
    const Bytes& reply = *finish.pdu;
    if (open.wish.write) {
        if (reply.size() != 5 || reply[0] != 6 || word(reply, 3) != open.value)
            fail("P1: the confirmation of another write");
        if (!open.executed) fail("P2: a write was confirmed that no station executed");
        return;
    }
    check_values(open, reply);
}

void Judge::check_values(const Open& open, ByteView reply) {
    const std::size_t size = std::size_t{2} * open.wish.count;
    if (reply.size() != 2 + size || reply[0] != 3 || reply[1] != size)
        return fail("P1: a reply of another length or function");
    for (unsigned i = 0; i < open.wish.count; ++i) {
        const unsigned value = word(reply, 2 + 2 * i);
        if (value >> 8 != open.wish.address + i) return fail("P1: the value of another address");
        const auto later = static_cast<std::uint8_t>(value - open.served);
        if (later == 0 || open.served + later > served_[open.wish.station])
            return fail("P1: a value from before the question");
    }
}

void Judge::on_time(TimePoint now) {
    for (const Open& open : open_) {
        if (now > open.submitted + kDeadline) fail("P3: not answered at its deadline");
    }
}

}  // namespace panelgate::explorer
