#include "trace_text.hpp"

#include <algorithm>
#include <array>
#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>
#include <cstddef>

#include "answers.hpp"
#include "panelgate/base/text.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace json = boost::json;

namespace {

/// Columns stand where they stood in the lines before: a trace may go on for ever.
std::string padded(const std::string& text, std::size_t width) {
    return text + std::string(width - std::min(width, width_of(text)), ' ') + ' ';
}

std::string row(const std::string& time, const std::array<std::string, 4>& words,
                const std::string& total, const std::string& rest) {
    return padded(time, 27) + padded(words[0], 12) + padded(words[1], 6) + padded(words[2], 9) +
           std::string(9 - std::min<std::size_t>(9, total.size()), ' ') + total + "  " +
           padded(words[3], 18) + ' ' + rest + '\n';
}

std::string clean_text(const json::object& object, std::string_view name) {
    return printable(text_of(object, name));
}

std::string total_of(const json::object& transaction) {
    const auto began = number_of(transaction, "arrived");
    const auto ended = number_of(transaction, "answered");
    return began && ended ? latency_text(*ended - *began) : "-";
}

std::string frames_of(const json::object& transaction) {
    const std::string reply = clean_text(transaction, "reply");
    std::string text = "> " + clean_text(transaction, "request");
    if (!reply.empty()) text += "  < " + reply;
    return text;
}

std::string station_name(unsigned id, const std::map<unsigned, std::string>& names) {
    const auto found = names.find(id);
    if (found != names.end()) return printable(found->second);
    return id == 0 ? "broadcast" : std::to_string(id);
}

bool is_wanted(const json::object& transaction, unsigned id, const TraceFilter& filter) {
    if (filter.station != 0 && id != filter.station) return false;
    const std::string outcome = text_of(transaction, "outcome");
    return !filter.errors || (outcome != "ok" && outcome != "open");
}

/// "read of http to station 31 refused: ..." or "poll of press refused: ...".
bool names_station(const std::string& text, const TraceFilter& filter) {
    if (filter.station == 0) return true;
    const auto holds = [&](const std::string& words) {
        return text.find(words + ' ') != text.npos || text.find(words + ':') != text.npos;
    };
    return holds("station " + std::to_string(filter.station)) ||
           (!filter.name.empty() && holds("poll of " + filter.name));
}

}  // namespace

std::string trace_heading() {
    return row("TIME", {"STATION", "WHY", "OUTCOME", "CLIENT"}, "TOTAL", "FRAMES");
}

std::vector<TraceLine> trace_lines(const json::object& page, const TraceFilter& filter,
                                   const std::map<unsigned, std::string>& names) {
    std::vector<TraceLine> lines;
    for (const json::object* one : objects_of(page, "transactions")) {
        const auto id = static_cast<unsigned>(number_of(*one, "station").value_or(0));
        if (!is_wanted(*one, id, filter)) continue;
        const std::string time = clean_text(*one, "time");
        const std::array<std::string, 4> words{station_name(id, names), clean_text(*one, "reason"),
                                               clean_text(*one, "outcome"),
                                               clean_text(*one, "client")};
        lines.push_back({time, row(time, words, total_of(*one), frames_of(*one))});
    }
    for (const json::object* one : objects_of(page, "decisions")) {
        const std::string text = clean_text(*one, "text");
        if (!names_station(text, filter)) continue;
        const std::string time = clean_text(*one, "time");
        lines.push_back({time, padded(time, 27) + text + '\n'});
    }
    std::ranges::sort(lines, {}, [](const TraceLine& line) { return line.time; });
    return lines;
}

namespace {

/// Text of URLs such as mqtt://USER:PASSWORD@HOST, without what stands before the host.
std::string without_passwords(std::string text) {
    constexpr std::string_view kBegin = "://";
    for (std::size_t at = text.find(kBegin); at != text.npos; at = text.find(kBegin, at)) {
        at += kBegin.size();
        const std::size_t end = std::min(text.find_first_of("/\"' \n\\", at), text.size());
        const std::size_t host = text.rfind('@', end);
        if (host != text.npos && host > at && host < end) text.erase(at, host + 1 - at);
    }
    return text;
}

std::string json_quoted(std::string_view text) {
    return json::serialize(json::string(as_utf8(text)));
}

std::string json_of_part(const ReportPart& part) {
    std::string_view body = part.body;
    while (body.ends_with('\n')) body.remove_suffix(1);
    return part.is_json && !body.empty() ? std::string(body) : json_quoted(part.body);
}

}  // namespace

std::string report_text(const std::vector<ReportPart>& parts) {
    std::string text = "{";
    std::string open;  // the member that is being filled
    for (const ReportPart& part : parts) {
        const std::size_t slash = std::min(part.name.find('/'), part.name.size());
        const bool nested = slash < part.name.size();
        const std::string head = nested ? part.name.substr(0, slash) : "";
        if (!open.empty() && open != head) text += "}";
        const bool begins = nested && open != head;
        if (text.size() > 1 && (begins || open != head || !nested)) text += ",\n";
        if (nested && !begins) text += ",\n";
        if (begins) text += json_quoted(head) + ":{";
        text += json_quoted(nested ? part.name.substr(slash + 1) : part.name) + ':' +
                json_of_part(part);
        open = head;
    }
    return without_passwords(text + (open.empty() ? "}\n" : "}}\n"));
}

}  // namespace panelgate::commands
