#include "reading.hpp"

#include <algorithm>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/json/array.hpp>
#include <boost/system/system_error.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "answer.hpp"
#include "body.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/read_plan.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/query.hpp"
#include "points.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace asio = boost::asio;
namespace {

/// Starts a transaction and resumes the coroutine by post, so that the bus is not called again from
/// inside its own completion.
struct StartTransact {
    template <class Handler>
    void operator()(Handler handler, bus::RequestPort* bus, bus::Request request) const {
        auto shared = std::make_shared<Handler>(std::move(handler));
        bus->transact(std::move(request), [shared](bus::Answer answer) {
            const auto executor = asio::get_associated_executor(*shared);
            asio::post(executor, [shared, answer = std::move(answer)]() mutable {
                (std::move(*shared))(std::move(answer));
            });
        });
    }
};

asio::awaitable<bus::Answer> start_transact(bus::RequestPort* bus, bus::Request request) {
    return asio::async_initiate<const asio::use_awaitable_t<>, void(bus::Answer)>(
        StartTransact{}, asio::use_awaitable, bus, std::move(request));
}

}  // namespace

Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return problem_of(request.error(), false);
    return bus::Request{.station = station, .request = std::move(*request)};
}

void introduce(Caller& caller, bus::RequestPort* bus) {
    const bus::ClientId client = caller.id();
    caller.at_leaving(bus, [bus, client] { bus->cancel(client); });
    bus->name_client(client, caller.name());
}

asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::RequestPort* bus,
                                 bus::Request request) {
    if (caller->has_hung_up() && !caller->has_left()) co_return bus::Answer{};  // cancelled
    if (!caller->has_left()) {
        const bool changes = !request.request.is_read();
        introduce(*caller, bus);
        request.client = caller->id();
        request.who = caller->who();
        asio::awaitable<bus::Answer> pending = start_transact(bus, std::move(request));
        bus::Answer answer = co_await std::move(pending);
        answer.transactions.for_each(
            [&](std::uint64_t number) { caller->add_cost({bus, number}); });
        if (answer.transmitted && changes) caller->take_effect();
        if (!caller->has_left()) co_return answer;
    }
    throw boost::system::system_error(asio::error::operation_aborted);
}

namespace json = boost::json;
namespace {

std::optional<std::string> query(const HttpRequest& request, const char* name) {
    const auto given = request.query.find(name);
    if (given == request.query.end()) return std::nullopt;
    return given->second;
}

/// The value with this label; otherwise 400 with the list of all labels.
template <class Word, std::size_t N>
Parsed<Word> word_of(const char* what, const std::string& text, const Word (&all)[N]) {
    std::string known;
    for (const Word word : all) {
        if (text == label(word)) return word;
        known += (known.empty() ? "" : ", ") + std::string(label(word));
    }
    return problem(
        400, "there is no " + std::string(what) + " '" + excerpt(text) + "'; there are " + known);
}

Parsed<points::Type> type_of(const ValueFormat& format, bool bits) {
    if (!format.type) return bits ? points::Type::boolean : points::Type::u16;
    const auto type = word_of("type", *format.type, points::kTypes);
    if (type && bits && *type != points::Type::boolean)
        return problem(400, "the type of a bit is bool, not " + *format.type);
    return type;
}

Parsed<unsigned> count_member(const json::object& entry, std::string_view name, unsigned most) {
    if (!entry.contains(name)) return 1u;
    const auto number = number_member(entry, name, 1, most);
    if (!number) return number.error();
    return static_cast<unsigned>(*number);
}

Parsed<std::optional<std::string>> text_member(const json::object& entry, std::string_view name) {
    if (!entry.contains(name)) return std::optional<std::string>();
    auto text = string_member(entry, name);
    if (!text) return text.error();
    return std::optional<std::string>(std::move(*text));
}

}  // namespace

Parsed<ValueFormat> format_of(const HttpRequest& request) {
    ValueFormat format;
    format.type = query(request, "type");
    format.order = query(request, "order");
    if (query(request, "length")) {
        const auto length = query_number(request, "length", 1, kMaxText, 1);
        if (!length) return length.error();
        format.length = *length;
    }
    const auto raw = query_flag(request, "raw");
    if (!raw) return raw.error();
    format.raw = *raw;
    return format;
}

Parsed<ValueFormat> format_of(const json::object& entry) {
    ValueFormat format;
    auto type = text_member(entry, "type");
    if (!type) return type.error();
    format.type = std::move(*type);
    auto order = text_member(entry, "order");
    if (!order) return order.error();
    format.order = std::move(*order);
    const auto length = count_member(entry, "length", kMaxText);
    if (!length) return length.error();
    if (entry.contains("length")) format.length = *length;
    const auto count = count_member(entry, "count", modbus::kTableItems);
    if (!count) return count.error();
    format.count = *count;
    const auto raw = flag_member(entry, "raw");
    if (!raw) return raw.error();
    format.raw = *raw;
    return format;
}

Parsed<View> view_of(const ValueFormat& format, modbus::Table table) {
    View view;
    const bool bits = modbus::is_bit_table(table);
    view.raw = format.raw;
    view.value.table = table;
    const auto type = type_of(format, bits);
    if (!type) return type.error();
    view.value.type = *type;
    if (format.order) {
        if (bits) return problem(400, "a bit has no order");
        const auto order = word_of("order", *format.order, points::kOrders);
        if (!order) return order.error();
        view.value.word_order = *order;
    }
    const bool text = *type == points::Type::string;
    if (format.length && !text) return problem(400, "only a string has a length");
    if (text && !format.length) {
        // One string over all registers.
        view.value.length = 2 * format.count;
        view.items = format.count;
        return view;
    }
    view.value.length = format.length.value_or(0);
    view.items = format.count * view.value.count();
    return view;
}

json::array values_of(const View& view, std::span<const std::uint16_t> items) {
    json::array values;
    const std::size_t step = view.value.count();
    for (std::size_t at = 0; at + step <= items.size(); at += step) {
        const auto value = points::decode(view.value, items.subspan(at, step));
        values.push_back(value ? json_of(*value) : json::value(nullptr));
    }
    return values;
}

namespace {

/// The problem of a read that failed after some of its items. If its time was too short for all of
/// them, the panel is not to blame.
Problem stopped(Problem problem, const bus::Answer& answer, const Patience& patience,
                std::size_t done, unsigned wanted) {
    if (done == 0 || answer.refusal || answer.pdu) return problem;
    const Fault fault = answer.pdu.error();
    const bool over = patience.left() == Duration::zero();
    if (fault == Fault::expired || (fault == Fault::timeout && over))
        problem.detail = "the time of this request was over after " + std::to_string(done) +
                         " of " + std::to_string(wanted) + " items; ask for fewer at once";
    return problem;
}

}  // namespace

void Reading::take(const bus::Answer& answer, const modbus::Span& span) {
    if (modbus::is_bit_table(span.table)) {
        for (const bool bit : modbus::bits_of(*answer.pdu, span.count)) items.push_back(bit);
    } else {
        for (const std::uint16_t item : modbus::registers_of(*answer.pdu)) items.push_back(item);
    }
    ++transactions;
    if (answer.source != bus::Source::cache) return;
    cached = true;
    age = std::max(age, answer.age);
}

namespace {

/// For a plan: what is sent is judged by its bus, and counted there.
bool is_refused_here(const Caller& caller, const StationEntry& station, const modbus::Span& span) {
    const bus::Request request{
        .station = station.id, .request = modbus::Request::read(span), .who = caller.who()};
    return station.bus->refusal_of(request).has_value();
}

/// The requests that read these items. One that is refused comes first: what is refused in part is
/// not sent at all.
std::deque<modbus::Span> parts_of(const Caller& caller, const StationEntry& station,
                                  const modbus::Span& span) {
    const std::uint32_t limit = station.profile->max_count(read_function(span.table));
    std::deque<modbus::Span> parts;
    for (std::uint32_t first = span.first; first < span.end(); first += limit)
        parts.push_back({span.table, first, std::min(limit, span.end() - first)});
    if (parts.size() == 1) return parts;
    const auto refused = std::ranges::find_if(
        parts, [&](const modbus::Span& part) { return is_refused_here(caller, station, part); });
    if (refused != parts.end()) std::iter_swap(parts.begin(), refused);
    return parts;
}

}  // namespace

boost::asio::awaitable<Parsed<Reading>> read_all(std::shared_ptr<Caller> caller,
                                                 const StationEntry* station, modbus::Span span,
                                                 Patience patience) {
    Reading reading;
    const std::deque<modbus::Span> parts = parts_of(*caller, *station, span);
    for (const modbus::Span& part : parts) {
        const auto done = static_cast<unsigned>(reading.items.size());
        auto planned = request_to(station->id, modbus::encode_read(part));
        if (!planned) co_return planned.error();
        bus::Request made = std::move(*planned);
        made.within = patience.left();
        bus::Answer answer = co_await ask(caller, station->bus, std::move(made));
        auto failed = problem_of(answer, *station->profile);
        if (failed) co_return stopped(std::move(*failed), answer, patience, done, span.count);
        reading.take(answer, part);
    }
    co_return reading;
}

Parsed<View> prepare_read(Items& items, const ValueFormat& format, unsigned max_transactions) {
    auto view = view_of(format, items.span.table);
    if (!view) return view;
    items.span.count = view->items;
    if (items.area != nullptr) {
        const auto range = check_range(items, items.area->readable, "readable");
        if (!range) return range.error();
    }
    if (items.span.end() > modbus::kTableItems)
        return problem(400, std::to_string(items.span.count) + " items from " +
                                std::to_string(items.span.first) + " go beyond address 65535");
    // A notation names memory: it is read through the first table that the panel can read it with.
    const auto table = table_to_read(items);
    if (!table) return table.error();
    items.span.table = *table;
    const unsigned most =
        items.station.profile->max_count(read_function(items.span.table)) * max_transactions;
    if (items.span.count > most)
        return problem(422, "at most " + std::to_string(most) + " at once", "too-many");
    return view;
}

namespace {

/// As a technician writes the item `behind` the first; "" if the panel is not known.
std::string notation_of(const Items& items, std::size_t behind) {
    const auto address = static_cast<std::uint16_t>(items.address() + behind);
    if (items.area != nullptr) return profile::format_notation(*items.area, address);
    if (items.station.unknown_panel) return "";
    return profile::format_notation(*items.station.profile, items.span.table, address);
}

}  // namespace

json::object describe(const Items& items, const View& view, const Reading& reading) {
    const std::string notation = notation_of(items, 0);
    json::array values = values_of(view, reading.items);
    json::object body;
    body["station"] = items.station.name;
    body["table"] = label(items.span.table);
    body["address"] = items.span.first;
    body["notation"] = nullptr;
    if (!notation.empty()) body["notation"] = notation;
    if (!notation.empty() && values.size() > 1) {
        json::array notations;
        for (std::size_t i = 0; i < values.size(); ++i)
            notations.emplace_back(notation_of(items, i * items.span.count / values.size()));
        body["notations"] = std::move(notations);
    }
    body["values"] = std::move(values);
    if (view.raw) body["raw"] = json::array(reading.items.begin(), reading.items.end());
    body["age_ms"] = whole_ms(reading.age);
    body["source"] = reading.cached ? "cache" : "bus";
    if (reading.transactions > 1) body["transactions"] = reading.transactions;
    return body;
}

namespace {

/// Plan limits with the panel's full frame sizes, which REST may use.
points::PlanLimits limits_of(const StationEntry& station, const SerialFormat& serial) {
    points::PlanLimits limits =
        points::make_plan_limits(*station.profile, serial, silent_interval(serial));
    for (const modbus::Table table : modbus::kTables)
        limits.of(table).max_items = station.profile->max_count(read_function(table));
    return limits;
}

/// The entries of one station; wants have the same index.
struct Plan {
    std::vector<BatchRead*> entries;
    std::vector<points::Want> wants;
    std::deque<points::PlannedRead> reads;
};

Plan plan_of(std::vector<BatchRead*> entries, const SerialFormat& serial) {
    Plan plan;
    plan.entries = std::move(entries);
    for (BatchRead* entry : plan.entries) {
        plan.wants.push_back({entry->items.span});
        entry->reading.items.assign(entry->items.span.count, 0);
    }
    const auto limits = limits_of(plan.entries.front()->items.station, serial);
    for (points::PlannedRead& read : points::plan_reads(plan.wants, limits))
        plan.reads.push_back(std::move(read));
    return plan;
}

/// Copies the entry's part of what was read.
void take(BatchRead& entry, const modbus::Span& span, const Reading& read) {
    const modbus::Span& wanted = entry.items.span;
    const std::uint32_t first = std::max(span.first, wanted.first);
    const std::uint32_t end = std::min(span.end(), wanted.end());
    std::copy(read.items.begin() + (first - span.first), read.items.begin() + (end - span.first),
              entry.reading.items.begin() + (first - wanted.first));
    ++entry.reading.transactions;
    entry.reading.cached = entry.reading.cached || read.cached;
    entry.reading.age = std::max(entry.reading.age, read.age);
}

/// True if the panel refused the read with exception 1 to 4.
bool is_refused(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return false;
    const auto code = modbus::exception_of(*answer.pdu);
    return code && *code <= 4;
}

/// Queues the two halves of the read next; false if it cannot be split.
bool halve(Plan& plan, const points::PlannedRead& read) {
    auto halves = points::bisect(read, plan.wants);
    if (!halves) return false;
    plan.reads.push_front(std::move(halves->second));
    plan.reads.push_front(std::move(halves->first));
    return true;
}

/// Takes apart what is refused as it was joined, and puts first what is refused by itself: the rest
/// of its entry is not sent.
void part_refused(Plan& plan, const Caller& caller) {
    const StationEntry& station = plan.entries.front()->items.station;
    std::deque<points::PlannedRead> refused;
    std::deque<points::PlannedRead> others;
    while (!plan.reads.empty()) {
        points::PlannedRead read = std::move(plan.reads.front());
        plan.reads.pop_front();
        const bool is_refused = is_refused_here(caller, station, read.span);
        if (is_refused && halve(plan, read)) continue;
        (is_refused ? refused : others).push_back(std::move(read));
    }
    plan.reads = std::move(refused);
    for (points::PlannedRead& read : others) plan.reads.push_back(std::move(read));
}

bool is_in_vain(const Plan& plan, const points::PlannedRead& read) {
    return std::ranges::all_of(
        read.wants, [&](std::size_t want) { return plan.entries[want]->problem.has_value(); });
}

void settle(Plan& plan, const points::PlannedRead& read, const bus::Answer& answer) {
    const auto failed = problem_of(answer, *plan.entries.front()->items.station.profile);
    // Rules may have changed since it was planned.
    if (failed && (is_refused(answer) || answer.refusal) && halve(plan, read)) return;
    Reading got;
    if (!failed) got.take(answer, read.span);
    for (const std::size_t want : read.wants) {
        if (failed) {
            plan.entries[want]->problem = *failed;
        } else {
            take(*plan.entries[want], read.span, got);
        }
    }
}

boost::asio::awaitable<void> read_station(std::shared_ptr<Caller> caller,
                                          std::vector<BatchRead*> entries, SerialFormat serial,
                                          Patience patience, unsigned* transactions) {
    Plan plan = plan_of(std::move(entries), serial);
    part_refused(plan, *caller);
    const StationEntry& station = plan.entries.front()->items.station;
    while (!plan.reads.empty()) {
        const points::PlannedRead read = std::move(plan.reads.front());
        plan.reads.pop_front();
        if (is_in_vain(plan, read)) continue;
        bus::Request made{.station = station.id, .request = modbus::Request::read(read.span)};
        made.within = patience.left();
        const bus::Answer answer = co_await ask(caller, station.bus, std::move(made));
        if (answer.transmitted) ++*transactions;
        settle(plan, read, answer);
    }
}

}  // namespace

boost::asio::awaitable<void> read_line(std::shared_ptr<Caller> caller, const LineEntry* line,
                                       std::vector<BatchRead*> entries, Patience patience,
                                       unsigned* transactions) {
    std::map<std::uint8_t, std::vector<BatchRead*>> stations;
    for (BatchRead* entry : entries) stations[entry->items.station.id].push_back(entry);
    for (auto& [id, of_station] : stations) {
        boost::asio::awaitable<void> reads =
            read_station(caller, std::move(of_station), line->serial, patience, transactions);
        co_await std::move(reads);
    }
}

}  // namespace panelgate::web
