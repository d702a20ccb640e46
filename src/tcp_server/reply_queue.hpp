#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "panelgate/base/bytes.hpp"

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

    /// The next reply ADU whose turn has come.
    std::optional<Bytes> pop();

    bool empty() const { return slots_.empty(); }
    /// Requests that are neither settled nor dropped.
    std::size_t unanswered() const { return unanswered_; }
    /// Requests whose replies may not leave yet: the first unanswered one and all behind it.
    std::size_t held() const { return slots_.size() - ready_; }
    /// Bytes of the replies that may leave: these wait for nobody but the client.
    std::size_t ready_bytes() const { return ready_bytes_; }

  private:
    struct Slot {
        std::uint16_t transaction = 0;
        std::uint8_t unit = 0;
        bool settled = false;
        Bytes adu;  ///< empty when nothing is to be sent
    };
    Slot& at(Ticket ticket) { return slots_[static_cast<std::size_t>(ticket - first_)]; }
    void close(Slot& slot);

    std::deque<Slot> slots_;
    Ticket first_ = 0;       ///< of slots_.front()
    std::size_t ready_ = 0;  ///< slots at the front that are settled
    std::size_t ready_bytes_ = 0;
    std::size_t unanswered_ = 0;
};

}  // namespace panelgate::tcp_server
