#include "answers.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "panelgate/base/text.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace json = boost::json;

std::string text_of(const json::object& object, std::string_view name) {
    return web::member_text(object, name);
}

std::optional<double> number_of(const json::object& object, std::string_view name) {
    const json::value* found = object.if_contains(name);
    if (found == nullptr || !found->is_number()) return std::nullopt;
    return found->to_number<double>();
}

std::vector<const json::object*> objects_of(const json::object& object, std::string_view name) {
    std::vector<const json::object*> found;
    const json::value* list = object.if_contains(name);
    if (list == nullptr || !list->is_array()) return found;
    for (const json::value& one : list->get_array())
        if (one.is_object()) found.push_back(&one.get_object());
    return found;
}

std::string value_text(const json::value& value) {
    if (value.is_null()) return "-";
    if (value.is_double()) return number_text(value.get_double());
    if (value.is_string()) return printable(value.get_string());
    if (!value.is_array()) return json::serialize(value);
    std::string text;
    for (const json::value& one : value.get_array())
        text += (text.empty() ? "" : " ") + value_text(one);
    return text;
}

namespace {

bool flag_of(const json::object& object, std::string_view name) {
    const json::value* found = object.if_contains(name);
    return found != nullptr && found->is_bool() && found->get_bool();
}

json::array values_of(const json::object& answer) {
    const json::value* list = answer.if_contains("values");
    if (list != nullptr && list->is_array()) return list->get_array();
    const json::value* one = answer.if_contains("value");
    return one != nullptr ? json::array{*one} : json::array{};
}

std::string ago(const json::object& answer) {
    const auto age = number_of(answer, "age_ms");
    return age ? "read " + span_text(*age / 1000) + " ago" : "";
}

std::string with_label(const json::object& answer, const json::value& value) {
    const std::string label = printable(text_of(answer, "label"));
    return value_text(value) + (label.empty() ? "" : " (" + label + ')');
}

}  // namespace

std::string reading_text(const json::object& answer, std::string_view type) {
    const json::array values = values_of(answer);
    const auto count = static_cast<std::uint64_t>(values.size());
    const std::string table = printable(text_of(answer, "table"));
    const auto first = static_cast<std::uint64_t>(number_of(answer, "address").value_or(0));
    const std::uint64_t width = type.ends_with("64") ? 4 : type.ends_with("32") ? 2 : 1;
    std::string place = printable(text_of(answer, "notation"));
    const bool kept = text_of(answer, "source") == "cache";
    const json::value* all = answer.if_contains("notations");
    const json::array notations =
        all != nullptr && all->is_array() ? all->get_array() : json::array();
    TextTable rows({"", "", ""});
    for (std::uint64_t i = 0; i < count; ++i) {
        if (i < notations.size())
            place = value_text(notations[i]);
        else if (i > 0 || place.empty())
            place = table + '/' + std::to_string(first + i * width);
        rows.add({place, value_text(values[i]), kept ? ago(answer) : ""});
    }
    return rows.text(false);
}

bool is_good(const json::object& point) { return text_of(point, "quality") == "good"; }

std::string point_text(const json::object& point) {
    const json::value* value = point.if_contains("value");
    if (value == nullptr || value->is_null()) return "no value";
    const std::string unit = printable(text_of(point, "unit"));
    const std::string quality = printable(text_of(point, "quality"));
    return with_label(point, *value) + (unit.empty() ? "" : ' ' + unit) +
           (quality == "good" ? "" : ", " + quality);
}

std::string point_line(const std::string& shown, const json::object& point) {
    const std::string when = ago(point);
    return shown + "  " + point_text(point) + (when.empty() ? "" : ", " + when) + '\n';
}

bool is_confirmed(const json::object& answer) { return flag_of(answer, "confirmed"); }

std::string written_text(const std::string& shown, const std::string& typed,
                         const json::object& answer) {
    const json::array values = values_of(answer);
    const std::string what = values.size() == 1 ? with_label(answer, values[0]) : printable(typed);
    const char* how = is_confirmed(answer)             ? "confirmed"
                      : flag_of(answer, "transmitted") ? "transmitted, not confirmed"
                                                       : "not transmitted";
    return shown + " = " + what + ", " + how + '\n';
}

namespace {

/// A refusal's text without what only makes sense to who has written the request: a query that
/// there is, and the place in a JSON that the command line has made.
std::string without_rest(std::string text) {
    constexpr std::string_view kRound = "; ?round=true writes the nearest";
    constexpr std::string_view kPlace = "line 1, column ";
    if (text.ends_with(kRound)) text.resize(text.size() - kRound.size());
    const std::size_t place = text.find(kPlace);
    if (place == text.npos) return text;
    const std::size_t end = text.find(": ", place);
    return end == text.npos ? text : text.substr(end + 2);
}

}  // namespace

std::string not_written_text(const json::object& problem) {
    std::string text = without_rest(printable(text_of(problem, "detail")));
    const std::string title = printable(text_of(problem, "title"));
    if (text.empty()) text = title.empty() ? "the gateway does not say why" : title;
    const json::value* transmitted = problem.if_contains("transmitted");
    if (transmitted == nullptr || !transmitted->is_bool()) return text;
    if (!transmitted->get_bool())
        return text + (text.find("nothing was sent") != text.npos ? "" : "; nothing was sent");
    const bool answered = text_of(problem, "type").ends_with(":exception");
    return text + (answered ? "; it was transmitted, and the panel has refused it"
                            : "; it was transmitted, so it may be in effect");
}

std::vector<Event> EventCutter::take(std::string_view more) {
    std::vector<Event> events;
    rest_ += more;
    std::size_t begin = 0;
    for (std::size_t end = rest_.find('\n'); end != rest_.npos; end = rest_.find('\n', begin)) {
        std::string_view text = std::string_view(rest_).substr(begin, end - begin);
        if (text.ends_with('\r')) text.remove_suffix(1);
        line(text, events);
        begin = end + 1;
    }
    rest_.erase(0, begin);
    return events;
}

void EventCutter::line(std::string_view text, std::vector<Event>& events) {
    if (text.empty()) {
        if (!event_.data.empty()) events.push_back(std::exchange(event_, {}));
        event_ = {};
        return;
    }
    const std::size_t colon = std::min(text.find(':'), text.size());
    const std::string_view field = text.substr(0, colon);
    std::string_view value = text.substr(std::min(colon + 1, text.size()));
    if (value.starts_with(' ')) value.remove_prefix(1);
    if (field == "event") event_.type = value;
    if (field == "data") event_.data += (event_.data.empty() ? "" : "\n") + std::string(value);
}

}  // namespace panelgate::commands
