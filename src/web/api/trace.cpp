#include <algorithm>
#include <boost/asio/awaitable.hpp>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/query.hpp"
#include "pcapng.hpp"
#include "routes.hpp"
#include "station_path.hpp"

namespace panelgate::web {

struct TracePage {
    bus::TracePart part;
    std::uint64_t next = 0;  ///< for the next page: trace_since(next)
};

/// The last frames, decisions and transactions, at most `most` of each.
TracePage last_of_trace(const bus::LineView& bus, std::size_t most);
/// The first entries after this sequence number, at most `most` in total; a transaction counts by
/// the number of its end. If there are none, `next` is the newest number, so that a client recovers
/// after a restart.
TracePage trace_since(const bus::LineView& bus, std::uint64_t since, std::size_t most);

/// Trace entries as JSON. Instants are seconds of the gateway's monotonic clock; `time` is
/// wall-clock time.
boost::json::object trace_json(const bus::TraceFrame& frame);
boost::json::object trace_json(const bus::TraceDecision& decision);
boost::json::object trace_json(const bus::TraceTransaction& transaction);
boost::json::object trace_json(const bus::IncidentHead& incident);

/// Adds the three lists of the part as members, yielding to the loop. Both pointers must stay valid
/// until it has finished.
boost::asio::awaitable<void> add_part(LongAnswer* body, const bus::TracePart* part);

/// A capture as a download with this file name.
HttpResponse pcapng_response(std::string body, const std::string& file_name);

namespace {

template <class Entry>
std::uint64_t last_of(const std::vector<Entry>& entries) {
    return entries.empty() ? 0 : entries.back().sequence;
}

std::uint64_t last_number(const bus::TracePart& part) {
    return std::max({last_of(part.frames), last_of(part.decisions), last_of(part.transactions)});
}

template <class Entry>
void add_numbers(std::vector<std::uint64_t>& numbers, const std::vector<Entry>& entries) {
    for (const Entry& entry : entries) numbers.push_back(entry.sequence);
}

template <class Entry>
void cut_behind(std::vector<Entry>& entries, std::uint64_t last) {
    std::erase_if(entries, [last](const Entry& entry) { return entry.sequence > last; });
}

/// Keeps the oldest `most` entries.
void cut(bus::TracePart& part, std::size_t most) {
    std::vector<std::uint64_t> numbers;
    add_numbers(numbers, part.frames);
    add_numbers(numbers, part.decisions);
    add_numbers(numbers, part.transactions);
    if (numbers.size() <= most || most == 0) return;
    std::ranges::sort(numbers);
    const std::uint64_t last = numbers[most - 1];
    cut_behind(part.frames, last);
    cut_behind(part.decisions, last);
    cut_behind(part.transactions, last);
}

}  // namespace

TracePage last_of_trace(const bus::LineView& bus, std::size_t most) {
    TracePage page;
    page.part = bus.trace(most);
    page.next = last_number(page.part);
    return page;
}

TracePage trace_since(const bus::LineView& bus, std::uint64_t since, std::size_t most) {
    TracePage page;
    page.part = bus.trace_since(since, most);
    cut(page.part, most);
    page.next = last_number(page.part);
    if (page.next == 0) page.next = std::min(since, last_of_trace(bus, 1).next);
    return page;
}

namespace asio = boost::asio;
namespace json = boost::json;
namespace {

double seconds(TimePoint at) { return to_seconds(at.time_since_epoch()); }

json::value seconds(const std::optional<TimePoint>& at) {
    if (!at) return nullptr;
    return seconds(*at);
}

json::array discarded(const bus::TraceTransaction& transaction) {
    json::array list;
    for (const bus::TraceFrame& frame : transaction.discarded)
        list.push_back(
            json::object{{"note", label(frame.kind)}, {"bytes", upper_hex(frame.bytes)}});
    return list;
}

template <class Entry>
asio::awaitable<void> add_list(LongAnswer* body, std::string_view name,
                               const std::vector<Entry>* entries) {
    body->begin_list(name);
    for (const Entry& entry : *entries) {
        body->add(trace_json(entry));
        if (!body->is_turn_over()) continue;
        asio::awaitable<void> turn = yield_turn();
        co_await std::move(turn);
    }
    body->end_list();
}

}  // namespace

json::object trace_json(const bus::TraceFrame& frame) {
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

json::object trace_json(const bus::TraceDecision& decision) {
    json::object object;
    object["sequence"] = decision.sequence;
    object["time"] = rfc3339(decision.time);
    object["at"] = seconds(decision.at);
    object["text"] = decision.text;
    return object;
}

json::object trace_json(const bus::TraceTransaction& transaction) {
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
    object["discarded"] = discarded(transaction);
    return object;
}

json::object trace_json(const bus::IncidentHead& incident) {
    json::object object;
    object["id"] = incident.id;
    object["time"] = rfc3339(incident.time);
    object["station"] = nullptr;
    if (incident.station) object["station"] = *incident.station;
    object["cause"] = incident.cause;
    object["errors"] = incident.errors;
    object["complete"] = incident.complete;
    object["read"] = incident.read;
    return object;
}

asio::awaitable<void> add_part(LongAnswer* body, const bus::TracePart* part) {
    asio::awaitable<void> frames = add_list(body, "frames", &part->frames);
    co_await std::move(frames);
    asio::awaitable<void> decisions = add_list(body, "decisions", &part->decisions);
    co_await std::move(decisions);
    asio::awaitable<void> transactions = add_list(body, "transactions", &part->transactions);
    co_await std::move(transactions);
}

HttpResponse pcapng_response(std::string body, const std::string& file_name) {
    HttpResponse response;
    response.content_type = "application/x-pcapng";
    response.body = std::move(body);
    response.headers.emplace_back("Content-Disposition",
                                  "attachment; filename=\"" + file_name + '"');
    return response;
}

/// The whole trace at the time of the request, without entries that come later.
Handling get_trace_pcapng(HttpRequest request, const Api* api) {
    constexpr std::size_t kOfATurn = 64;  // entries: about 0.1 ms of work
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string name = (*line)->name;
    const bus::LineView* const bus = (*line)->bus;
    TracePcapng file(api->providers.version, name);
    std::string body;
    const std::uint64_t newest = last_of_trace(*bus, 1).next;
    for (std::uint64_t since = 0; since < newest;) {
        TracePage page = trace_since(*bus, since, kOfATurn);
        if (page.next <= since) break;
        since = page.next;
        file.add(page.part);
        body += file.take();
        boost::asio::awaitable<void> turn = yield_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body += file.finish();
    co_return pcapng_response(std::move(body), name + ".pcapng");
}

namespace {

constexpr unsigned kDefaultTrace = 100;  ///< entries of each kind
constexpr unsigned kMaxTrace = 500;

/// The page that the queries ask for.
Parsed<TracePage> page_of(const HttpRequest& request, const bus::LineView& bus) {
    const auto since = request.query.find("since");
    const bool follows = since != request.query.end();
    const auto most =
        query_number(request, "last", 1, kMaxTrace, follows ? kMaxTrace : kDefaultTrace);
    if (!most) return most.error();
    if (!follows) return last_of_trace(bus, *most);
    const auto number = to_number<std::uint64_t>(since->second);
    if (!number) return problem(400, "since must be a sequence number: the value of `next`, or 0");
    return trace_since(bus, *number, *most);
}

}  // namespace

Handling get_trace(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    auto page = page_of(request, *(*line)->bus);
    if (!page) co_return to_response(page.error());
    LongAnswer body;
    boost::asio::awaitable<void> all = add_part(&body, &page->part);
    co_await std::move(all);
    body.member("next", page->next);
    co_return body.response();
}

namespace {

constexpr std::string_view kCapture = ".pcapng";

/// Parsed from "7" or "7.pcapng".
struct Wanted {
    std::uint64_t id = 0;
    bool capture = false;
};
std::optional<Wanted> wanted_of(std::string_view text) {
    Wanted wanted;
    wanted.capture = text.ends_with(kCapture);
    if (wanted.capture) text.remove_suffix(kCapture.size());
    const auto id = to_number<std::uint64_t>(text);
    if (!id) return std::nullopt;
    wanted.id = *id;
    return wanted;
}

}  // namespace

Handling get_incidents(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    json::array list;
    for (const bus::IncidentHead& head : (*line)->bus->incidents())
        list.push_back(trace_json(head));
    co_return json_response(200, json::object{{"incidents", std::move(list)}});
}

Handling get_incident(HttpRequest request, const Api* api) {
    const auto line = find_line(*api->directory, request.arguments[0]);
    if (!line) co_return to_response(line.error());
    const std::string name = (*line)->name;
    const auto wanted = wanted_of(request.arguments[1]);
    const auto found = wanted ? (*line)->bus->incident(wanted->id) : std::nullopt;
    if (!found)
        co_return to_response(
            problem(404, "line '" + name + "' keeps no incident '" + request.arguments[1] + "'"));
    if (wanted->capture) {
        TracePcapng file(api->providers.version, name);
        file.add(found->part);
        std::string body = file.take();
        body += file.finish();
        co_return pcapng_response(std::move(body), name + '-' + request.arguments[1]);
    }
    LongAnswer body;
    for (const auto& [member, value] : trace_json(found->head)) body.member(member, value);
    boost::asio::awaitable<void> all = add_part(&body, &found->part);
    co_await std::move(all);
    co_return body.response();
}

}  // namespace panelgate::web
