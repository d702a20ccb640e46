#include "session.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/write.hpp>
#include <utility>

#include "diagnostics.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/asio_clock.hpp"

namespace panelgate::tcp_server {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using std::chrono::steady_clock;

template <class... T>
struct Overloaded : T... {
    using T::operator()...;
};

Bytes exception_reply(ByteView request, Fault fault) {
    return modbus::encode_exception(request[0], modbus::to_exception(fault));
}

/// What a client is sent for a bus's answer. A reply that no MBAP frame can carry is refused as one
/// that is too large to answer.
Bytes reply_pdu(std::uint8_t function, const Result<Bytes>& pdu) {
    const Bytes request = {function};
    if (!pdu) return exception_reply(request, pdu.error());
    if (pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return exception_reply(request, Fault::malformed);
    }
    return *pdu;
}

Bytes diagnose(ByteView request, const Shared& shared) {
    Diagnostics state;
    state.uptime = rt::now() - shared.started;
    state.version = shared.hooks.version;
    for (const bus::BusClient* line : shared.units.lines()) {
        const bus::LineStatus status = line->status();
        state.lines.push_back({status.up, status.queue_depth, status.load_percent});
    }
    return answer_diagnostics(request, state);
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

void Shared::log(std::string_view event, std::string_view client, std::string_view more) const {
    if (!hooks.log) return;
    std::string line(event);
    line.append(" listener=").append(counters.listener);
    if (!client.empty()) line.append(" client=").append(client);
    if (!more.empty()) line.append(" ").append(more);
    hooks.log(line);
}

Session::Session(asio::ip::tcp::socket socket, std::string client, std::shared_ptr<Shared> shared,
                 ClosedHandler on_closed)
    : socket_(std::move(socket)),
      client_name_(std::move(client)),
      shared_(std::move(shared)),
      on_closed_(std::move(on_closed)),
      partial_timer_(socket_.get_executor()),
      grace_timer_(socket_.get_executor()) {}

void Session::start() { read(); }

void Session::finish() {
    if (closed_) return;
    finishing_ = true;
    write();
}

void Session::close() {
    if (std::exchange(closed_, true)) return;
    const std::shared_ptr<Session> self = shared_from_this();
    error_code ignored;
    socket_.close(ignored);
    partial_timer_.cancel();
    grace_timer_.cancel();
    take_back_waiting();
    if (const ClosedHandler handler = std::exchange(on_closed_, nullptr)) handler(self);
}

void Session::take_back_waiting() {
    const std::set<bus::BusClient*> buses = used_;  // an answer may close this session meanwhile
    for (bus::BusClient* bus : buses) bus->cancel(client_);
}

void Session::fail(std::string_view reason, bool protocol_error) {
    if (protocol_error) ++shared_->counters.protocol_errors;
    shared_->log("connection closed", client_name_, reason);
    close();
}

// Input. The read loop never stops while the connection lives: what comes while finishing is thrown
// away, because closing a socket with unread input would cut off replies that are under way.

void Session::read() {
    socket_.async_read_some(asio::buffer(input_),
                            [self = shared_from_this()](const error_code& error, std::size_t size) {
                                self->on_read(error, size);
                            });
}

void Session::on_read(const error_code& error, std::size_t size) {
    if (closed_) return;
    if (error == asio::error::eof) return on_end_of_input();
    if (error) return close();
    if (!finishing_) {
        framer_.feed(ByteView(input_.data(), size));
        const bool progress = take_adus();
        if (closed_) return;
        guard_partial_adu(progress);
    }
    write();
    if (!closed_) read();
}

/// Serves every whole ADU that is there. Was there one?
bool Session::take_adus() {
    bool progress = false;
    while (auto event = framer_.next()) {
        progress = true;
        if (std::holds_alternative<modbus::Broken>(*event)) {
            fail("reason=\"length outside 2..254\"", true);
            return false;
        }
        if (std::holds_alternative<modbus::SkippedProtocol>(*event)) {
            if (!skip_protocol()) return false;
            continue;
        }
        bad_protocol_ids_ = 0;
        serve(std::get<modbus::Adu>(*event));
    }
    return progress;
}

/// MBAP-06. Does the connection live on?
bool Session::skip_protocol() {
    if (++bad_protocol_ids_ >= shared_->settings.bad_protocol_ids) {
        fail("reason=\"protocol id is not 0\"", true);
        return false;
    }
    ++shared_->counters.protocol_errors;
    return true;
}

/// An ADU has partial_adu_timeout from its first byte to its last (MBAP-07): the timer starts anew
/// only when another ADU begins.
void Session::guard_partial_adu(bool progress) {
    if (!framer_.partial()) {
        partial_watch_ = 0;
        partial_timer_.cancel();
        return;
    }
    if (partial_watch_ != 0 && !progress) return;
    partial_watch_ = ++partial_watches_;
    partial_timer_.expires_after(
        std::chrono::duration_cast<steady_clock::duration>(shared_->settings.partial_adu_timeout));
    partial_timer_.async_wait(
        [self = shared_from_this(), watch = partial_watch_](error_code error) {
            if (error || self->closed_ || self->partial_watch_ != watch) return;
            self->fail("reason=\"half-sent ADU\"", true);
        });
}

void Session::on_end_of_input() {
    finishing_ = true;
    partial_watch_ = 0;
    partial_timer_.cancel();
    if (framer_.partial()) ++shared_->counters.protocol_errors;
    write();
    if (closed_) return;
    watch_for_reset();
    grace_timer_.expires_after(
        std::chrono::duration_cast<steady_clock::duration>(shared_->settings.half_close_grace));
    grace_timer_.async_wait([self = shared_from_this()](error_code error) {
        if (!error && !self->closed_) self->take_back_waiting();
    });
}

/// A client that closed both directions answers the first reply with a reset: then nobody waits for
/// the others.
void Session::watch_for_reset() {
    socket_.async_wait(asio::ip::tcp::socket::wait_error,
                       [self = shared_from_this()](const error_code&) { self->close(); });
}

// Requests.

void Session::serve(const modbus::Adu& adu) {
    const Decision decision = decide(adu.unit, adu.pdu, shared_->settings, shared_->units);
    const auto push = [&](Bytes pdu) { replies_.push(adu.transaction, adu.unit, std::move(pdu)); };
    const bool full = replies_.in_flight() >= shared_->settings.in_flight;
    const auto admit = [&] {
        if (full) push(exception_reply(adu.pdu, Fault::busy));
        return !full;
    };
    std::visit(Overloaded{
                   [&](const Refuse& refusal) {
                       push(modbus::encode_exception(adu.pdu[0], refusal.code));
                   },
                   [&](const Diagnose&) { push(diagnose(adu.pdu, *shared_)); },
                   [&](const Forward& forwarding) {
                       if (admit()) forward(adu, forwarding.target);
                   },
                   [&](const Broadcast& broadcasting) {
                       if (admit()) broadcast(adu, broadcasting.lines);
                   },
               },
               decision);
}

void Session::use(bus::BusClient* bus) {
    if (used_.insert(bus).second) bus->name_client(client_, "modbus_tcp " + client_name_);
}

bus::Request Session::make_request(const modbus::Adu& adu, std::uint8_t station) const {
    bus::Request request;
    request.station = station;
    request.pdu = adu.pdu;
    request.client = client_;
    request.priority = modbus::is_pure_read(adu.pdu) ? arbiter::PriorityClass::read
                                                     : arbiter::PriorityClass::write;
    return request;
}

void Session::forward(const modbus::Adu& adu, const Target& target) {
    const ReplyQueue::Ticket ticket = replies_.open(adu.transaction, adu.unit);
    use(target.bus);
    target.bus->transact(
        make_request(adu, target.station),
        [weak = weak_from_this(), ticket, function = adu.pdu[0]](const bus::Answer& answer) {
            const auto self = weak.lock();
            if (self) self->settle(ticket, reply_pdu(function, answer.pdu));
        });
}

void Session::broadcast(const modbus::Adu& adu, const std::vector<bus::BusClient*>& lines) {
    const ReplyQueue::Ticket ticket = replies_.open(adu.transaction, adu.unit);
    const auto outcome = std::make_shared<BroadcastOutcome>();
    outcome->open = lines.size();
    const auto on_answer = [weak = weak_from_this(), outcome, ticket,
                            function = adu.pdu[0]](bus::Answer answer) {
        outcome->add(std::move(answer));
        const auto self = weak.lock();
        if (!self || outcome->open != 0) return;
        self->settle(ticket, outcome->reply(function, self->shared_->settings.broadcast));
    };
    for (bus::BusClient* line : lines) {
        used_.insert(line);
        line->transact(make_request(adu, 0), on_answer);
    }
}

// Output.

void Session::settle(ReplyQueue::Ticket ticket, std::optional<Bytes> pdu) {
    if (closed_) return;
    if (pdu) {
        replies_.settle(ticket, std::move(*pdu));
    } else {
        replies_.drop(ticket);
    }
    write();
}

void Session::write() {
    if (closed_) return;
    if (replies_.ready_bytes() + output_.size() > shared_->settings.output_limit) {
        return fail("reason=\"client does not read\"", false);
    }
    if (writing_) return;
    std::optional<Bytes> adu = replies_.pop();
    if (!adu) {
        if (finishing_ && replies_.empty()) close();
        return;
    }
    output_ = std::move(*adu);
    writing_ = true;
    asio::async_write(socket_, asio::buffer(output_),
                      [self = shared_from_this()](const error_code& error, std::size_t) {
                          self->on_written(error);
                      });
}

void Session::on_written(const error_code& error) {
    writing_ = false;
    output_.clear();
    if (closed_) return;
    if (error) return close();
    write();
}

}  // namespace panelgate::tcp_server
