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
#include "panelgate/modbus/mbap.hpp"
#include "panelgate/tcp_server/caller.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/tcp_server/unit_map.hpp"
#include "reply_queue.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

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
