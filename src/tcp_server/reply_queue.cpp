#include "reply_queue.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::tcp_server {

ReplyQueue::Ticket ReplyQueue::open(std::uint16_t transaction, std::uint8_t unit, Bytes pdu) {
    slots_.push_back(Slot{transaction, unit, std::move(pdu), false, {}});
    ++unanswered_;
    return first_ + slots_.size() - 1;
}

void ReplyQueue::push(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
    settle(open(transaction, unit), pdu);
}

void ReplyQueue::settle(Ticket ticket, const Bytes& pdu) {
    Slot& slot = at(ticket);
    if (modbus::is_answered(framing_, slot.unit))
        slot.adu = modbus::encode_reply(framing_, slot.transaction, slot.unit, pdu);
    close(slot);
}

void ReplyQueue::drop(Ticket ticket) { close(at(ticket)); }

void ReplyQueue::close(Slot& slot) {
    slot.settled = true;
    --unanswered_;
    while (ready_ < slots_.size() && slots_[ready_].settled) ++ready_;
    step_over_silent();
}

std::optional<bool> ReplyQueue::newest_is(std::uint16_t transaction, std::uint8_t unit,
                                          ByteView pdu, MakesOld makes_old) const {
    for (std::size_t i = slots_.size(); i-- > 0;) {
        const Slot& slot = slots_[i];
        if (slot.transaction == transaction)
            return slot.unit == unit && std::ranges::equal(slot.request, pdu);
        if (makes_old(slot.request, pdu)) return false;
    }
    return std::nullopt;
}

void ReplyQueue::pop() {
    slots_.front().adu.clear();
    step_over_silent();
}

void ReplyQueue::step_over_silent() {
    for (; ready_ > 0 && slots_.front().adu.empty(); --ready_) {
        slots_.pop_front();
        ++first_;
    }
}

}  // namespace panelgate::tcp_server
