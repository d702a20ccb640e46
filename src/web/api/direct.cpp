#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "patience.hpp"
#include "refusal.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

Parsed<void> check_raw_station(const Directory& directory, const LineEntry& line, std::uint8_t id,
                               bool may) {
    if (id == 0) return check_may_write(*line.bus, 0);
    const std::string name = line.name + ":" + std::to_string(id);
    const auto station = directory.find_station(name);
    if (!station) return problem(404, "there is no station '" + name + "'", "unknown-station");
    if (may) return {};
    return check_may_write(*line.bus, id);
}

/// Nobody answers a broadcast, so it can do nothing but write.
Problem no_broadcast() {
    Problem made = problem_of(Fault::denied, false);
    made.detail =
        "refused here, nothing was sent: station 0 is all stations of the line, of which none "
        "answers: a broadcast can write (05, 06, 15, 16), but not read";
    return made;
}

Parsed<bus::Request> raw_request(const Directory& directory, const LineEntry& line,
                                 const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxStation);
    if (!station) return station.error();
    const auto hex = string_member(body, "pdu");
    if (!hex) return hex.error();
    auto pdu = from_hex(*hex);
    if (!pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) {
        return problem(400, "pdu must be 1 to 253 bytes as pairs of hex digits");
    }
    const auto id = static_cast<std::uint8_t>(*station);
    const bool reads = modbus::is_pure_read(*pdu);  // also of one that is malformed
    const bool spreads = modbus::is_broadcastable(pdu->front());
    auto made = request_to(id, std::move(*pdu));
    if (id == 0 && !spreads && (made || reads)) return no_broadcast();
    const auto allowed = check_raw_station(directory, line, id, reads || made);
    if (!allowed) return allowed.error();
    return made;
}

/// What was no request, or is refused before its bus is asked: the bus counts and logs it.
void tell_refused(Caller& caller, bus::BusClient& bus, const json::object& body) {
    const auto station = number_member(body, "station", 0, modbus::kMaxStation);
    const auto hex = string_member(body, "pdu");
    const auto pdu = hex ? from_hex(*hex) : std::nullopt;
    if (!station || !pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu) return;
    introduce(caller, &bus);
    bus.tell_refused(static_cast<std::uint8_t>(*station), *pdu, caller.id());
}

/// A panel's exception is an answer, too.
HttpResponse raw_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    json::object body;
    body["pdu"] = upper_hex(*answer.pdu, "");
    if (const auto code = modbus::exception_of(*answer.pdu)) body["exception"] = *code;
    return json_response(200, body);
}

}  // namespace

Handling post_raw(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto body = parse_object(request.body, {"station", "pdu"});
    if (!body) co_return to_response(body.error());
    auto planned = raw_request(*api->directory, **line, *body);
    if (!planned) {
        tell_refused(*request.caller, *(*line)->bus, *body);
        co_return to_response(planned.error());
    }
    bus::Request made = std::move(*planned);
    const bool broadcast = made.station == 0;
    const Patience patience(request, (*line)->deadline, api->providers.now);
    made.within = patience.left();
    bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    co_return broadcast ? broadcast_answer(answer) : raw_answer(answer);
}

}  // namespace panelgate::web
