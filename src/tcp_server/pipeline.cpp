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

/// Clients without a unit id that are remembered. Beyond them a client may be told of again.
constexpr std::size_t kMostWithoutUnit = 1000;

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
    /// Returns what to answer; nullopt if the mode is silent and a frame may have been sent
    /// (TBC-06).
    std::optional<Result<Bytes>> result(BroadcastMode mode) const {
        const bool silent = mode == BroadcastMode::silent;
        if (silent && (sent || failed->transmitted)) return std::nullopt;
        return sent ? Result<Bytes>(*sent) : failed->pdu;
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
                       tell_no_unit(adu, refusal.code);
                       for (const Target& target : refusal.asked)
                           caller_.count_refused(target.bus, target.station, adu.pdu);
                       answer(ticket, [this, function, code = refusal.code] {
                           return exception(function, code);
                       });
                   },
                   [&](const Diagnose&) {
                       tell_stray(adu);
                       answer(ticket, [this, pdu = adu.pdu] {
                           return reply_pdu(
                               pdu[0], answer_diagnostics(pdu, own_state(*shared_, caller_.who())));
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

/// Tells once of a client that asks unit 0 or 255 where nothing is: libmodbus and S7's MB_CLIENT
/// have 255 without a unit id, Kepware and EasyModbus 0.
void Pipeline::tell_no_unit(const modbus::Adu& adu, modbus::ExceptionCode code) const {
    if (code != modbus::to_exception(Fault::not_routed)) return;
    if (adu.unit != 0 && adu.unit != 255) return;
    auto& known = shared_->without_unit;
    if (known.size() >= kMostWithoutUnit) known.clear();
    if (!known.insert(caller_.who()->address).second) return;
    shared_->log(rt::LogLevel::warn, "client without a unit id",
                 {{"client", client()},
                  {"hint", "asks unit " + std::to_string(adu.unit) + ": is no unit id set?"}});
}

std::optional<Bytes> Pipeline::exception(std::uint8_t function, modbus::ExceptionCode code) const {
    if (shared_->settings.exceptions != Exceptions::all) return std::nullopt;
    return modbus::encode_exception(function, code);
}

/// Converts a bus's answer to a reply. A PDU too long for an MBAP frame becomes the same exception
/// as a malformed reply.
std::optional<Bytes> Pipeline::reply_pdu(std::uint8_t function, Result<Bytes> pdu) const {
    if (!pdu) return exception(function, modbus::to_exception(pdu.error()));
    if (pdu->empty() || pdu->size() > modbus::kMaxPdu)
        return exception(function, modbus::to_exception(Fault::malformed));
    if (shared_->settings.exceptions == Exceptions::none && modbus::exception_of(*pdu))
        return std::nullopt;
    return std::move(*pdu);
}

/// `pdu` is called while this object lives.
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
    if (refusing_waiting_)
        return put(ticket, exception(function, modbus::to_exception(Fault::cancelled)));
    caller_.transact(forwarding.target.bus, forwarding.target.station,
                     std::move(forwarding.request),
                     [weak = weak_from_this(), ticket, function](bus::Answer answer) {
                         const auto self = weak.lock();
                         if (self)
                             self->settle(ticket, self->reply_pdu(function, std::move(answer.pdu)));
                     });
}

void Pipeline::broadcast(Ticket ticket, std::uint8_t function, const Broadcast& broadcasting) {
    if (refusing_waiting_)
        return put(ticket, exception(function, modbus::to_exception(Fault::cancelled)));
    const auto outcome = std::make_shared<BroadcastOutcome>();
    outcome->open = broadcasting.lines.size();
    const auto on_answer = [weak = weak_from_this(), outcome, ticket,
                            function](bus::Answer answer) {
        outcome->add(std::move(answer));
        const auto self = weak.lock();
        if (!self || outcome->open != 0) return;
        auto result = outcome->result(self->shared_->settings.broadcast);
        self->settle(ticket, result ? self->reply_pdu(function, std::move(*result)) : std::nullopt);
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
