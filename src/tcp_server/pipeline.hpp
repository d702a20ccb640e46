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

/// The requests of one connection, from arrival until the client has taken their replies: at most
/// settings.in_flight are on the buses or being returned, the rest wait in order and are decided on
/// when their turn comes, so none overtakes. Answers after its end are dropped.
class Pipeline : public std::enable_shared_from_this<Pipeline> {
  public:
    /// `on_answer` is called when a bus has answered and a reply may be ready; never from inside
    /// take() or pop(), nor after close().
    Pipeline(std::shared_ptr<Shared> shared, Caller caller, std::function<void()> on_answer);

    /// True if one more request fits. Callers that ask before take() bound the memory.
    bool has_room() const;
    /// Takes a request. A retransmission of an unanswered one gets no answer of its own
    /// (settings.retransmissions).
    void take(modbus::Adu adu);
    /// Returns the next reply ADU to send, in the order of arrival (PIP-02), null if there is none;
    /// valid until pop(), also after close().
    const Bytes* front() const { return ready_ == 0 ? nullptr : &slots_.front().reply; }
    /// Removes front(), which makes room for another request.
    void pop();

    /// True if all requests were answered and all replies popped.
    bool empty() const { return slots_.empty(); }
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
    /// Names a request for the lifetime of the connection.
    using Ticket = std::uint64_t;
    struct Slot {
        modbus::Adu request;
        bool answered = false;
        Bytes reply{};  ///< ADU; empty if none is sent
    };

    bool may_join(ByteView pdu) const;
    bool is_joined(const modbus::Adu& adu) const;
    void admit();
    void serve(Ticket ticket);
    void tell_stray(const modbus::Adu& adu) const;
    void tell_no_unit(const modbus::Adu& adu, modbus::ExceptionCode code) const;
    /// Returns the exception, nullopt where the listener's clients get silence in its place.
    std::optional<Bytes> exception(std::uint8_t function, modbus::ExceptionCode code) const;
    std::optional<Bytes> reply_pdu(std::uint8_t function, Result<Bytes> pdu) const;
    void forward(Ticket ticket, std::uint8_t function, Forward forwarding);
    void broadcast(Ticket ticket, std::uint8_t function, const Broadcast& broadcasting);
    /// Gives the gateway's own answer, at once or when its turn comes (OwnAnswers).
    using OwnPdu = InlineFunction<std::optional<Bytes>(), 48>;
    void answer(Ticket ticket, OwnPdu pdu);
    /// Answers a started request, once; nullopt: no reply. put() does not call on_answer.
    void put(Ticket ticket, std::optional<Bytes> pdu);
    void settle(Ticket ticket, std::optional<Bytes> pdu);
    void skip_silent();

    std::shared_ptr<Shared> shared_;
    Caller caller_;
    std::function<void()> on_answer_;
    PoolDeque<Slot> slots_;       ///< in the order of arrival
    Ticket first_ = 0;            ///< ticket of slots_.front()
    std::size_t started_ = 0;     ///< slots at the front whose turn has come
    std::size_t ready_ = 0;       ///< answered slots at the front; the first has a reply
    std::size_t unanswered_ = 0;  ///< of those started
    std::size_t joined_ = 0;      ///< retransmissions since it was last empty
    bool refusing_waiting_ = false;
    bool closed_ = false;
};

}  // namespace panelgate::tcp_server
