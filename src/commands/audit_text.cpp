#include "audit_text.hpp"

#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <boost/json/value.hpp>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <utility>

#include "answers.hpp"
#include "panelgate/base/time.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace json = boost::json;

namespace {

constexpr std::array<std::string_view, 5> kClientKeys{"client", "address", "token", "user",
                                                      "cause"};

/// Returns a member of any type as text; "" for a missing member.
std::string any_text(const json::object& record, std::string_view name) {
    const json::value* value = record.if_contains(name);
    if (value == nullptr) return {};
    const auto* list = value->if_array();
    if (list == nullptr) return printable(value_text(*value));
    std::string text;
    for (const json::value& one : *list)
        text += (text.empty() ? "" : ", ") + printable(value_text(one));
    return text;
}

void add(std::string& line, const std::string& text) {
    if (text.empty()) return;
    if (!line.empty()) line += "  ";
    line += text;
}

/// "press UW102 = 21 (was 20)"
std::string place_text(const json::object& record) {
    std::string station = text_of(record, "station");
    if (station.empty() && record.contains("id"))
        station = text_of(record, "line") + ':' + any_text(record, "id");
    if (any_text(record, "id") == "0") station = text_of(record, "line") + " all stations";
    std::string place = text_of(record, "at");
    if (place.empty() && record.contains("table"))
        place = text_of(record, "table") + '/' + any_text(record, "address");
    std::string text = place.empty() ? station : station + ' ' + place;
    for (const char* key : {"values", "pdu", "and_mask", "or_mask"}) {
        const std::string value = any_text(record, key);
        const bool plain = std::string_view(key) == "values";
        if (!value.empty()) text += (plain ? " = " : ' ' + std::string(key) + ' ') + value;
    }
    const std::string before = any_text(record, "before");
    return before.empty() ? text : text + " (was " + before + ')';
}

std::string outcome_text(const json::object& record) {
    std::string text = text_of(record, "outcome");
    std::ranges::replace(text, '_', ' ');
    const std::string rule = text_of(record, "rule");
    if (!rule.empty()) text += " by rule " + rule;
    if (text_of(record, "by") == "panel")
        text += " by the panel, exception " + any_text(record, "exception");
    const std::string why = printable(text_of(record, "why"));
    return why.empty() ? text : text + (text.empty() ? "" : ": ") + why;
}

/// Members that have no words of their own.
std::string rest_text(const json::object& record) {
    constexpr std::array<std::string_view, 27> kTold{
        "n",        "time",  "kind",     "hash",     "client",  "station",      "line",
        "id",       "at",    "table",    "address",  "count",   "values",       "before",
        "pdu",      "rule",  "outcome",  "why",      "by",      "exception",    "face",
        "listener", "token", "function", "and_mask", "or_mask", "before_age_ms"};
    std::string text;
    for (const auto& [key, value] : record) {
        if (std::ranges::find(kTold, std::string_view(key)) != kTold.end()) continue;
        add(text, std::string(key) + '=' + any_text(record, key));
    }
    return text;
}

/// Finds a station by the name in the record, or by line and id, because a station may have been
/// renamed.
bool is_about_station(const json::object& record, const AuditFilter& filter) {
    if (filter.station.empty() && filter.line.empty()) return true;
    if (!filter.station.empty() && text_of(record, "station") == filter.station) return true;
    const std::string id = any_text(record, "id");
    return !filter.line.empty() && text_of(record, "line") == filter.line &&
           (id == filter.id || id == "0");
}

}  // namespace

bool is_shown(const json::object& record, const AuditFilter& filter) {
    const std::string time = text_of(record, "time");
    if (!filter.since.empty() && time < filter.since) return false;
    if (!filter.until.empty() && time >= filter.until) return false;
    if (!filter.kind.empty() && text_of(record, "kind") != filter.kind) return false;
    if (!is_about_station(record, filter)) return false;
    return filter.client.empty() || std::ranges::any_of(kClientKeys, [&](std::string_view key) {
               return text_of(record, key).find(filter.client) != std::string::npos;
           });
}

std::string audit_line(const json::object& record) {
    std::string line =
        text_of(record, "time") + "  " + any_text(record, "n") + ' ' + text_of(record, "kind");
    const bool is_write = text_of(record, "kind") == "write";
    add(line, is_write || record.contains("station") ? place_text(record) : "");
    add(line, outcome_text(record));
    if (!is_write && record.contains("count")) add(line, any_text(record, "count") + " times");
    std::string client = printable(text_of(record, "client"));
    if (client.empty()) client = text_of(record, "address");
    const std::string token = text_of(record, "token");
    if (!token.empty() && client.find("token " + token) == client.npos)
        add(client, "token " + token);
    add(line, client);
    add(line, rest_text(record));
    return line;
}

namespace {

/// A day, or a day and a time (RFC 3339), as the beginning of a record's time; nullopt if there is
/// no such.
std::optional<std::string> point_in_time(std::string_view typed) {
    std::string_view rest = typed;
    if (take_day(rest) && rest.empty()) return std::string(typed);
    const auto time = parse_rfc3339(typed);
    if (!time) return std::nullopt;
    std::string text = rfc3339(*time);
    text.erase(text.find_last_not_of("0Z") + 1);
    if (text.ends_with('.')) text.pop_back();
    return text;
}

}  // namespace

std::optional<std::string> audit_time(std::string_view typed, WallTime now) {
    using std::chrono::seconds;
    constexpr std::array<std::pair<std::string_view, std::int64_t>, 5> kUnits{
        {{"min", 60}, {"s", 1}, {"h", 3600}, {"d", 86'400}, {"w", 604'800}}};
    if (typed.size() >= 10 && typed[4] == '-' && typed[7] == '-') return point_in_time(typed);
    constexpr std::int64_t kMost = 100'000'000;
    std::int64_t number = 0;
    const auto [end, wrong] = std::from_chars(typed.data(), typed.data() + typed.size(), number);
    const std::string_view unit = typed.substr(static_cast<std::size_t>(end - typed.data()));
    const auto found = std::ranges::find(kUnits, unit, [](const auto& one) { return one.first; });
    if (wrong != std::errc{} || found == kUnits.end() || number < 0 || number > kMost)
        return std::nullopt;
    return rfc3339(now - seconds(std::min(number, kMost / found->second) * found->second));
}

}  // namespace panelgate::commands
