#include "answer.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "panelgate/base/text.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {

namespace json = boost::json;

HttpResponse json_response(unsigned status, const json::value& body) {
    return text_response(status, json_text(body) + "\n", "application/json");
}

HttpResponse text_response(unsigned status, std::string body, std::string_view content_type) {
    HttpResponse response;
    response.status = status;
    response.content_type = content_type;
    response.body = std::move(body);
    return response;
}

bool wants_csv(std::string_view accept) {
    const auto csv = accept.find("text/csv");
    return csv != accept.npos && csv < accept.find("application/json");
}

/// As a technician writes the item `behind` the first; "" if the panel is not known.
std::string notation_of(const Target& target, std::size_t behind) {
    const auto address = static_cast<std::uint16_t>(target.span.first + behind);
    if (target.area != nullptr) return profile::format_notation(*target.area, address);
    if (target.station.unknown_panel) return "";
    return profile::format_notation(*target.station.profile, target.span.table, address);
}

json::object describe(const Target& target, const View& view, const Reading& reading) {
    const std::string notation = notation_of(target, 0);
    json::array values = values_of(view, reading.items);
    json::object body;
    body["station"] = target.station.name;
    body["table"] = label(target.span.table);
    body["address"] = target.span.first;
    body["notation"] = nullptr;
    if (!notation.empty()) body["notation"] = notation;
    if (!notation.empty() && values.size() > 1) {
        json::array notations;
        for (std::size_t i = 0; i < values.size(); ++i)
            notations.emplace_back(notation_of(target, i * target.span.count / values.size()));
        body["notations"] = std::move(notations);
    }
    body["values"] = std::move(values);
    if (view.raw) body["raw"] = json::array(reading.items.begin(), reading.items.end());
    body["age_ms"] = whole_ms(reading.age);
    body["source"] = reading.cached ? "cache" : "bus";
    if (reading.transactions > 1) body["transactions"] = reading.transactions;
    return body;
}

points::PointReading point_reading(const points::Point& point, const Reading& reading) {
    points::PointReading made;
    made.value = points::decode(point, reading.items);
    made.label = points::label_of(point, reading.items);
    made.quality = made.value ? points::Quality::good : points::Quality::bad;
    made.age = reading.age;
    return made;
}

namespace {

std::string quoted(std::string_view field) {
    if (field.find_first_of(",\"\r\n") == field.npos) return std::string(field);
    std::string text = "\"";
    for (const char c : field) text += c == '"' ? std::string("\"\"") : std::string(1, c);
    return text + '"';
}

/// A panel writes some texts: none may be a formula for a spreadsheet, or steer a terminal.
std::string harmless(std::string text) {
    std::ranges::replace_if(text, is_control, '?');
    const bool is_formula = text.find_first_of("=+-@") == 0;
    return is_formula ? '\'' + text : text;
}

std::string field_of(const json::object& object, std::string_view column) {
    const json::value* value = object.if_contains(column);
    if (value == nullptr || value->is_null()) return {};
    if (value->is_string() && !exact_digits(*value))
        return harmless(std::string(value->get_string()));
    return json_text(*value);
}

}  // namespace

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

std::string LongAnswer::text() { return std::move(text_) + "}\n"; }

namespace {

std::string csv_of(const Table& table) {
    std::string lines = csv_line(table.columns);
    for (std::size_t i = 0; i < table.count; ++i) lines += csv_line(table.entry(i), table.columns);
    return lines;
}

std::string json_of(const Table& table) {
    LongAnswer body;
    for (const auto& [name, value] : table.members) body.member(name, value);
    body.begin_list(table.name);
    for (std::size_t i = 0; i < table.count; ++i) body.add(table.entry(i));
    body.end_list();
    for (const auto& [name, value] : table.behind) body.member(name, value);
    return body.text();
}

}  // namespace

HttpResponse table_answer(const HttpRequest& request, Table table) {
    const bool as_csv = !table.columns.empty() && wants_csv(header(request, "accept"));
    HttpResponse response;
    if (as_csv) response.content_type = "text/csv; charset=utf-8; header=present";
    if (!table.columns.empty()) response.headers.emplace_back("Vary", "Accept");
    constexpr std::size_t kLong = 100;  // entries: about a millisecond of work
    response.is_long = table.count > kLong;
    response.finish = [as_csv, table = std::move(table)](HttpResponse& made) {
        made.body = as_csv ? csv_of(table) : json_of(table);
    };
    return response;
}

HttpResponse KeptAnswer::give(const std::shared_ptr<KeptAnswer>& self, const HttpRequest& request) {
    HttpResponse response;
    response.content_type = self->content_type_;
    response.finish = [self, known = std::string(header(request, "if-none-match")),
                       takes_gzip = accepts_gzip(header(request, "accept-encoding"))](
                          HttpResponse& made) { self->give(made, known, takes_gzip); };
    return response;
}

void KeptAnswer::give(HttpResponse& response, const std::string& if_none_match, bool takes_gzip) {
    if (const auto make = std::exchange(make_, nullptr)) {
        text_ = std::make_shared<const std::string>(make());
        tag_ = tag_of(*text_);
    }
    const bool known = add_etag(response, if_none_match, tag_);
    response.headers.emplace_back("Vary", "Accept-Encoding");
    if (known) return;
    response.shared_body = text_;
    if (!takes_gzip) return;
    if (!packed_) packed_ = std::make_shared<const std::string>(packed(*text_));
    response.headers.emplace_back("Content-Encoding", "gzip");
    response.shared_body = packed_;
}

namespace {

/// The end of the value of an age, or of `time`; `at` if neither begins there. Other members that
/// end in _ms are configured or measured, and count.
std::size_t end_of_age(std::string_view body, std::size_t at) {
    constexpr std::string_view kTime = "\"time\":\"";
    constexpr std::string_view kAges[] = {"\"age_ms\":", "\"gone_ms\":", "\"last_error_ms\":",
                                          "\"last_success_ms\":", "\"last_write_ms\":"};
    const std::string_view rest = body.substr(at);
    if (!rest.starts_with('"')) return at;
    if (rest.starts_with(kTime))
        return std::min(body.find('"', at + kTime.size()), body.size() - 1) + 1;
    for (const std::string_view age : kAges)
        if (rest.starts_with(age))
            return std::min(body.find_first_of(",}", at + age.size()), body.size());
    return at;
}

}  // namespace

std::string tag_of(std::string_view body) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (std::size_t at = 0; at < body.size();) {
        const std::size_t behind = end_of_age(body, at);
        if (behind != at) {
            at = behind;
            continue;
        }
        hash = (hash ^ static_cast<unsigned char>(body[at])) * 1099511628211u;
        ++at;
    }
    std::array<char, 32> text{};
    const int size = std::snprintf(text.data(), text.size(), "W/\"%016llx\"",
                                   static_cast<unsigned long long>(hash));
    return std::string(text.data(), static_cast<std::size_t>(size));
}

bool add_etag(HttpResponse& response, std::string_view if_none_match, const std::string& tag) {
    response.headers.emplace_back("ETag", tag);
    // Strong or weak, the text in quotes is the same.
    const std::string_view quoted = std::string_view(tag).substr(tag.find('"'));
    const bool known = if_none_match == "*" || if_none_match.find(quoted) != if_none_match.npos;
    if (known) response.status = 304;
    return known;
}

}  // namespace panelgate::web
