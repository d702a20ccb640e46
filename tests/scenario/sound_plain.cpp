#include "sound_plain.hpp"

#include <utility>

#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::sound {

Result<arbiter::Ticket> PlainGateway::submit(TimePoint now, arbiter::Job job) {
    job.ticket = ++last_ticket_;
    queue_.push_back(std::move(job));
    start(now);
    return last_ticket_;
}

void PlainGateway::on_rx(TimePoint now, ByteView bytes) {
    heard_.insert(heard_.end(), bytes.begin(), bytes.end());
    rest_until_ = now + silent_interval(settings_.serial);
    if (attempts_ == 0) return;
    if (auto found = reply()) finish(now, std::move(*found));
}

void PlainGateway::on_deadline(TimePoint now) {
    if (attempts_ == 0) return start(now);
    if (now < deadline_) return;
    if (queue_.front().request.is_read() && attempts_ <= settings_.unlisted.retries)
        return send(now);
    finish(now, Fault::timeout);
}

std::optional<arbiter::Action> PlainGateway::poll_action(TimePoint) {
    if (actions_.empty()) return std::nullopt;
    arbiter::Action next = std::move(actions_.front());
    actions_.pop_front();
    return next;
}

std::optional<TimePoint> PlainGateway::next_deadline() const {
    if (attempts_ > 0) return deadline_;
    return queue_.empty() ? std::nullopt : std::optional(rest_until_);
}

void PlainGateway::start(TimePoint now) {
    if (attempts_ == 0 && !queue_.empty() && now >= rest_until_) send(now);
}

void PlainGateway::send(TimePoint now) {
    ++attempts_;
    heard_.clear();
    Bytes adu = modbus::encode_adu(queue_.front().station, queue_.front().request.pdu());
    deadline_ = now + wire_time(settings_.serial, adu.size()) + settings_.unlisted.response_timeout;
    actions_.push_back(arbiter::Transmit{std::move(adu)});
}

/// The first good frame of the station among all heard bytes that answers the request on the wire.
std::optional<Bytes> PlainGateway::reply() const {
    const arbiter::Job& job = queue_.front();
    for (std::size_t from = 0; from < heard_.size(); ++from) {
        for (const std::size_t size :
             {job.request.reply_length().value_or(0), modbus::kExceptionAdu}) {
            if (from + size > heard_.size()) continue;
            const auto frame = modbus::decode_adu(ByteView(heard_).subspan(from, size));
            if (frame && frame->station == job.station &&
                modbus::answers(job.request.pdu(), frame->pdu))
                return Bytes(frame->pdu.begin(), frame->pdu.end());
        }
    }
    return std::nullopt;
}

void PlainGateway::finish(TimePoint now, Result<Bytes> pdu) {
    arbiter::Finish done;
    done.ticket = queue_.front().ticket;
    done.pdu = std::move(pdu);
    done.transmitted = true;
    actions_.push_back(std::move(done));
    queue_.pop_front();
    attempts_ = 0;
    start(now);
}

}  // namespace panelgate::sound
