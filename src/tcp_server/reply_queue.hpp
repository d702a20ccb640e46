#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"

namespace panelgate::tcp_server {

/// The requests of one connection that are not answered yet, in the order of their arrival
/// (PIP-02): a reply leaves only when all before it have left. Pure.
class ReplyQueue {
  public:
    /// Names one request for as long as the connection lives.
    using Ticket = std::uint64_t;

    /// A request that will be answered later.
    Ticket open(std::uint16_t transaction, std::uint8_t unit);
    /// A request whose reply is known at once; it only waits for its turn.
    void push(std::uint16_t transaction, std::uint8_t unit, Bytes pdu);
    /// The reply PDU of an open request, 1..253 bytes. Once for each ticket.
    void settle(Ticket ticket, Bytes pdu);
    /// An open request that gets no reply (a silent broadcast).
    void drop(Ticket ticket);

    /// The next reply ADU whose turn has come.
    std::optional<Bytes> pop();

    bool empty() const { return slots_.empty(); }
    /// Requests that were opened and have not been popped: what the client sees as outstanding.
    std::size_t in_flight() const { return in_flight_; }
    /// Bytes of replies that wait for their turn.
    std::size_t ready_bytes() const { return ready_bytes_; }

  private:
    struct Slot {
        std::uint16_t transaction = 0;
        std::uint8_t unit = 0;
        bool opened = false;
        bool settled = false;
        Bytes adu;  ///< empty when nothing is to be sent
    };
    Slot& at(Ticket ticket) { return slots_[static_cast<std::size_t>(ticket - first_)]; }
    void fill(Slot& slot, ByteView pdu);

    std::deque<Slot> slots_;
    Ticket first_ = 0;  ///< of slots_.front()
    std::size_t in_flight_ = 0;
    std::size_t ready_bytes_ = 0;
};

}  // namespace panelgate::tcp_server
