#include "sound_gateway.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::scenario {

void PanelgateMaster::submit(TimePoint now, SoundRequest request) {
    const modbus::Request asked = test::request_of(request.pdu);
    arbiter::Job job{.station = request.station, .request = asked, .client = request.client};
    if (!asked.is_read()) job.priority = PriorityClass::write;
    const Result<arbiter::Ticket> ticket = arbiter_.submit(now, std::move(job));
    if (ticket) {
        numbers_[*ticket] = request.number;
    } else {
        act_.tell("refused: " + std::string(label(ticket.error())), request.pdu);
        act_.finish(request.number, std::nullopt, false);
    }
    drain();
}

void PanelgateMaster::on_rx(TimePoint now, ByteView bytes) {
    arbiter_.on_rx(now, bytes);
    drain();
}

void PanelgateMaster::on_deadline(TimePoint now) {
    arbiter_.on_deadline(now);
    drain();
}

void PanelgateMaster::on_line_up(TimePoint now) {
    arbiter_.on_line_up(now);
    drain();
}

void PanelgateMaster::on_line_down(TimePoint now) {
    arbiter_.on_line_down(now);
    drain();
}

void PanelgateMaster::drain() {
    while (const auto action = arbiter_.poll_action())
        std::visit([this](const auto& one) { act(one); }, *action);
}

void PanelgateMaster::act(const arbiter::Finish& finish) {
    if (!finish.pdu) act_.tell("fault: " + std::string(label(finish.pdu.error())), {});
    const auto reply = finish.pdu ? std::optional(*finish.pdu) : std::nullopt;
    act_.finish(numbers_.at(finish.ticket), reply, finish.transmitted && !finish.shared);
    numbers_.erase(finish.ticket);
}

void PanelgateMaster::act(const arbiter::StationEvent& event) {
    act_.tell(label(event.kind), ByteView(&event.station, 1));
    if (event.kind == arbiter::StationEvent::Kind::offline) act_.offline(event.station);
}

void PanelgateMaster::act(const arbiter::Reset& reset) {
    act_.tell(reset.why, {});
    act_.reset();
}

void PlainMaster::submit(TimePoint now, SoundRequest request) {
    queue_.push_back(std::move(request));
    start(now);
}

void PlainMaster::on_rx(TimePoint now, ByteView bytes) {
    heard_.insert(heard_.end(), bytes.begin(), bytes.end());
    rest_until_ = now + silent_interval(settings_.serial);
    if (attempts_ == 0) return;
    if (const auto found = reply()) finish(now, found);
}

void PlainMaster::on_deadline(TimePoint now) {
    if (attempts_ == 0) return start(now);
    if (now < deadline_) return;
    const bool again =
        test::request_of(queue_.front().pdu).is_read() && attempts_ <= settings_.unlisted.retries;
    if (!again) return finish(now, std::nullopt);
    send(now);
}

std::optional<TimePoint> PlainMaster::next_deadline() const {
    if (attempts_ > 0) return deadline_;
    return queue_.empty() ? std::nullopt : std::optional(rest_until_);
}

void PlainMaster::start(TimePoint now) {
    if (attempts_ == 0 && !queue_.empty() && now >= rest_until_) send(now);
}

void PlainMaster::send(TimePoint now) {
    ++attempts_;
    heard_.clear();
    const Bytes adu = modbus::encode_adu(queue_.front().station, queue_.front().pdu);
    const TimePoint end = now + wire_time(settings_.serial, adu.size());
    // A reply needs time on the wire after it has begun.
    deadline_ = end + settings_.unlisted.response_timeout;
    rest_until_ = end + silent_interval(settings_.serial);
    act_.transmit(adu);
}

/// The first good frame of the station among all heard bytes that answers the request on the wire.
std::optional<Bytes> PlainMaster::reply() const {
    const SoundRequest& asked = queue_.front();
    const auto normal = modbus::reply_length_from_request(asked.pdu);
    for (std::size_t from = 0; from < heard_.size(); ++from) {
        for (const std::size_t size : {normal.value_or(0), modbus::kExceptionAdu}) {
            if (from + size > heard_.size()) continue;
            const auto frame = modbus::decode_adu(ByteView(heard_).subspan(from, size));
            if (frame && frame->station == asked.station && modbus::answers(asked.pdu, frame->pdu))
                return Bytes(frame->pdu.begin(), frame->pdu.end());
        }
    }
    return std::nullopt;
}

void PlainMaster::finish(TimePoint now, const std::optional<Bytes>& reply) {
    act_.finish(queue_.front().number, reply, true);
    queue_.pop_front();
    attempts_ = 0;
    start(now);
}

}  // namespace panelgate::scenario
