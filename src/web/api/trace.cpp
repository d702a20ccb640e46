#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "answer.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/web/api/render.hpp"
#include "pcapng.hpp"
#include "routes.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

struct TracePage {
    bus::TracePart part;
    std::uint64_t next = 0;  ///< for the next page: trace_since(next)
};

/// The sequence numbers of all entries, ascending.
std::vector<std::uint64_t> numbers_of(const bus::TracePart& part) {
    std::vector<std::uint64_t> numbers;
    const auto add = [&](const auto& entries) {
        for (const auto& entry : entries) numbers.push_back(entry.sequence);
    };
    add(part.frames);
    add(part.decisions);
    add(part.transactions);
    std::ranges::sort(numbers);
    return numbers;
}

/// The last frames, decisions and transactions, at most `most` of each.
TracePage last_of_trace(const bus::LineView& bus, std::size_t most) {
    TracePage page{.part = bus.trace(most)};
    const auto numbers = numbers_of(page.part);
    page.next = numbers.empty() ? 0 : numbers.back();
    return page;
}

/// The first entries after this sequence number, at most `most` in total; a transaction counts by
/// the number of its end. If there are none, `next` is the newest number, so that a client recovers
/// after a restart.
TracePage trace_since(const bus::LineView& bus, std::uint64_t since, std::size_t most) {
    TracePage page{.part = bus.trace_since(since, most)};
    const auto numbers = numbers_of(page.part);
    if (numbers.empty()) {
        page.next = std::min(since, last_of_trace(bus, 1).next);
        return page;
    }
    page.next = numbers[std::min(most, numbers.size()) - 1];
    const auto is_behind = [&](const auto& entry) { return entry.sequence > page.next; };
    std::erase_if(page.part.frames, is_behind);
    std::erase_if(page.part.decisions, is_behind);
    std::erase_if(page.part.transactions, is_behind);
    return page;
}

// Trace entries as JSON. Instants are seconds of the gateway's monotonic clock; `time` is
// wall-clock time.

double seconds(TimePoint at) { return to_seconds(at.time_since_epoch()); }

json::value seconds(const std::optional<TimePoint>& at) {
    if (!at) return nullptr;
    return seconds(*at);
}

json::object json_of(const bus::TraceFrame& frame) {
    json::object object;
    object["sequence"] = frame.sequence;
    object["time"] = rfc3339(frame.time);
    object["at"] = seconds(frame.at);
    object["direction"] = label(direction_of(frame.kind));
    object["station"] = nullptr;
    if (!frame.bytes.empty()) object["station"] = frame.bytes.front();
    object["bytes"] = upper_hex(frame.bytes);
    object["note"] = label(frame.kind);
    if (!frame.why.empty()) object["why"] = frame.why;
    if (frame.transaction != 0) object["transaction"] = frame.transaction;
    return object;
}

json::object json_of(const bus::TraceDecision& decision) {
    return {{"sequence", decision.sequence},
            {"time", rfc3339(decision.time)},
            {"at", seconds(decision.at)},
            {"text", decision.text}};
}

json::object json_of(const bus::TraceTransaction& transaction) {
    json::object object;
    object["id"] = transaction.id;
    object["sequence"] = transaction.first;
    object["ended"] = transaction.sequence;
    object["time"] = rfc3339(transaction.time);
    object["station"] = transaction.station;
    object["reason"] = transaction.reason;
    object["client"] = nullptr;
    if (!transaction.client.empty()) object["client"] = transaction.client;
    object["outcome"] = label(transaction.end);
    object["arrived"] = seconds(transaction.arrived);
    object["granted"] = seconds(transaction.granted);
    object["first_bit_out"] = seconds(transaction.first_bit_out);
    object["last_bit_out"] = seconds(transaction.last_bit_out);
    object["first_byte_in"] = seconds(transaction.first_byte_in);
    object["last_byte_in"] = seconds(transaction.last_byte_in);
    object["answered"] = seconds(transaction.answered);
    object["request"] = upper_hex(transaction.request);
    object["reply"] = nullptr;
    if (!transaction.reply.empty()) object["reply"] = upper_hex(transaction.reply);
    json::array discarded;
    for (const bus::TraceFrame& frame : transaction.discarded)
        discarded.push_back(
            json::object{{"note", label(frame.kind)}, {"bytes", upper_hex(frame.bytes)}});
    object["discarded"] = std::move(discarded);
    return object;
}

json::object json_of(const bus::IncidentHead& incident) {
    json::object object{{"id", incident.id}, {"time", rfc3339(incident.time)}};
    object["station"] = nullptr;
    if (incident.station) object["station"] = *incident.station;
    object["cause"] = incident.cause;
    object["errors"] = incident.errors;
    object["complete"] = incident.complete;
    object["read"] = incident.read;
    return object;
}

template <class Entry>
void add_list(LongAnswer& body, std::string_view name, const std::vector<Entry>& entries) {
    body.begin_list(name);
    for (const Entry& entry : entries) body.add(json_of(entry));
    body.end_list();
}

/// Answers these members, the three lists of the part, and `behind`.
HttpResponse answer_part(json::object members, bus::TracePart part, json::object behind) {
    HttpResponse response;
    response.is_long = true;
    response.finish = [members = std::move(members), part = std::move(part),
                       behind = std::move(behind)](HttpResponse& made) {
        LongAnswer body;
        for (const auto& [name, value] : members) body.member(name, value);
        add_list(body, "frames", part.frames);
        add_list(body, "decisions", part.decisions);
        add_list(body, "transactions", part.transactions);
        for (const auto& [name, value] : behind) body.member(name, value);
        made.body = body.text();
    };
    return response;
}

/// A capture of the parts as a download with this file name.
HttpResponse pcapng_response(const std::string& version, const std::string& line,
                             std::vector<bus::TracePart> parts, const std::string& file_name) {
    HttpResponse response = text_response(200, {}, "application/x-pcapng");
    response.headers.emplace_back("Content-Disposition",
                                  "attachment; filename=\"" + file_name + '"');
    response.is_long = true;
    response.finish = [version, line, parts = std::move(parts)](HttpResponse& made) {
        TracePcapng file(version, line);
        for (const bus::TracePart& part : parts) {
            file.add(part);
            made.body += file.take();
        }
        made.body += file.finish();
    };
    return response;
}

/// The page that the queries ask for.
TracePage page_of(const HttpRequest& request, const bus::LineView& bus) {
    constexpr unsigned kUsual = 100;  // entries of each kind
    constexpr unsigned kMost = 500;
    const auto since = request.query.find("since");
    const bool follows = since != request.query.end();
    const unsigned most = query_number(request, "last", 1, kMost, follows ? kMost : kUsual).value();
    if (!follows) return last_of_trace(bus, most);
    const auto number = to_number<std::uint64_t>(since->second);
    if (!number) refuse(400, "since must be a sequence number: the value of `next`, or 0");
    return trace_since(bus, *number, most);
}

}  // namespace

/// The whole trace at the time of the request, without entries that come later. Copied in pieces,
/// between which the loop serves its lines.
Handling get_trace_pcapng(HttpRequest request, const Api* api) {
    constexpr std::size_t kPiece = 64;  // entries: about 0.1 ms of work
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const auto executor = co_await boost::asio::this_coro::executor;
    const std::uint64_t newest = last_of_trace(*line->bus, 1).next;
    std::vector<bus::TracePart> parts;
    for (std::uint64_t since = 0; since < newest;) {
        TracePage page = trace_since(*line->bus, since, kPiece);
        if (page.next <= since) break;
        since = page.next;
        parts.push_back(std::move(page.part));
        co_await boost::asio::post(executor, boost::asio::use_awaitable);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    co_return pcapng_response(api->providers.version, line->name, std::move(parts),
                              line->name + ".pcapng");
}

Handling get_trace(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    auto page = page_of(request, *line->bus);
    json::object behind{{"next", page.next}};
    co_return answer_part({}, std::move(page.part), std::move(behind));
}

Handling get_incidents(HttpRequest request, const Api* api) {
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    json::array list;
    for (const bus::IncidentHead& head : line->bus->incidents()) list.push_back(json_of(head));
    co_return json_response(200, json::object{{"incidents", std::move(list)}});
}

/// The incident "7", or its capture "7.pcapng".
Handling get_incident(HttpRequest request, const Api* api) {
    constexpr std::string_view kCapture = ".pcapng";
    const LineEntry* const line = find_line(*api->directory, request.arguments[0]).value();
    const std::string name = line->name;
    std::string_view wanted = request.arguments[1];
    const bool is_capture = wanted.ends_with(kCapture);
    if (is_capture) wanted.remove_suffix(kCapture.size());
    const auto id = to_number<std::uint64_t>(wanted);
    auto found = id ? line->bus->incident(*id) : std::nullopt;
    if (!found)
        co_return to_response(
            problem(404, "line '" + name + "' keeps no incident '" + request.arguments[1] + "'"));
    if (is_capture)
        co_return pcapng_response(api->providers.version, name, {std::move(found->part)},
                                  name + '-' + request.arguments[1]);
    co_return answer_part(json_of(found->head), std::move(found->part), {});
}

}  // namespace panelgate::web
