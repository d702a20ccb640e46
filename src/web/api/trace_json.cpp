#include "trace_json.hpp"

#include <boost/json/array.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/base/wall_time.hpp"

namespace panelgate::web {
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
        body->add(describe(entry));
        if (!body->is_turn_over()) continue;
        asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
    }
    body->end_list();
}

}  // namespace

json::object describe(const bus::TraceFrame& frame) {
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

json::object describe(const bus::TraceDecision& decision) {
    json::object object;
    object["sequence"] = decision.sequence;
    object["time"] = rfc3339(decision.time);
    object["at"] = seconds(decision.at);
    object["text"] = decision.text;
    return object;
}

json::object describe(const bus::TraceTransaction& transaction) {
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

json::object describe(const bus::IncidentHead& incident) {
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

}  // namespace panelgate::web
