#include "reply_queue.hpp"

#include <utility>

#include "panelgate/modbus/mbap.hpp"

namespace panelgate::tcp_server {

ReplyQueue::Ticket ReplyQueue::open(std::uint16_t transaction, std::uint8_t unit) {
    slots_.push_back(Slot{transaction, unit, false, {}});
    ++unanswered_;
    return first_ + slots_.size() - 1;
}

void ReplyQueue::push(std::uint16_t transaction, std::uint8_t unit, Bytes pdu) {
    settle(open(transaction, unit), std::move(pdu));
}

void ReplyQueue::settle(Ticket ticket, Bytes pdu) {
    Slot& slot = at(ticket);
    slot.adu = modbus::encode_mbap(slot.transaction, slot.unit, pdu);
    close(slot);
}

void ReplyQueue::drop(Ticket ticket) { close(at(ticket)); }

void ReplyQueue::close(Slot& slot) {
    slot.settled = true;
    --unanswered_;
    for (; ready_ < slots_.size() && slots_[ready_].settled; ++ready_) {
        ready_bytes_ += slots_[ready_].adu.size();
    }
}

std::optional<Bytes> ReplyQueue::pop() {
    while (ready_ > 0) {
        Bytes adu = std::move(slots_.front().adu);
        slots_.pop_front();
        ++first_;
        --ready_;
        if (adu.empty()) continue;
        ready_bytes_ -= adu.size();
        return adu;
    }
    return std::nullopt;
}

}  // namespace panelgate::tcp_server
