#include "answer.hpp"

#include <algorithm>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json/object.hpp>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "conduct.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "station_path.hpp"

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
        case Fault::wrong:
            return 502;
        case Fault::timeout:
        case Fault::offline:
            return 504;
    }
    std::abort();
}

/// The text for a request that was not transmitted must not sound as if it had been.
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
                               : "nothing was sent: its deadline passed while a reply of the "
                                 "station was outstanding";
        case Fault::damaged:
            return transmitted ? "only damaged replies came back"
                               : "nothing was sent: the station's replies come damaged";
        case Fault::wrong:
            return transmitted ? "the station sent good frames that do not answer the request"
                               : "nothing was sent: the station's replies do not fit";
        case Fault::offline:
            return transmitted ? "the station is silent; it is probed from time to time"
                               : "nothing was sent: the station is silent; it is probed from time "
                                 "to time";
        case Fault::cancelled:
            return "its client had gone, or the gateway is stopping";
    }
    std::abort();
}

/// The panel manual's meaning of an exception code, or "".
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

namespace {

/// Removes and returns the part before the separator; the rest stays in `text`.
std::string_view next(std::string_view& text, char separator) {
    const auto at = std::min(text.find(separator), text.size());
    const std::string_view part = text.substr(0, at);
    text.remove_prefix(std::min(at + 1, text.size()));
    return trimmed(part);
}

/// The weight ("q=") among these parameters; 1 if there is none.
double weight_of(std::string_view parameters) {
    while (!parameters.empty()) {
        const std::string_view one = next(parameters, ';');
        if (!one.starts_with("q=") && !one.starts_with("Q=")) continue;
        double weight = 0;
        std::from_chars(one.data() + 2, one.data() + one.size(), weight);
        return weight;
    }
    return 1;
}

}  // namespace

bool prefers(std::string_view accept, std::string_view type) {
    double wanted = 0;
    double other = 0;
    while (!accept.empty()) {
        std::string_view item = next(accept, ',');
        const std::string_view one = next(item, ';');
        const double weight = weight_of(item);
        if (one == type) wanted = weight;
        if (one == "application/json") other = weight;
    }
    return wanted > 0 && wanted >= other;
}

namespace {

std::string quoted(std::string_view field) {
    if (field.find_first_of(",\"\r\n") == field.npos) return std::string(field);
    std::string text = "\"";
    for (const char c : field) text += c == '"' ? std::string("\"\"") : std::string(1, c);
    return text + '"';
}

std::string field_of(const json::object& object, std::string_view column) {
    const json::value* value = object.if_contains(column);
    if (value == nullptr || value->is_null()) return {};
    if (value->is_string() && !exact_digits(*value)) return std::string(value->get_string());
    return json_text(*value);
}

}  // namespace

bool prefers_csv(std::string_view accept) { return prefers(accept, "text/csv"); }

std::string csv_line(std::span<const std::string_view> fields) {
    std::string line;
    for (const std::string_view& field : fields) {
        if (&field != &fields.front()) line += ',';
        line += quoted(field);
    }
    return line + "\r\n";
}

std::string csv_line(const json::object& object, std::span<const std::string_view> columns) {
    std::vector<std::string> texts;
    for (const std::string_view column : columns) texts.push_back(field_of(object, column));
    const std::vector<std::string_view> fields(texts.begin(), texts.end());
    return csv_line(fields);
}

HttpResponse csv_response(std::string body) {
    HttpResponse response;
    response.content_type = "text/csv; charset=utf-8; header=present";
    response.body = std::move(body);
    return response;
}

namespace {

constexpr std::size_t kPackedOfATurn = 16 * 1024;  ///< bytes: about 0.3 ms of work

}  // namespace

boost::asio::awaitable<std::string> packed(std::string body) {
    Gzip gzip;
    for (std::string_view left = body; !left.empty();) {
        const std::string_view piece = left.substr(0, kPackedOfATurn);
        gzip.add(piece);
        left.remove_prefix(piece.size());
        boost::asio::awaitable<void> turn = yield_turn();
        if (!left.empty()) co_await std::move(turn);
    }
    co_return gzip.finish();
}

/// About 0.1 ms of work.
constexpr std::size_t kEntriesOfATurn = 16;

void LongAnswer::begin_member(std::string_view name) {
    if (!std::exchange(is_first_, false)) text_ += ',';
    text_ += json_text(json::value(name)) + ':';
}

LongAnswer& LongAnswer::begin_list(std::string_view name) {
    begin_member(name);
    text_ += '[';
    is_first_ = true;
    return *this;
}

void LongAnswer::add(const json::value& entry) {
    if (!std::exchange(is_first_, false)) text_ += ',';
    text_ += json_text(entry);
    ++entries_;
}

LongAnswer& LongAnswer::end_list() {
    text_ += ']';
    is_first_ = false;
    return *this;
}

LongAnswer& LongAnswer::member(std::string_view name, const json::value& value) {
    begin_member(name);
    text_ += json_text(value);
    return *this;
}

bool LongAnswer::is_turn_over() {
    if (entries_ < kEntriesOfATurn) return false;
    entries_ = 0;
    return true;
}

HttpResponse LongAnswer::response() {
    HttpResponse response;
    response.body = std::move(text_) + "}\n";
    return response;
}

boost::asio::awaitable<void> yield_turn() {
    const auto executor = co_await boost::asio::this_coro::executor;
    co_await boost::asio::post(executor, boost::asio::use_awaitable);
}

Handling table_answer(HttpRequest request, Table table) {
    const bool as_csv = prefers_csv(request.headers["accept"]);
    LongAnswer body;
    for (const auto& [name, value] : table.members) body.member(name, value);
    std::string lines = csv_line(table.columns);
    body.begin_list(table.name);
    for (std::size_t i = 0; i < table.count; ++i) {
        const boost::json::object one = table.entry(i);
        if (as_csv) {
            lines += csv_line(one, table.columns);
            body.add(nullptr);  // only to count entries for is_turn_over()
        } else {
            body.add(one);
        }
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = yield_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    HttpResponse response = as_csv ? csv_response(std::move(lines)) : body.response();
    response.headers.emplace_back("Vary", "Accept");
    co_return response;
}

KeptAnswer::KeptAnswer(std::string text, std::string_view content_type)
    : text_(std::make_shared<const std::string>(std::move(text))),
      tag_(tag_of(*text_)),
      content_type_(content_type) {}

boost::asio::awaitable<HttpResponse> KeptAnswer::give(std::shared_ptr<KeptAnswer> self,
                                                      HttpRequest request) {
    HttpResponse response;
    response.content_type = self->content_type_;
    const bool known = add_etag(response, request.headers["if-none-match"], self->tag_);
    response.headers.emplace_back("Vary", "Accept-Encoding");
    if (known) co_return response;
    response.shared_body = self->text_;
    if (!accepts_gzip(request.headers["accept-encoding"])) co_return response;
    if (!self->packed_) {
        boost::asio::awaitable<std::string> packing = packed(*self->text_);
        self->packed_ = std::make_shared<const std::string>(co_await std::move(packing));
    }
    response.shared_body = self->packed_;
    response.headers.emplace_back("Content-Encoding", "gzip");
    co_return response;
}

}  // namespace panelgate::web
