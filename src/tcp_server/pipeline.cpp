#include "pipeline.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <variant>

#include "own_unit.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::tcp_server {

ReplyQueue::Ticket ReplyQueue::open(std::uint16_t transaction, std::uint8_t unit, Bytes pdu) {
    slots_.push_back(Slot{transaction, unit, std::move(pdu), false, {}});
    ++unanswered_;
    return first_ + slots_.size() - 1;
}

void ReplyQueue::push(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
    settle(open(transaction, unit), pdu);
}

void ReplyQueue::settle(Ticket ticket, const Bytes& pdu) {
    Slot& slot = at(ticket);
    if (modbus::is_answered(framing_, slot.unit))
        slot.adu = modbus::encode_reply(framing_, slot.transaction, slot.unit, pdu);
    close(slot);
}

void ReplyQueue::drop(Ticket ticket) { close(at(ticket)); }

void ReplyQueue::close(Slot& slot) {
    slot.settled = true;
    --unanswered_;
    while (ready_ < slots_.size() && slots_[ready_].settled) ++ready_;
    skip_silent();
}

std::optional<bool> ReplyQueue::matches_newest(std::uint16_t transaction, std::uint8_t unit,
                                               ByteView pdu, Invalidates invalidates) const {
    for (std::size_t i = slots_.size(); i-- > 0;) {
        const Slot& slot = slots_[i];
        if (slot.transaction == transaction)
            return slot.unit == unit && std::ranges::equal(slot.request, pdu);
        if (invalidates(slot.request, pdu)) return false;
    }
    return std::nullopt;
}

void ReplyQueue::pop() {
    slots_.front().adu.clear();
    skip_silent();
}

void ReplyQueue::skip_silent() {
    for (; ready_ > 0 && slots_.front().adu.empty(); --ready_) {
        slots_.pop_front();
        ++first_;
    }
}

namespace {

template <class... T>
struct Overloaded : T... {
    using T::operator()...;
};

Bytes exception_reply(std::uint8_t function, Fault fault) {
    return modbus::encode_exception(function, modbus::to_exception(fault));
}

/// Converts a bus's answer to a reply PDU. One too long for an MBAP frame becomes the same
/// exception as a malformed reply.
Bytes reply_pdu(std::uint8_t function, Result<Bytes> pdu) {
    if (!pdu) return exception_reply(function, pdu.error());
    if (pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return exception_reply(function, Fault::malformed);
    }
    return std::move(*pdu);
}

/// True if `request` could change what `read` returns. Units may be aliases, so they are not
/// compared.
bool invalidates(ByteView request, ByteView read) {
    if (request.empty() || !modbus::is_pure_read(read) || modbus::is_pure_read(request))
        return false;
    if (!modbus::check_request(request)) return false;  // refused
    const auto span = modbus::read_span(read);
    return !span || modbus::may_change(modbus::access_of(request).write, *span);
}

/// Collects the lines' answers to one broadcast.
struct BroadcastOutcome {
    std::size_t open = 0;  ///< lines still to answer
    std::optional<Bytes> sent;
    std::optional<bus::Answer> failed;

    void add(bus::Answer answer) {
        --open;
        if (answer.pdu) {
            sent = *answer.pdu;
        } else if (!failed || (answer.transmitted && !failed->transmitted)) {
            failed = std::move(answer);  // prefer the one with unknown outcome
        }
    }
    /// Returns the reply; nullopt if the mode is silent and a frame may have been sent (TBC-06).
    std::optional<Bytes> reply(std::uint8_t function, BroadcastMode mode) const {
        const bool silent = mode == BroadcastMode::silent;
        if (silent && (sent || failed->transmitted)) return std::nullopt;
        return reply_pdu(function, sent ? Result<Bytes>(*sent) : failed->pdu);
    }
};

}  // namespace

Pipeline::Pipeline(std::shared_ptr<Shared> shared, Caller caller, std::function<void()> on_answer,
                   Transport transport)
    : shared_(std::move(shared)),
      caller_(std::move(caller)),
      on_answer_(std::move(on_answer)),
      transport_(transport),
      replies_(shared_->settings.framing) {}

/// A reply occupies room until the client has taken it, so a slow reader is served slowly.
/// Retransmissions occupy room too; otherwise a client repeating one request would never be
/// throttled.
bool Pipeline::has_room() const {
    const Settings& settings = shared_->settings;
    return replies_.size() + waiting_.size() + joined_ < settings.in_flight + settings.waiting;
}

/// True if a retransmission of this request may share its answer.
bool Pipeline::may_join(ByteView pdu) const {
    const Settings& settings = shared_->settings;
    if (!modbus::has_transactions(settings.framing)) return false;
    switch (settings.retransmissions) {
        case Retransmissions::join_writes:
            return transport_ == Transport::datagrams || !modbus::is_pure_read(pdu);
        case Retransmissions::join:
            return true;
        case Retransmissions::pass:
            return false;
    }
    std::abort();
}

/// Joins only the latest request of its transaction id: clients that use one id throughout may mean
/// on, off, on. A read after a write must see its result.
bool Pipeline::is_joined(const modbus::Adu& adu) const {
    if (!may_join(adu.pdu)) return false;
    for (std::size_t i = waiting_.size(); i-- > 0;) {
        if (waiting_[i].transaction == adu.transaction) return waiting_[i] == adu;
        if (invalidates(waiting_[i].pdu, adu.pdu)) return false;
    }
    return replies_.matches_newest(adu.transaction, adu.unit, adu.pdu, invalidates).value_or(false);
}

/// Opens a slot for a request that goes to the bus.
ReplyQueue::Ticket Pipeline::open(const modbus::Adu& adu) {
    const bool joinable = may_join(adu.pdu);
    return replies_.open(adu.transaction, adu.unit, joinable ? adu.pdu : Bytes());
}

void Pipeline::take(modbus::Adu adu) {
    if (is_joined(adu)) {
        ++joined_;
        ++shared_->counters.joined;
        shared_->log(rt::LogLevel::debug, "retransmission joined", {{"client", client()}});
        return;
    }
    ++shared_->counters.requests;
    if (!modbus::is_answered(shared_->settings.framing, adu.unit)) ++shared_->counters.unanswered;
    waiting_.push_back(std::move(adu));
    admit();
}

bool Pipeline::joins(const modbus::Adu& adu) {
    const bool joined = is_joined(adu);
    if (joined) ++shared_->counters.joined;
    return joined;
}

void Pipeline::pop() {
    replies_.pop();
    admit();
    if (empty()) joined_ = 0;
}

/// Every request waits for an in-flight slot, even a refusal or a read of the gateway's own
/// registers: those reflect the state after the preceding requests have started.
void Pipeline::admit() {
    const std::size_t places = shared_->settings.in_flight;
    while (!waiting_.empty() && (refusing_waiting_ || replies_.in_flight() < places)) {
        const modbus::Adu adu = std::move(waiting_.front());
        waiting_.pop_front();
        serve(adu);
    }
}

void Pipeline::serve(const modbus::Adu& adu) {
    std::visit(Overloaded{
                   [&](const Refuse& refusal) {
                       if (refusal.asked.empty()) tell_stray(adu);
                       for (const Target& target : refusal.asked)
                           caller_.count_refused(target.bus, target.station, adu.pdu);
                       answer(adu, [function = adu.pdu[0], code = refusal.code] {
                           return modbus::encode_exception(function, code);
                       });
                   },
                   [&](const Diagnose&) {
                       tell_stray(adu);
                       answer(adu, [pdu = adu.pdu, shared = shared_.get(), who = caller_.who()] {
                           return answer_diagnostics(pdu, own_state(*shared, who));
                       });
                   },
                   [&](Forward forwarding) { forward(adu, std::move(forwarding)); },
                   [&](const Broadcast& broadcasting) { broadcast(adu, broadcasting); },
               },
               decide(adu.unit, adu.pdu, shared_->settings, shared_->units, caller_.reads_only(),
                      caller_.who()));
}

/// A write that comes to no bus is told here.
void Pipeline::tell_stray(const modbus::Adu& adu) const {
    if (shared_->stray && !modbus::is_pure_read(adu.pdu))
        shared_->stray(caller_.who(), adu.unit, adu.pdu);
}

void Pipeline::answer(const modbus::Adu& adu, OwnPdu pdu) {
    if (shared_->own_answers->try_acquire())
        return replies_.push(adu.transaction, adu.unit, counted(pdu()));
    const ReplyQueue::Ticket ticket = replies_.open(adu.transaction, adu.unit);
    shared_->own_answers->wait([weak = weak_from_this(), ticket, pdu = std::move(pdu)] {
        const auto self = weak.lock();
        if (!self || self->closed_) return false;
        self->settle(ticket, pdu());
        return true;
    });
}

void Pipeline::refuse(const modbus::Adu& adu, Fault fault) {
    replies_.push(adu.transaction, adu.unit, counted(exception_reply(adu.pdu[0], fault)));
}

void Pipeline::forward(const modbus::Adu& adu, Forward forwarding) {
    if (refusing_waiting_) return refuse(adu, Fault::cancelled);
    const ReplyQueue::Ticket ticket = open(adu);
    caller_.transact(forwarding.target.bus, forwarding.target.station,
                     std::move(forwarding.request),
                     [weak = weak_from_this(), ticket, function = adu.pdu[0]](bus::Answer answer) {
                         const auto self = weak.lock();
                         if (self) self->settle(ticket, reply_pdu(function, std::move(answer.pdu)));
                     });
}

void Pipeline::broadcast(const modbus::Adu& adu, const Broadcast& broadcasting) {
    if (refusing_waiting_) return refuse(adu, Fault::cancelled);
    const ReplyQueue::Ticket ticket = open(adu);
    const auto outcome = std::make_shared<BroadcastOutcome>();
    outcome->open = broadcasting.lines.size();
    const auto on_answer = [weak = weak_from_this(), outcome, ticket,
                            function = adu.pdu[0]](bus::Answer answer) {
        outcome->add(std::move(answer));
        const auto self = weak.lock();
        if (!self || outcome->open != 0) return;
        self->settle(ticket, outcome->reply(function, self->shared_->settings.broadcast));
    };
    for (bus::BusClient* line : broadcasting.lines)
        caller_.transact(line, 0, broadcasting.request, on_answer);
}

Bytes Pipeline::counted(Bytes reply) {
    constexpr auto kBusy = static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
    const auto code = modbus::exception_of(reply);
    if (code) ++shared_->counters.exceptions;
    if (code == kBusy) ++shared_->counters.busy;
    return reply;
}

void Pipeline::settle(ReplyQueue::Ticket ticket, std::optional<Bytes> pdu) {
    if (closed_) return;
    if (pdu) {
        replies_.settle(ticket, counted(std::move(*pdu)));
    } else {
        ++shared_->counters.unanswered;
        replies_.drop(ticket);
    }
    admit();
    if (empty()) joined_ = 0;
    on_answer_();
}

void Pipeline::refuse_waiting() {
    refusing_waiting_ = true;
    admit();
}

void Pipeline::close() {
    if (std::exchange(closed_, true)) return;
    waiting_.clear();
    caller_.withdraw();
}

}  // namespace panelgate::tcp_server
