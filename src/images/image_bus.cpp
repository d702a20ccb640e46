#include "panelgate/images/image_bus.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/points/point.hpp"

namespace panelgate::images {

namespace {

using modbus::ExceptionCode;
using modbus::Span;

Bytes packed(const Span& items, std::span<const std::uint16_t> values) {
    Writer out;
    if (modbus::is_bit_table(items.table)) {
        const Bytes bits = modbus::pack_bits(std::vector<bool>(values.begin(), values.end()));
        out.u8(static_cast<unsigned>(bits.size())).raw(bits);
    } else {
        out.u8(static_cast<unsigned>(2 * values.size()));
        for (const std::uint16_t value : values) out.u16(value);
    }
    return out.take();
}

Bytes reply_of(std::uint8_t function, const Span& items, std::span<const std::uint16_t> values) {
    Writer out;
    out.u8(function).raw(packed(items, values));
    return out.take();
}

/// The items of a place in the image, as the panel has the point's items.
std::vector<std::uint16_t> panel_items(const Place& place, std::span<const std::uint16_t> items) {
    std::vector<std::uint16_t> made(items.begin(), items.end());
    if (place.point->bit) made[0] = static_cast<std::uint16_t>(items[0] << *place.point->bit);
    return made;
}

}  // namespace

/// The writes of the points of one request, one after another.
struct ImageBus::Writing {
    struct Step {
        bus::BusClient* bus;
        bus::Request request;  ///< `within`: from the beginning of the first step
    };
    std::vector<Step> steps;
    std::size_t next = 0;
    TimePoint began;
    Bytes pdu;  ///< as asked
    bus::ClientId client = 0;
    bool cancelled = false;
    bool transmitted = false;
    bus::AnswerHandler handler;
};

ImageBus::ImageBus(boost::asio::any_io_executor executor, rt::Clock& clock, Refused refused)
    : executor_(std::move(executor)), clock_(clock), refused_(std::move(refused)) {}

ImageBus::~ImageBus() = default;

void ImageBus::answer(bus::AnswerHandler handler, Pdu pdu) {
    bus::Answer made;
    made.pdu = std::move(pdu);
    made.source = bus::Source::cache;
    boost::asio::post(executor_, [handler = std::move(handler), made = std::move(made)]() mutable {
        handler(std::move(made));
    });
}

void ImageBus::transact(bus::Request request, bus::AnswerHandler handler) {
    if (!content_) return answer(std::move(handler), Fault::not_routed);
    const bool is_read = modbus::reads_table(request.request.function());
    Pdu pdu = is_read ? read(request) : begin_write(request, handler);
    if (!pdu || !pdu->empty()) answer(std::move(handler), std::move(pdu));
}

bool ImageBus::may_read(const Source& source, const Place& place, const WhoRef& who) const {
    const points::Point& point = *place.point;
    const Span items{point.table, point.address, point.count()};
    const auto refusal = source.bus->refusal_of(
        {.station = source.station, .request = modbus::Request::read(items), .who = who});
    if (refusal) source.bus->count_denied(refusal->why);
    return !refusal;
}

ImageBus::Pdu ImageBus::read(const bus::Request& request) const {
    const std::uint8_t function = request.request.function();
    const auto& items = request.request.span();
    const Layout& layout = content_->layout;
    if (!items || items->end() > layout.size(items->table))
        return modbus::encode_exception(function, ExceptionCode::illegal_data_address);
    const std::vector<std::size_t> touched = layout.touched(*items);
    std::vector<Shown> shown;
    shown.reserve(touched.size());
    const TimePoint now = clock_.now();
    for (const std::size_t at : touched) {
        const Source& source = content_->sources[at];
        const Place& place = layout.places()[at];
        if (!may_read(source, place, request.who)) return Fault::denied;
        shown.push_back(
            {source.points->items(*place.point), source.points->read(*place.point, now).quality});
    }
    const auto values = layout.read(*items, content_->settings.stale, touched, shown);
    if (!values) return Fault::offline;
    return reply_of(function, *items, *values);
}

/// Returns an empty PDU where the answer comes later.
ImageBus::Pdu ImageBus::begin_write(const bus::Request& request, bus::AnswerHandler& handler) {
    auto writing = std::make_shared<Writing>();
    Pdu refused = plan(request, *writing);
    if (!refused || !refused->empty()) {
        count_refused(request.station, request.request.pdu(), request.who);
        return refused;
    }
    writing->began = clock_.now();
    writing->pdu = request.request.pdu();
    writing->client = request.client;
    writing->handler = std::move(handler);
    std::erase_if(writings_, [](const auto& one) { return one.expired(); });
    writings_.push_back(writing);
    go_on(writing);
    return Bytes{};
}

/// Checks the whole request before its first point is written. Returns the refusal, or an empty
/// PDU.
ImageBus::Pdu ImageBus::plan(const bus::Request& request, Writing& writing) const {
    const std::uint8_t function = request.request.function();
    if (!request.request.is_broadcastable()) return Fault::denied;
    const auto items = request.request.access().write;
    const Layout& layout = content_->layout;
    const auto refuse = [&](ExceptionCode code) {
        return modbus::encode_exception(function, code);
    };
    if (!items || items->end() > layout.size(items->table))
        return refuse(ExceptionCode::illegal_data_address);
    const std::vector<std::size_t> touched = layout.touched(*items);
    if (!layout.is_whole(*items, touched)) return refuse(ExceptionCode::illegal_data_address);
    const auto values = points::items_written(request.request.pdu(), items->count);
    for (const std::size_t at : touched) {
        const Span& place = layout.places()[at].items;
        Pdu refused =
            plan_point(at, std::span(values).subspan(place.first - items->first, place.count),
                       request, writing);
        if (!refused || !refused->empty()) return refused;
    }
    return Bytes{};
}

ImageBus::Pdu ImageBus::plan_point(std::size_t at, std::span<const std::uint16_t> items,
                                   const bus::Request& request, Writing& writing) const {
    const std::uint8_t function = request.request.function();
    const Place& place = content_->layout.places()[at];
    const Source& source = content_->sources[at];
    if (!place.point->writable)
        return modbus::encode_exception(function, ExceptionCode::illegal_data_address);
    const auto value = points::decode(*place.point, panel_items(place, items));
    const auto write = value ? points::write_request(*source.profile, *place.point, *value)
                             : points::Encoded<points::PointWrite>(points::WriteRefusal{});
    auto made = write ? modbus::Request::make(write->pdu, modbus::QuantityCheck::wide)
                      : Result<modbus::Request>(Fault::malformed);
    if (!made) return modbus::encode_exception(function, ExceptionCode::illegal_data_value);
    bus::Request step{.station = source.station,
                      .request = std::move(*made),
                      .client = request.client,
                      .who = request.who,
                      .within = std::min(request.within, source.deadline)};
    if (const auto refusal = source.bus->refusal_of(step)) {
        source.bus->count_refused(step.station, step.request.pdu(), step.who);
        return modbus::encode_exception(function, refusal->code);
    }
    writing.steps.push_back({source.bus, std::move(step)});
    return Bytes{};
}

void ImageBus::go_on(const std::shared_ptr<Writing>& writing) {
    Writing::Step& step = writing->steps[writing->next++];
    step.request.within -= clock_.now() - writing->began;
    step.bus->transact(std::move(step.request), [this, writing](bus::Answer answer) {
        on_answer(writing, std::move(answer));
    });
}

/// The first failure ends the request: later points are not written.
void ImageBus::on_answer(const std::shared_ptr<Writing>& writing, bus::Answer answer) {
    writing->transmitted = writing->transmitted || answer.transmitted;
    answer.transmitted = writing->transmitted;
    const auto exception = answer.pdu ? modbus::exception_of(*answer.pdu) : std::nullopt;
    const bool is_good = answer.pdu && !exception;
    if (is_good && writing->next < writing->steps.size()) {
        const bool is_late =
            clock_.now() - writing->began >= writing->steps[writing->next].request.within;
        if (!writing->cancelled && !is_late) return go_on(writing);
        answer.pdu = writing->cancelled ? Fault::cancelled : Fault::timeout;
    } else if (is_good) {
        answer.pdu = modbus::normal_write_reply(writing->pdu);
    } else if (exception) {
        answer.pdu =
            modbus::encode_exception(writing->pdu[0], static_cast<ExceptionCode>(*exception));
    }
    writing->handler(std::move(answer));
}

void ImageBus::count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) {
    if (refused_ && !modbus::is_pure_read(pdu)) refused_(who, station, pdu);
}

namespace {

std::set<bus::BusClient*> buses_of(const std::shared_ptr<const Content>& content) {
    std::set<bus::BusClient*> all;
    if (content)
        for (const Source& source : content->sources) all.insert(source.bus);
    return all;
}

}  // namespace

void ImageBus::cancel(bus::ClientId client) {
    for (const auto& one : writings_)
        if (const auto writing = one.lock(); writing && writing->client == client)
            writing->cancelled = true;
    for (bus::BusClient* line : buses_of(content_)) line->cancel(client);
}

void ImageBus::name_client(bus::ClientId client, std::string name) {
    for (bus::BusClient* line : buses_of(content_)) line->name_client(client, name);
}

bus::LineStatus ImageBus::status() const {
    bus::LineStatus status;
    if (content_) status.name = content_->settings.name;
    status.up = content_ != nullptr;
    return status;
}

bus::StationStatus ImageBus::station_status(std::uint8_t) const {
    bus::StationStatus status;
    status.state = content_ ? Health::online : Health::unknown;
    return status;
}

bus::TracePart ImageBus::trace(std::size_t) const { return {}; }

}  // namespace panelgate::images
