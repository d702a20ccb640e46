#include "csv.hpp"

#include <utility>
#include <vector>

#include "accept.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace json = boost::json;
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

}  // namespace panelgate::web
