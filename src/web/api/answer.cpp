#include "answer.hpp"

#include <boost/json/object.hpp>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "refusal.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

unsigned status_of(Fault fault) {
    switch (fault) {
        case Fault::denied:
            return 403;
        case Fault::malformed:
            return 400;
        case Fault::not_routed:
            return 404;
        case Fault::busy:
        case Fault::expired:
        case Fault::cancelled:
            return 503;
        case Fault::line_down:
        case Fault::line_lost:
        case Fault::damaged:
            return 502;
        case Fault::timeout:
        case Fault::offline:
            return 504;
    }
    std::abort();
}

/// Of what was not transmitted the words must not sound as if it had been.
const char* detail_of(Fault fault, bool transmitted) {
    switch (fault) {
        case Fault::denied:
            return "no request may carry this function here";
        case Fault::malformed:
            return "the request contradicts its function code";
        case Fault::not_routed:
            return "no line has this station";
        case Fault::busy:
            return "the line's queue is full; try again";
        case Fault::expired:
            return "the line could not take the request before its deadline";
        case Fault::line_down:
            return "the line is down";
        case Fault::line_lost:
            return "the line was lost while the request was on its way";
        case Fault::timeout:
            return transmitted ? "the station did not answer in time"
                               : "nothing was sent: its time was over while the station owed an "
                                 "answer";
        case Fault::damaged:
            return transmitted ? "only damaged replies came back"
                               : "nothing was sent: the station's replies come damaged";
        case Fault::offline:
            return transmitted ? "the station is silent; it is probed from time to time"
                               : "nothing was sent: the station is silent; it is probed from time "
                                 "to time";
        case Fault::cancelled:
            return "its client had gone, or the gateway is stopping";
    }
    std::abort();
}

/// The panel manual's word for an exception code, or "".
std::string meaning_of(std::uint8_t code, const profile::PanelProfile& profile) {
    for (const profile::ExceptionMeaning& exception : profile.exceptions) {
        if (exception.code == code) return exception.meaning;
    }
    return {};
}

}  // namespace

HttpResponse json_response(unsigned status, const json::value& body) {
    HttpResponse response;
    response.status = status;
    response.body = json_text(body) + "\n";
    return response;
}

Problem problem_of(Fault fault, bool transmitted) {
    Problem made = problem(status_of(fault), detail_of(fault, transmitted), label(fault));
    made.extensions["modbus_exception"] = static_cast<std::uint8_t>(modbus::to_exception(fault));
    made.extensions["transmitted"] = transmitted;
    if (made.status == 503) made.headers.emplace_back("Retry-After", "1");
    return made;
}

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

HttpResponse broadcast_answer(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return to_response(problem_of(answer));
    json::object body;
    body["transmitted"] = true;
    body["confirmed"] = false;
    return json_response(202, body);
}

std::int64_t whole_ms(Duration duration) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
}

std::string upper_hex(ByteView bytes, std::string_view separator) {
    std::string text = to_hex(bytes, separator);
    for (char& c : text) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    return text;
}

}  // namespace panelgate::web
