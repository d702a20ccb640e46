#include <algorithm>

#include "answer.hpp"
#include "ask.hpp"
#include "body.hpp"
#include "handlers.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "refusal.hpp"
#include "station_path.hpp"
#include "write_plan.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// The function that most of the line's listed panels take as a broadcast; the preferred one when
/// they do not decide.
std::uint8_t broadcast_function(const Directory& directory, const LineEntry& line,
                                const std::vector<std::uint8_t>& functions) {
    const auto takers = [&](std::uint8_t function) {
        return std::ranges::count_if(directory.stations, [&](const StationEntry& station) {
            if (station.line != line.name) return false;
            const auto* rule = station.profile->find_function(function);
            return rule != nullptr && rule->broadcast;
        });
    };
    return *std::ranges::max_element(functions, {}, takers);
}

Parsed<void> check_no_verify(const json::object& body) {
    const json::value* verify = body.if_contains("verify");
    if (verify == nullptr || (verify->is_bool() && !verify->get_bool())) return {};
    return problem(400, "verify must be false: verifying a broadcast is not supported");
}

Parsed<bus::Request> broadcast_request(const Directory& directory, const LineEntry& line,
                                       const json::object& body) {
    const auto verify = check_no_verify(body);
    if (!verify) return verify.error();
    const auto word = string_member(body, "table");
    if (!word) return word.error();
    const auto table = parse_table(*word, 400);
    if (!table) return table.error();
    if (!is_writable(*table)) return problem(422, *word + " cannot be written");
    const auto address = number_member(body, "address", 0, 0xFFFF);
    if (!address) return address.error();
    const auto cells = values_member(body, *table);
    if (!cells) return cells.error();

    const auto functions = write_functions(*table, cells->size());
    const std::uint8_t function = broadcast_function(directory, line, functions);
    const unsigned limit = directory.generic->max_count(function);
    if (cells->size() > limit || *address + static_cast<std::int64_t>(cells->size()) > 0x10000) {
        return problem(422, "at most " + std::to_string(limit) +
                                " values in one broadcast, up to address 65535");
    }
    return request_to(0, encode_write(function, static_cast<std::uint16_t>(*address), *cells));
}

Parsed<void> check_raw_station(const Directory& directory, const LineEntry& line, std::uint8_t id,
                               bool may) {
    if (id == 0) return check_may_write(*line.bus, 0);
    const std::string name = line.name + ":" + std::to_string(id);
    const auto station = directory.find_station(name);
    if (!station) return problem(404, "there is no station '" + name + "'");
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

HttpResponse broadcast_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    json::object body;
    body["transmitted"] = true;
    body["confirmed"] = false;
    return json_response(202, body);
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

Handling post_broadcast(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const auto body = parse_object(request.body, {"table", "address", "values", "verify"});
    if (!body) co_return to_response(body.error());
    // What is no request says so first; one is the bus's to refuse, which counts and tells it.
    auto planned = broadcast_request(*api->directory, **line, *body);
    if (!planned) co_return to_response(planned.error());
    bus::Request made = std::move(*planned);
    bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    co_return broadcast_answer(answer);
}

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
    bus::Answer answer = co_await ask(request.caller, (*line)->bus, std::move(made));
    co_return broadcast ? broadcast_answer(answer) : raw_answer(answer);
}

}  // namespace panelgate::web
