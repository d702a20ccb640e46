#include "csv.hpp"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

std::string_view trimmed(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return text;
}

/// Cuts off what comes before the separator; the rest stays in `text`.
std::string_view next(std::string_view& text, char separator) {
    const auto at = std::min(text.find(separator), text.size());
    const std::string_view part = text.substr(0, at);
    text.remove_prefix(std::min(at + 1, text.size()));
    return trimmed(part);
}

/// The weight among these parameters; 1 when there is none.
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

bool prefers_csv(std::string_view accept) {
    double csv = 0;
    double other = 0;
    while (!accept.empty()) {
        std::string_view item = next(accept, ',');
        const std::string_view type = next(item, ';');
        const double weight = weight_of(item);
        if (type == "text/csv") csv = weight;
        if (type == "application/json") other = weight;
    }
    return csv > 0 && csv >= other;
}

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
