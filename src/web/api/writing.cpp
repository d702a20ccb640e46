#include "writing.hpp"

#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/web/api/point_order.hpp"
#include "panelgate/web/api/value_json.hpp"
#include "panelgate/web/http/client_log.hpp"
#include "reading.hpp"
#include "refusal.hpp"
#include "view.hpp"
#include "write_plan.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

Problem not_writable(modbus::Table table) {
    Problem made = problem(405, std::string(label(table)) + " cannot be written", "not-writable");
    made.headers.emplace_back("Allow", "GET, HEAD");
    return made;
}

/// With what reading back needs, when the body wants it.
Parsed<Writing> writing_of(const StationEntry& station, Bytes pdu, const json::object& body) {
    const auto verify = flag_member(body, "verify");
    if (!verify) return verify.error();
    auto request = request_to(station.id, std::move(pdu));
    if (!request) return request.error();
    Writing made{.station = station, .request = std::move(*request)};
    if (!*verify) return made;
    made.verification = Verification::of(made.request.request);
    const auto readable = made.verification->span_to_read(*station.profile);
    if (!readable) return readable.error();
    return made;
}

/// The registers of values of a type: "f32", "i32", ... A string has as many as its `length` says,
/// or as it needs.
Parsed<std::vector<std::uint16_t>> typed_cells(const json::object& body, modbus::Table table) {
    const auto wording = wording_of(body);
    if (!wording) return wording.error();
    auto view = view_of(*wording, table);
    if (!view) return view.error();
    const auto values = values_member(body);
    if (!values) return values.error();
    std::vector<std::uint16_t> cells;
    for (const json::value& one : *values) {
        const auto value = value_of(one);
        if (!value) return value.error();
        const auto* text = std::get_if<std::string>(&*value);
        if (text != nullptr && !wording->length)
            view->value.length = static_cast<unsigned>(text->size() + text->size() % 2);
        const auto registers = points::encode(view->value, *value);
        if (!registers) return problem_of(registers.error(), "");
        cells.insert(cells.end(), registers->begin(), registers->end());
    }
    return cells;
}

Parsed<std::vector<std::uint16_t>> cells_of(const json::object& body, modbus::Table table) {
    const bool is_typed =
        std::ranges::any_of(std::array{"type", "order", "length"},
                            [&](const char* name) { return body.contains(name); });
    return is_typed ? typed_cells(body, table) : values_member(body, table);
}

Parsed<Writing> plan(const Items& items, const Parsed<json::object>& body) {
    if (!is_writable(items.span.table)) return not_writable(items.span.table);
    if (!body) return body.error();
    const auto cells = cells_of(*body, items.span.table);
    if (!cells) return cells.error();
    auto pdu = plan_write(items, *cells);
    if (!pdu) return pdu.error();
    return writing_of(items.station, std::move(*pdu), *body);
}

Parsed<Writing> plan(const PointOfStation& to, const Parsed<json::object>& body,
                     const Parsed<points::Rounding>& rounding) {
    if (!rounding) return rounding.error();
    if (!body) return body.error();
    const auto value = value_member(*body);
    if (!value) return value.error();
    auto write = points::write_request(*to.station.profile, *to.point, *value, *rounding);
    if (!write) return problem_of(write.error(), "; ?round=true writes the nearest");
    auto made = writing_of(to.station, write->pdu, *body);
    if (made) made->point = std::move(*write);
    return made;
}

/// Nobody knows what came of it: it was on the wire, and no reply told.
bool is_unknown(const bus::Answer& answer) {
    return answer.transmitted && !answer.refusal && !answer.pdu;
}

json::object confirmed(const Writing& writing) {
    if (writing.point) return web::confirmed(*writing.point);
    return {{"transmitted", true}, {"confirmed", true}};
}

}  // namespace

void log_refused(const Caller& caller, const std::string& at, const Problem& why) {
    constexpr std::array<unsigned, 4> kRefusals{403, 405, 409, 422};
    if (std::ranges::find(kRefusals, why.status) == kRefusals.end()) return;
    log_client(caller, "write refused",
               {{"at", at}, {"status", std::to_string(why.status)}, {"why", why.detail}});
}

void tell(json::object& told, const ReadBack& back) {
    told["verified"] = nullptr;
    if (!back.holds) {
        told["verify_detail"] = back.why;
        return;
    }
    told["verified"] = *back.holds;
    if (!*back.holds) told["read_back"] = json::array(back.items.begin(), back.items.end());
}

boost::asio::awaitable<ReadBack> read_back(std::shared_ptr<Caller> caller,
                                           const StationEntry* station, const Verification* written,
                                           Patience patience) {
    ReadBack back;
    const auto span = written->span_to_read(*station->profile);
    if (!span) {
        back.why = span.error().detail;
        co_return back;
    }
    boost::asio::awaitable<Parsed<Reading>> reads =
        read_all(std::move(caller), station, *span, patience);
    const Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) {
        back.why = reading.error().detail;
        co_return back;
    }
    back.holds = written->holds(reading->items);
    if (!*back.holds) back.items = reading->items;
    co_return back;
}

Parsed<Items> made_writable(Parsed<Items> items) {
    if (!items || items->area == nullptr) return items;
    const auto& also = items->area->also;
    const auto writable = std::ranges::find_if(also, is_writable);
    if (!is_writable(items->span.table) && writable != also.end()) items->span.table = *writable;
    if (is_writable(items->span.table) && !items->area->writable) {
        return ruled_out(bus::Rule::write_protected,
                         items->area->name + " is read-only in this panel");
    }
    return items;
}

Parsed<Writing> write_of(const Items& items, const Parsed<json::object>& body) {
    return unless_refused(plan(items, body), *items.station.bus, items.station.id);
}

Parsed<Writing> write_of(const PointOfStation& to, const Parsed<json::object>& body,
                         const Parsed<points::Rounding>& rounding) {
    return unless_refused(plan(to, body, rounding), *to.station.bus, to.station.id);
}

boost::asio::awaitable<Parsed<json::object>> write(std::shared_ptr<Caller> caller,
                                                   const Writing* writing, Patience patience) {
    bus::Request request = writing->request;
    request.within = patience.left();
    const bus::Answer answer = co_await ask(caller, writing->station.bus, std::move(request));
    auto failed = problem_of(answer, *writing->station.profile);
    json::object told = confirmed(*writing);
    json::object& verified = failed ? failed->extensions : told;
    if (writing->verification && (!failed || is_unknown(answer))) {
        boost::asio::awaitable<ReadBack> reads =
            read_back(std::move(caller), &writing->station, &*writing->verification, patience);
        const ReadBack back = co_await std::move(reads);
        tell(verified, back);
    }
    if (failed) co_return std::move(*failed);
    co_return told;
}

}  // namespace panelgate::web
