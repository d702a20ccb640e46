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

Pipeline::Pipeline(std::shared_ptr<Shared> shared, Caller caller, std::function<void()> on_answer)
    : shared_(std::move(shared)), caller_(std::move(caller)), on_answer_(std::move(on_answer)) {}

/// A reply occupies room until the client has taken it, so a slow reader is served slowly.
/// Retransmissions occupy room too; otherwise a client repeating one request would never be
/// throttled.
bool Pipeline::has_room() const {
    const Settings& settings = shared_->settings;
    return slots_.size() + joined_ < settings.in_flight + settings.waiting;
}

/// True if a retransmission of this request may share its answer. The network may duplicate a
/// datagram, so datagrams join by default.
bool Pipeline::may_join(ByteView pdu) const {
    const Settings& settings = shared_->settings;
    if (!modbus::has_transactions(settings.framing)) return false;
    switch (settings.retransmissions) {
        case Retransmissions::join_writes:
            return caller_.who()->face == Face::udp || !modbus::is_pure_read(pdu);
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
    for (std::size_t i = slots_.size(); i-- > 0;) {
        const modbus::Adu& earlier = slots_[i].request;
        if (earlier.transaction == adu.transaction) return earlier == adu;
        if (invalidates(earlier.pdu, adu.pdu)) return false;
    }
    return false;
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
    slots_.push_back(Slot{std::move(adu)});
    admit();
}

void Pipeline::pop() {
    slots_.front().reply.clear();
    skip_silent();
    admit();
    if (empty()) joined_ = 0;
}

/// Every request waits for an in-flight slot, even a refusal or a read of the gateway's own
/// registers: those reflect the state after the preceding requests have started.
void Pipeline::admit() {
    const std::size_t places = shared_->settings.in_flight;
    while (started_ < slots_.size() && (refusing_waiting_ || unanswered_ + ready_ < places)) {
        ++unanswered_;
        serve(first_ + started_++);
    }
}

void Pipeline::serve(Ticket ticket) {
    const modbus::Adu& adu = slots_[static_cast<std::size_t>(ticket - first_)].request;
    const std::uint8_t function = adu.pdu[0];
    std::visit(Overloaded{
                   [&](const Refuse& refusal) {
                       if (refusal.asked.empty()) tell_stray(adu);
                       for (const Target& target : refusal.asked)
                           caller_.count_refused(target.bus, target.station, adu.pdu);
                       answer(ticket, [function, code = refusal.code] {
                           return modbus::encode_exception(function, code);
                       });
                   },
                   [&](const Diagnose&) {
                       tell_stray(adu);
                       answer(ticket, [pdu = adu.pdu, shared = shared_.get(), who = caller_.who()] {
                           return answer_diagnostics(pdu, own_state(*shared, who));
                       });
                   },
                   [&](Forward forwarding) { forward(ticket, function, std::move(forwarding)); },
                   [&](const Broadcast& all) { broadcast(ticket, function, all); },
               },
               decide(adu.unit, adu.pdu, shared_->settings, shared_->units, caller_.reads_only(),
                      caller_.who()));
}

/// A write that comes to no bus is told here.
void Pipeline::tell_stray(const modbus::Adu& adu) const {
    if (shared_->stray && !modbus::is_pure_read(adu.pdu))
        shared_->stray(caller_.who(), adu.unit, adu.pdu);
}

void Pipeline::answer(Ticket ticket, OwnPdu pdu) {
    if (shared_->own_answers->try_acquire()) return put(ticket, pdu());
    shared_->own_answers->wait([weak = weak_from_this(), ticket, pdu = std::move(pdu)] {
        const auto self = weak.lock();
        if (!self || self->closed_) return false;
        self->settle(ticket, pdu());
        return true;
    });
}

void Pipeline::forward(Ticket ticket, std::uint8_t function, Forward forwarding) {
    if (refusing_waiting_) return put(ticket, exception_reply(function, Fault::cancelled));
    caller_.transact(forwarding.target.bus, forwarding.target.station,
                     std::move(forwarding.request),
                     [weak = weak_from_this(), ticket, function](bus::Answer answer) {
                         const auto self = weak.lock();
                         if (self) self->settle(ticket, reply_pdu(function, std::move(answer.pdu)));
                     });
}

void Pipeline::broadcast(Ticket ticket, std::uint8_t function, const Broadcast& broadcasting) {
    if (refusing_waiting_) return put(ticket, exception_reply(function, Fault::cancelled));
    const auto outcome = std::make_shared<BroadcastOutcome>();
    outcome->open = broadcasting.lines.size();
    const auto on_answer = [weak = weak_from_this(), outcome, ticket,
                            function](bus::Answer answer) {
        outcome->add(std::move(answer));
        const auto self = weak.lock();
        if (!self || outcome->open != 0) return;
        self->settle(ticket, outcome->reply(function, self->shared_->settings.broadcast));
    };
    for (bus::BusClient* line : broadcasting.lines)
        caller_.transact(line, 0, broadcasting.request, on_answer);
}

void Pipeline::put(Ticket ticket, std::optional<Bytes> pdu) {
    constexpr auto kBusy = static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
    Slot& slot = slots_[static_cast<std::size_t>(ticket - first_)];
    const modbus::Framing framing = shared_->settings.framing;
    if (pdu) {
        const auto code = modbus::exception_of(*pdu);
        if (code) ++shared_->counters.exceptions;
        if (code == kBusy) ++shared_->counters.busy;
        if (modbus::is_answered(framing, slot.request.unit))
            slot.reply =
                modbus::encode_reply(framing, slot.request.transaction, slot.request.unit, *pdu);
    } else {
        ++shared_->counters.unanswered;
    }
    slot.answered = true;
    --unanswered_;
    while (ready_ < started_ && slots_[ready_].answered) ++ready_;
    skip_silent();
}

void Pipeline::settle(Ticket ticket, std::optional<Bytes> pdu) {
    if (closed_) return;
    put(ticket, std::move(pdu));
    admit();
    if (empty()) joined_ = 0;
    on_answer_();
}

/// Removes what is answered and has nothing to send from the front.
void Pipeline::skip_silent() {
    for (; ready_ > 0 && slots_.front().reply.empty(); --ready_, --started_, ++first_)
        slots_.pop_front();
}

void Pipeline::refuse_waiting() {
    refusing_waiting_ = true;
    admit();
}

void Pipeline::close() {
    if (!std::exchange(closed_, true)) caller_.withdraw();
}

}  // namespace panelgate::tcp_server
