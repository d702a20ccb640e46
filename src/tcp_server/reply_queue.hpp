#pragma once

#include <cstddef>
#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::tcp_server {

/// The replies of one connection, in the order of the requests' arrival (PIP-02): one leaves only
/// when all before it have left. Pure.
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

    /// The next reply ADU whose turn has come, null when there is none. It stays where it is until
    /// pop(), whatever else happens.
    const Bytes* front() const { return ready_ == 0 ? nullptr : &slots_.front().adu; }
    /// front() has left.
    void pop();

    bool empty() const { return slots_.empty(); }
    /// Requests whose replies have not left.
    std::size_t size() const { return slots_.size(); }
    /// Those of them that wait for an answer of their own or for the client to read, not those that
    /// only wait behind an unanswered one.
    std::size_t in_flight() const { return unanswered_ + ready_; }

  private:
    struct Slot {
        std::uint16_t transaction = 0;
        std::uint8_t unit = 0;
        bool settled = false;
        Bytes adu;  ///< empty when nothing is to be sent
    };
    Slot& at(Ticket ticket) { return slots_[static_cast<std::size_t>(ticket - first_)]; }
    void close(Slot& slot);
    void step_over_silent();

    PoolDeque<Slot> slots_;
    Ticket first_ = 0;       ///< of slots_.front()
    std::size_t ready_ = 0;  ///< slots at the front that are settled; the first has an ADU
    std::size_t unanswered_ = 0;
};

}  // namespace panelgate::tcp_server
