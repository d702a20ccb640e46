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
    while (ready_ < slots_.size() && slots_[ready_].settled) ++ready_;
    step_over_silent();
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
