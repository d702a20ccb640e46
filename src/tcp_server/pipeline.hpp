#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
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

/// The replies of one connection, in order of request arrival (PIP-02): a reply is sent only after
/// all earlier ones. Pure.
class ReplyQueue {
  public:
    explicit ReplyQueue(modbus::Framing framing = modbus::Framing::tcp) : framing_(framing) {}

    /// Identifies a request for the lifetime of the connection.
    using Ticket = std::uint64_t;

    /// Adds a request to be answered later. `pdu` is kept for matches_newest(), if retransmissions
    /// may join.
    Ticket open(std::uint16_t transaction, std::uint8_t unit, Bytes pdu = {});
    /// Adds a request whose reply is already known and only waits for its turn.
    void push(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu);
    /// Sets the reply PDU (1..253 bytes) of an open request, once per ticket. In the serial modes
    /// unit 0 gets no reply: the same as drop().
    void settle(Ticket ticket, const Bytes& pdu);
    /// Closes an open request without a reply (a silent broadcast).
    void drop(Ticket ticket);

    /// Returns the next reply ADU to send, null if there is none. Remains valid until pop().
    const Bytes* front() const { return ready_ == 0 ? nullptr : &slots_.front().adu; }
    /// Removes front() after it was sent.
    void pop();

    /// True if the latest request with this transaction id among those with unsent replies is this
    /// one (opened with its PDU) and no later PDU invalidates its answer; nullopt if there is none.
    using Invalidates = bool (*)(ByteView since, ByteView pdu);
    std::optional<bool> matches_newest(std::uint16_t transaction, std::uint8_t unit, ByteView pdu,
                                       Invalidates invalidates) const;
    bool empty() const { return slots_.empty(); }
    /// Returns the number of requests with unsent replies.
    std::size_t size() const { return slots_.size(); }
    /// Returns those waiting for an answer or for the client to read, not those ready but queued
    /// behind an unanswered one.
    std::size_t in_flight() const { return unanswered_ + ready_; }

  private:
    struct Slot {
        std::uint16_t transaction = 0;
        std::uint8_t unit = 0;
        Bytes request;  ///< PDU; empty: retransmissions are not joined
        bool settled = false;
        Bytes adu;  ///< empty: nothing to send
    };
    Slot& at(Ticket ticket) { return slots_[static_cast<std::size_t>(ticket - first_)]; }
    void close(Slot& slot);
    void skip_silent();

    modbus::Framing framing_;
    PoolDeque<Slot> slots_;
    Ticket first_ = 0;       ///< ticket of slots_.front()
    std::size_t ready_ = 0;  ///< settled slots at the front; the first has an ADU
    std::size_t unanswered_ = 0;
};

/// The requests of one connection, from arrival until the client has taken their replies: at most
/// settings.in_flight are on the buses or being returned, the rest wait in order and are decided on
/// when their turn comes, so none overtakes. Answers after its end are dropped.
class Pipeline : public std::enable_shared_from_this<Pipeline> {
  public:
    /// The network may duplicate a datagram, so there all retransmissions join by default.
    enum class Transport : std::uint8_t { stream, datagrams };

    /// `on_answer` is called when a bus has answered and a reply may be ready; never from inside
    /// take() or pop(), nor after close().
    Pipeline(std::shared_ptr<Shared> shared, Caller caller, std::function<void()> on_answer,
             Transport transport = Transport::stream);

    /// True if one more request fits. Callers that respect it bound the memory.
    bool has_room() const;
    /// Takes a request. A retransmission of an unanswered one gets no answer of its own
    /// (settings.retransmissions).
    void take(modbus::Adu adu);
    /// True if it is such a retransmission, which needs no room; counts it.
    bool joins(const modbus::Adu& adu);
    /// Returns the next reply ADU to send, null if there is none; valid until pop().
    const Bytes* front() const { return replies_.front(); }
    /// Removes front(), which makes room for another request.
    void pop();

    /// True if all requests were answered and all replies popped.
    bool empty() const { return waiting_.empty() && replies_.empty(); }
    const std::string& client() const { return caller_.name(); }
    /// As Caller::certify().
    void certify(std::string subject, std::optional<std::string> role) {
        std::span<const OwnRole> own;
        if (shared_->settings.tls) own = shared_->settings.tls->own_roles;
        caller_.certify(std::move(subject), std::move(role), own);
    }

    /// Starts no further request: queued ones are answered Fault::cancelled.
    void refuse_waiting();
    /// Also cancels those queued on the buses, without calling on_answer. Idempotent.
    void close();

  private:
    bool may_join(ByteView pdu) const;
    bool is_joined(const modbus::Adu& adu) const;
    ReplyQueue::Ticket open(const modbus::Adu& adu);
    void admit();
    void serve(const modbus::Adu& adu);
    void tell_stray(const modbus::Adu& adu) const;
    void forward(const modbus::Adu& adu, Forward forwarding);
    void broadcast(const modbus::Adu& adu, const Broadcast& broadcasting);
    void refuse(const modbus::Adu& adu, Fault fault);
    /// Sends the gateway's own answer, at once or when its turn comes (OwnAnswers).
    using OwnPdu = InlineFunction<Bytes(), 48>;
    void answer(const modbus::Adu& adu, OwnPdu pdu);
    Bytes counted(Bytes reply);
    /// Settles an open request; nullopt: no reply.
    void settle(ReplyQueue::Ticket ticket, std::optional<Bytes> pdu);

    std::shared_ptr<Shared> shared_;
    Caller caller_;
    std::function<void()> on_answer_;
    Transport transport_;
    PoolDeque<modbus::Adu> waiting_;  ///< not decided on yet
    ReplyQueue replies_;
    std::size_t joined_ = 0;  ///< retransmissions since it was last empty
    bool refusing_waiting_ = false;
    bool closed_ = false;
};

}  // namespace panelgate::tcp_server
