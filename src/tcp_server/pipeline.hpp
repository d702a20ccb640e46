#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "shared.hpp"

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

/// The requests of one connection, from their arrival until the client has taken their replies: at
/// most settings.in_flight are on the buses or on their way back, the others wait in order and are
/// judged when their turn comes, so nothing overtakes. Answers that come after its end are dropped.
class Pipeline : public std::enable_shared_from_this<Pipeline> {
  public:
    /// The network may bring a datagram twice, so there all repetitions are joined by default.
    enum class Transport : std::uint8_t { stream, datagrams };

    /// `on_answer`: a bus has answered, so there may be a reply to send. Never called from inside
    /// take() or pop(), and not after close().
    Pipeline(std::shared_ptr<Shared> shared, Caller caller, std::function<void()> on_answer,
             Transport transport = Transport::stream);

    /// One more request can be kept. Who takes none without room bounds the memory.
    bool has_room() const;
    /// A retransmission of one that is not answered yet has no answer of its own
    /// (settings.retransmissions).
    void take(modbus::Adu adu);
    /// Without room: whether it is such a retransmission, which needs none; it is counted then.
    bool joins(const modbus::Adu& adu);
    /// The next reply ADU whose turn has come, null when there is none; valid until pop().
    const Bytes* front() const { return replies_.front(); }
    /// front() has been taken: there is room for another request.
    void pop();

    /// Everything that was taken has been answered, and all replies were popped.
    bool empty() const { return waiting_.empty() && replies_.empty(); }
    const std::string& client() const { return caller_.name(); }

    /// From now on no request starts: those that wait here are answered Fault::cancelled.
    void turn_away();
    /// And those that wait on the buses are taken back, and nobody is told. May be called twice.
    void close();

  private:
    bool may_join(ByteView pdu) const;
    bool is_joined(const modbus::Adu& adu) const;
    ReplyQueue::Ticket open(const modbus::Adu& adu);
    void admit();
    void serve(const modbus::Adu& adu);
    void forward(const modbus::Adu& adu, Forward forwarding);
    void broadcast(const modbus::Adu& adu, const Broadcast& broadcasting);
    void refuse(const modbus::Adu& adu, Fault fault);
    /// The gateway's own answer, now or when it is its turn (OwnAnswers).
    using OwnPdu = InlineFunction<Bytes(), 48>;
    void answer(const modbus::Adu& adu, OwnPdu pdu);
    Bytes counted(Bytes reply);
    /// The reply to an open request; nothing: it gets none.
    void settle(ReplyQueue::Ticket ticket, std::optional<Bytes> pdu);

    std::shared_ptr<Shared> shared_;
    Caller caller_;
    std::function<void()> on_answer_;
    Transport transport_;
    PoolDeque<modbus::Adu> waiting_;  ///< not judged yet
    ReplyQueue replies_;
    std::size_t joined_ = 0;  ///< repetitions, since it was empty
    bool turning_away_ = false;
    bool closed_ = false;
};

}  // namespace panelgate::tcp_server
