#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/modbus/framing.hpp"

namespace panelgate::tcp_server {

/// The replies of one connection, in the order of the requests' arrival (PIP-02): one leaves only
/// when all before it have left. Pure.
class ReplyQueue {
  public:
    explicit ReplyQueue(modbus::Framing framing = modbus::Framing::tcp) : framing_(framing) {}

    /// Names one request for as long as the connection lives.
    using Ticket = std::uint64_t;

    /// A request that will be answered later. `pdu`: kept for newest_is(), if it is to be known
    /// again.
    Ticket open(std::uint16_t transaction, std::uint8_t unit, Bytes pdu = {});
    /// A request whose reply is known at once; it only waits for its turn.
    void push(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu);
    /// The reply PDU of an open request, 1..253 bytes. Once for each ticket. In the serial modes
    /// nobody at unit 0 answers: that is a drop().
    void settle(Ticket ticket, const Bytes& pdu);
    /// An open request that gets no reply (a silent broadcast).
    void drop(Ticket ticket);

    /// The next reply ADU whose turn has come, null when there is none. It stays where it is until
    /// pop(), whatever else happens.
    const Bytes* front() const { return ready_ == 0 ? nullptr : &slots_.front().adu; }
    /// front() has left.
    void pop();

    /// Whether the last request with this transaction id, of those whose replies have not left, is
    /// this one and was opened with its PDU, and none was opened since whose PDU makes its answer
    /// old; nothing: there is none.
    using MakesOld = bool (*)(ByteView since, ByteView pdu);
    std::optional<bool> newest_is(std::uint16_t transaction, std::uint8_t unit, ByteView pdu,
                                  MakesOld makes_old) const;
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
        Bytes request;  ///< PDU; empty: it is never known again
        bool settled = false;
        Bytes adu;  ///< empty when nothing is to be sent
    };
    Slot& at(Ticket ticket) { return slots_[static_cast<std::size_t>(ticket - first_)]; }
    void close(Slot& slot);
    void step_over_silent();

    modbus::Framing framing_;
    PoolDeque<Slot> slots_;
    Ticket first_ = 0;       ///< of slots_.front()
    std::size_t ready_ = 0;  ///< slots at the front that are settled; the first has an ADU
    std::size_t unanswered_ = 0;
};

}  // namespace panelgate::tcp_server
