#include "panelgate/web/api/render.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "panelgate/base/words.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

/// How a fault is told. A request that was not transmitted must not sound as if it had been:
/// `unsent` is its text where that differs from the text of a transmitted one.
struct FaultText {
    Fault fault;
    unsigned status;
    const char* text;
    const char* unsent = nullptr;
};
constexpr FaultText kFaults[] = {
    {Fault::denied, 403, "no request may carry this function here"},
    {Fault::malformed, 400, "the request contradicts its function code"},
    {Fault::not_routed, 404, "no line has this station"},
    {Fault::busy, 503, "the line's queue is full; try again"},
    {Fault::expired, 503, "the line could not take the request before its deadline"},
    {Fault::cancelled, 503, "its client had gone, or the gateway is stopping"},
    {Fault::line_down, 502, "the line is down"},
    {Fault::line_lost, 502, "the line was lost while the request was on its way"},
    {Fault::damaged, 502, "only damaged replies came back",
     "nothing was sent: the station's replies come damaged"},
    {Fault::wrong, 502, "the station sent good frames that do not answer the request",
     "nothing was sent: the station's replies do not fit"},
    {Fault::timeout, 504, "the station did not answer in time",
     "nothing was sent: its deadline passed while a reply of the station was outstanding"},
    {Fault::offline, 504, "the station is silent; it is probed from time to time",
     "nothing was sent: the station is silent; it is probed from time to time"},
};

/// The panel manual's meaning of an exception code, or "".
std::string meaning_of(std::uint8_t code, const profile::PanelProfile& profile) {
    for (const profile::ExceptionMeaning& exception : profile.exceptions) {
        if (exception.code == code) return exception.meaning;
    }
    return {};
}

/// The problem for a panel's exception reply.
Problem problem_of_exception(std::uint8_t code, const profile::PanelProfile& profile) {
    std::string detail = "the panel answered exception " + std::to_string(code) + ": ";
    detail += modbus::describe_exception(code);
    const std::string meaning = meaning_of(code, profile);
    if (!meaning.empty()) detail += " (" + meaning + ")";
    Problem made = problem(code >= 1 && code <= 4 ? 422 : 502, std::move(detail), "exception");
    made.extensions["modbus_exception"] = code;
    made.extensions["transmitted"] = true;
    return made;
}

std::string why_denied(const bus::Refusal& refusal) {
    if (!refusal.door.empty()) return std::string(refusal.door);
    if (!refusal.lacking.empty())
        return "the role '" + refusal.why + "' does not have the right " +
               std::string(refusal.lacking);
    if (refusal.why == access::kDefaultRule)
        return "no rule of access allows it, and the default is deny";
    return "the rule '" + refusal.why + "' of access denies it";
}

std::string detail_of(const bus::Refusal& refusal) {
    const std::string station = "station '" + refusal.station + "'";
    switch (refusal.rule) {
        case bus::Rule::read_only:
            return station + " is read-only";
        case bus::Rule::broadcast_over_read_only:
            return "a broadcast would write to " + station + ", which is read-only";
        case bus::Rule::listening:
            return "line '" + refusal.why +
                   "' has another master: it is only listened to (mode: listen); its points show "
                   "what passed by";
        case bus::Rule::standby:
            return "this box is the standby of line '" + refusal.why +
                   "', which another box drives; its points show what passed by";
        case bus::Rule::unrecorded:
            return "a write to " + station +
                   " could not be recorded: the audit's file takes nothing now";
        case bus::Rule::denied:
            return why_denied(refusal);  // who asked by an address is not told a name
        case bus::Rule::function:
        case bus::Rule::quantity:
        case bus::Rule::range:
        case bus::Rule::write_protected:
            return "the guard of " + station + " refuses it" +
                   (refusal.why.empty() ? "" : ": " + refusal.why);
    }
    std::abort();
}

Problem refused(unsigned status, bus::Rule rule, std::string detail) {
    Problem made = problem(status, std::move(detail), "refused");
    made.extensions["rule"] = label(rule);
    made.extensions["transmitted"] = false;
    return made;
}

unsigned status_of(bus::Rule rule) {
    if (rule == bus::Rule::listening) return 409;
    if (rule == bus::Rule::unrecorded || rule == bus::Rule::standby) return 503;
    return bus::is_access(rule) ? 403 : 422;
}

}  // namespace

Problem problem_of(Fault fault, bool transmitted) {
    const FaultText& told = *std::ranges::find(kFaults, fault, &FaultText::fault);
    const char* const text = transmitted || told.unsent == nullptr ? told.text : told.unsent;
    Problem made = problem(told.status, text, label(fault));
    made.extensions["modbus_exception"] = static_cast<std::uint8_t>(modbus::to_exception(fault));
    made.extensions["transmitted"] = transmitted;
    if (made.status == 503) made.headers.emplace_back("Retry-After", "1");
    return made;
}

Problem problem_of(const bus::Refusal& refusal) {
    Problem made = refused(status_of(refusal.rule), refusal.rule,
                           "refused here, nothing was sent: " + detail_of(refusal));
    made.extensions["modbus_exception"] = static_cast<std::uint8_t>(refusal.code);
    if (refusal.rule == bus::Rule::denied) made.extensions["rule"] = refusal.why;
    return made;
}

Problem problem_of(const bus::Answer& answer) {
    if (answer.refusal) return problem_of(*answer.refusal);
    Problem made = problem_of(answer.pdu.error(), answer.transmitted);
    if (!answer.why.empty()) made.detail = "the line is down: " + answer.why;
    return made;
}

std::optional<Problem> problem_of(const bus::Answer& answer, const profile::PanelProfile& profile) {
    if (answer.refusal || !answer.pdu) return problem_of(answer);
    const auto code = modbus::exception_of(*answer.pdu);
    if (code) return problem_of_exception(*code, profile);
    return std::nullopt;
}

Problem ruled_out(bus::Rule rule, std::string detail) {
    return refused(422, rule, std::move(detail));
}

Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return problem_of(request.error(), false);
    return bus::Request{.station = station, .request = std::move(*request)};
}

namespace {

Parsed<PointOrder> point_order(std::uint8_t station, const profile::PanelProfile& profile,
                               const points::Point& point, const points::Value& value) {
    auto write = points::write_request(profile, point, value);
    if (!write) return problem_of(write.error(), "");
    auto request = request_to(station, write->pdu);
    if (!request) return request.error();
    return PointOrder{std::move(*request), std::move(*write)};
}

}  // namespace

Parsed<PointOrder> order_of(const bus::RequestPort& bus, std::uint8_t station,
                            const profile::PanelProfile& profile, const points::Point& point,
                            const points::Value& value) {
    return unless_refused(point_order(station, profile, point, value), bus, station);
}

Parsed<json::object> write_result(const PointOrder& order, const bus::Answer& answer,
                                  const profile::PanelProfile& profile) {
    if (auto failed = problem_of(answer, profile)) return std::move(*failed);
    return confirmed(&order.write);
}

json::object confirmed(const points::PointWrite* write) {
    json::object body{{"transmitted", true}, {"confirmed", true}};
    if (write == nullptr) return body;
    body["value"] = json_of(write->value);
    if (write->label) body["label"] = *write->label;
    return body;
}

json::object point_json(const points::Point& point, const points::PointReading& reading) {
    json::object object;
    object["name"] = point.name;
    object["value"] = nullptr;
    if (reading.value) object["value"] = json_of(*reading.value);
    if (reading.label) object["label"] = *reading.label;
    object["unit"] = point.unit;
    object["quality"] = label(reading.quality);
    object["age_ms"] = nullptr;
    if (reading.age) {
        object["age_ms"] = whole_ms(*reading.age);
    }
    return object;
}

std::int64_t whole_ms(Duration duration) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

std::string upper_hex(ByteView bytes, std::string_view separator) {
    std::string text = to_hex(bytes, separator);
    for (char& c : text) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    return text;
}

std::string point_event(const bus::StationRef& station, const points::Point& point,
                        const points::PointReading& reading) {
    json::object object = point_json(point, reading);
    object["line"] = station.line;
    object["station"] = station.name;
    return json_text(object);
}

std::string line_event(std::string_view line, std::string_view state, std::string_view why) {
    json::object object{{"line", line}, {"state", state}};
    if (!why.empty()) object["why"] = why;
    return json_text(object);
}

std::string station_event(std::string_view line, std::string_view station, std::string_view what) {
    return json_text(json::object{{"line", line}, {"station", station}, {"event", what}});
}

std::string discovery_event(std::string_view line, std::string_view state, std::size_t asked,
                            std::size_t of, std::size_t found) {
    return json_text(json::object{
        {"line", line}, {"state", state}, {"asked", asked}, {"of", of}, {"found", found}});
}

std::string transaction_event(std::string_view line, std::string_view station,
                              std::uint8_t function, std::string_view outcome, Duration took) {
    json::object object{{"line", line},
                        {"station", nullptr},
                        {"function", function},
                        {"outcome", outcome},
                        {"duration_ms", to_milliseconds(took)}};
    if (!station.empty()) object["station"] = station;
    return json_text(object);
}

}  // namespace panelgate::web
