#include "reply_queue.hpp"

#include <utility>

#include "panelgate/modbus/mbap.hpp"

namespace panelgate::tcp_server {

ReplyQueue::Ticket ReplyQueue::open(std::uint16_t transaction, std::uint8_t unit) {
    slots_.push_back(Slot{transaction, unit, true, false, {}});
    ++in_flight_;
    return first_ + slots_.size() - 1;
}

void ReplyQueue::push(std::uint16_t transaction, std::uint8_t unit, Bytes pdu) {
    slots_.push_back(Slot{transaction, unit, false, false, {}});
    fill(slots_.back(), pdu);
}

void ReplyQueue::settle(Ticket ticket, Bytes pdu) { fill(at(ticket), pdu); }

void ReplyQueue::drop(Ticket ticket) { at(ticket).settled = true; }

void ReplyQueue::fill(Slot& slot, ByteView pdu) {
    slot.settled = true;
    slot.adu = modbus::encode_mbap(slot.transaction, slot.unit, pdu);
    ready_bytes_ += slot.adu.size();
}

std::optional<Bytes> ReplyQueue::pop() {
    while (!slots_.empty() && slots_.front().settled) {
        Slot slot = std::move(slots_.front());
        slots_.pop_front();
        ++first_;
        if (slot.opened) --in_flight_;
        if (slot.adu.empty()) continue;
        ready_bytes_ -= slot.adu.size();
        return std::move(slot.adu);
    }
    return std::nullopt;
}

}  // namespace panelgate::tcp_server
