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
    step_over_silent();
}

std::optional<bool> ReplyQueue::newest_is(std::uint16_t transaction, std::uint8_t unit,
                                          ByteView pdu, MakesOld makes_old) const {
    for (std::size_t i = slots_.size(); i-- > 0;) {
        const Slot& slot = slots_[i];
        if (slot.transaction == transaction)
            return slot.unit == unit && std::ranges::equal(slot.request, pdu);
        if (makes_old(slot.request, pdu)) return false;
    }
    return std::nullopt;
}

void ReplyQueue::pop() {
    slots_.front().adu.clear();
    step_over_silent();
}

void ReplyQueue::step_over_silent() {
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

/// What a client is sent for a bus's answer. A reply that no MBAP frame can carry is refused as one
/// that is too large to answer.
Bytes reply_pdu(std::uint8_t function, Result<Bytes> pdu) {
    if (!pdu) return exception_reply(function, pdu.error());
    if (pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return exception_reply(function, Fault::malformed);
    }
    return std::move(*pdu);
}

/// Could it change what the read gives? Units may be aliases, so they tell nothing.
bool makes_old(ByteView request, ByteView read) {
    if (request.empty() || !modbus::is_pure_read(read) || modbus::is_pure_read(request))
        return false;
    if (!modbus::check_request(request)) return false;  // refused
    const auto span = modbus::read_span(read);
    return !span || modbus::may_change(modbus::access_of(request).write, *span);
}

/// Gathers what the lines say of one broadcast.
struct BroadcastOutcome {
    std::size_t open = 0;  ///< lines that have not answered yet
    std::optional<Bytes> sent;
    std::optional<bus::Answer> failed;

    void add(bus::Answer answer) {
        --open;
        if (answer.pdu) {
            sent = *answer.pdu;
        } else if (!failed || (answer.transmitted && !failed->transmitted)) {
            failed = std::move(answer);  // the one whose outcome is unknown is worth telling
        }
    }
    /// What the client is sent; nothing when the mode is silent and a frame may have left (TBC-06).
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

/// A reply takes room until the client has taken it: who reads slowly is asked for slowly. So do
/// repetitions, or whoever says one thing without end would be listened to without end.
bool Pipeline::has_room() const {
    const Settings& settings = shared_->settings;
    return replies_.size() + waiting_.size() + joined_ < settings.in_flight + settings.waiting;
}

/// May a repetition of this one get its answer?
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

/// Only with the last one of its transaction id: clients that give all the same id mean on, off,
/// on. A read behind a write wants what is there then.
bool Pipeline::is_joined(const modbus::Adu& adu) const {
    if (!may_join(adu.pdu)) return false;
    for (std::size_t i = waiting_.size(); i-- > 0;) {
        if (waiting_[i].transaction == adu.transaction) return waiting_[i] == adu;
        if (makes_old(waiting_[i].pdu, adu.pdu)) return false;
    }
    return replies_.newest_is(adu.transaction, adu.unit, adu.pdu, makes_old).value_or(false);
}

/// One that goes to the bus.
ReplyQueue::Ticket Pipeline::open(const modbus::Adu& adu) {
    const bool known_again = may_join(adu.pdu);
    return replies_.open(adu.transaction, adu.unit, known_again ? adu.pdu : Bytes());
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

/// Everything waits for a place on the buses, also what needs none: a refusal or the gateway's own
/// registers are answered as things are when the requests before have started.
void Pipeline::admit() {
    const std::size_t places = shared_->settings.in_flight;
    while (!waiting_.empty() && (turning_away_ || replies_.in_flight() < places)) {
        const modbus::Adu adu = std::move(waiting_.front());
        waiting_.pop_front();
        serve(adu);
    }
}

void Pipeline::serve(const modbus::Adu& adu) {
    std::visit(Overloaded{
                   [&](const Refuse& refusal) {
                       for (const Target& target : refusal.asked)
                           caller_.tell_refused(target.bus, target.station, adu.pdu);
                       answer(adu, [function = adu.pdu[0], code = refusal.code] {
                           return modbus::encode_exception(function, code);
                       });
                   },
                   [&](const Diagnose&) {
                       answer(adu, [pdu = adu.pdu, shared = shared_.get()] {
                           return answer_diagnostics(pdu, own_state(*shared));
                       });
                   },
                   [&](Forward forwarding) { forward(adu, std::move(forwarding)); },
                   [&](const Broadcast& broadcasting) { broadcast(adu, broadcasting); },
               },
               decide(adu.unit, adu.pdu, shared_->settings, shared_->units));
}

void Pipeline::answer(const modbus::Adu& adu, OwnPdu pdu) {
    if (shared_->own_answers->may_give())
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
    if (turning_away_) return refuse(adu, Fault::cancelled);
    const ReplyQueue::Ticket ticket = open(adu);
    caller_.transact(forwarding.target.bus, forwarding.target.station,
                     std::move(forwarding.request),
                     [weak = weak_from_this(), ticket, function = adu.pdu[0]](bus::Answer answer) {
                         const auto self = weak.lock();
                         if (self) self->settle(ticket, reply_pdu(function, std::move(answer.pdu)));
                     });
}

void Pipeline::broadcast(const modbus::Adu& adu, const Broadcast& broadcasting) {
    if (turning_away_) return refuse(adu, Fault::cancelled);
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

void Pipeline::turn_away() {
    turning_away_ = true;
    admit();
}

void Pipeline::close() {
    if (std::exchange(closed_, true)) return;
    waiting_.clear();
    caller_.withdraw();
}

}  // namespace panelgate::tcp_server
