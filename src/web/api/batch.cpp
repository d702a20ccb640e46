// Lists of reads and writes: lines work in parallel, the stations of a line in turn.
#include <algorithm>
#include <deque>

#include "answer.hpp"
#include "exchange.hpp"
#include "panelgate/points/read_plan.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace asio = boost::asio;
namespace json = boost::json;
namespace {

/// The problem of an entry, or the denial that instead_of_telling() gives in its place.
Problem told_of(const json::object& entry, Problem why, const WhoRef& who,
                const Directory& directory) {
    const json::value* named = entry.if_contains(entry.contains("point") ? "point" : "station");
    if (named == nullptr || !named->is_string()) return why;
    const std::string name(named->as_string());
    const std::size_t slash = std::min(name.find('/'), name.size());
    const std::string point = slash == name.size() ? "" : name.substr(slash + 1);
    return instead_of_telling(name.substr(0, slash), point, who, directory)
        .value_or(std::move(why));
}

/// A malformed entry fails the whole list, and nothing of the list is done.
Problem in_entry(std::size_t index, Problem problem) {
    problem.detail = "items[" + std::to_string(index) + "]: " + problem.detail;
    return problem;
}

/// One read of a list, and its result.
struct BatchRead {
    json::object item;  ///< the entry as sent
    Target target;
    View view;
    std::optional<Problem> problem{};  ///< why it failed
    Reading reading{};                 ///< filled piece by piece
};

/// One write of a list, and its result.
struct BatchWrite {
    json::object item;  ///< the entry as sent
    std::optional<Writing> writing;
    json::object result;
};

const std::string* line_of(const BatchRead& read) {
    return read.problem ? nullptr : &read.target.station.line;
}

const std::string* line_of(const BatchWrite& write) {
    return write.writing ? &write.writing->station.line : nullptr;
}

/// Groups the entries that have not failed by line, in their order.
template <class Entry>
std::map<std::string, std::vector<Entry*>> by_line(std::vector<Entry>& entries) {
    std::map<std::string, std::vector<Entry*>> lines;
    for (Entry& entry : entries) {
        if (const std::string* line = line_of(entry)) lines[*line].push_back(&entry);
    }
    return lines;
}

Parsed<BatchRead> read_of(const json::object& entry, const Api& api) {
    auto target =
        entry_target(entry, *api.directory, {"raw"}, {"count", "type", "order", "length", "raw"});
    const auto format = format_of(entry);
    if (!format && (target || target.error().status != 400)) return format.error();
    if (!target) return target.error();
    BatchRead read;
    read.target = std::move(*target);
    if (read.target.point != nullptr) {
        const points::Point& point = *read.target.point;
        read.view = {.value = point, .items = point.count(), .raw = format->raw};
        return read;
    }
    auto view = view_of(*format, read.target.span.table);
    if (!view) return view.error();
    const auto readable =
        make_readable(read.target, view->items, api.providers.settings.max_transactions);
    if (!readable) return readable.error();
    read.view = std::move(*view);
    return read;
}

/// An entry that cannot be read is reported in its place.
Parsed<std::vector<BatchRead>> reads_of(const HttpRequest& request, const Api& api) {
    const auto entries = entries_of(request.body, api.providers.settings.max_items);
    if (!entries) return entries.error();
    std::vector<BatchRead> reads;
    std::size_t values = 0;
    const std::size_t most = api.providers.settings.max_values;
    for (const json::object& entry : *entries) {
        auto read = read_of(entry, api);
        if (!read) read = told_of(entry, read.error(), request.caller->who(), *api.directory);
        if (!read && read.error().status == 400) return in_entry(reads.size(), read.error());
        if (read) {
            values += read->target.span.count;
            reads.push_back(std::move(*read));
        } else {
            reads.emplace_back().problem = read.error();
        }
        reads.back().item = entry;
        if (values > most)
            return problem(422,
                           "at most " + std::to_string(most) + " registers and bits in one list",
                           "too-many");
    }
    return reads;
}

/// The entries of one station; wants have the same index.
struct Plan {
    std::vector<BatchRead*> entries;
    std::vector<points::Want> wants;
    std::deque<points::PlannedRead> reads;

    const StationEntry& station() const { return entries.front()->target.station; }
};

/// In as few requests as the profile of the panel allows, of the panel's full frame sizes.
Plan plan_of(std::vector<BatchRead*> entries, const SerialFormat& serial) {
    Plan plan;
    plan.entries = std::move(entries);
    for (BatchRead* entry : plan.entries) {
        plan.wants.push_back({entry->target.span});
        entry->reading.items.assign(entry->target.span.count, 0);
    }
    const profile::PanelProfile& panel = *plan.station().profile;
    points::PlanLimits limits = points::make_plan_limits(panel, serial, silent_interval(serial));
    for (const modbus::Table table : modbus::kTables)
        limits.of(table).max_items = panel.max_count(read_function(table));
    for (points::PlannedRead& read : points::plan_reads(plan.wants, limits))
        plan.reads.push_back(std::move(read));
    return plan;
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
    std::deque<points::PlannedRead> refused;
    std::deque<points::PlannedRead> others;
    while (!plan.reads.empty()) {
        points::PlannedRead read = std::move(plan.reads.front());
        plan.reads.pop_front();
        const bool is_refused = is_refused_here(caller, plan.station(), read.span);
        if (is_refused && halve(plan, read)) continue;
        (is_refused ? refused : others).push_back(std::move(read));
    }
    plan.reads = std::move(refused);
    for (points::PlannedRead& read : others) plan.reads.push_back(std::move(read));
}

/// True if the panel refused the read with exception 1 to 4, or the gateway: rules may have changed
/// since the read was planned.
bool is_refused(const bus::Answer& answer) {
    if (answer.refusal) return true;
    const auto code = answer.pdu ? modbus::exception_of(*answer.pdu) : std::nullopt;
    return code && *code <= 4;
}

/// Copies the entry's part of what was read.
void take(BatchRead& entry, const modbus::Span& span, const Reading& read) {
    const modbus::Span& wanted = entry.target.span;
    const std::uint32_t first = std::max(span.first, wanted.first);
    const std::uint32_t end = std::min(span.end(), wanted.end());
    std::copy(read.items.begin() + (first - span.first), read.items.begin() + (end - span.first),
              entry.reading.items.begin() + (first - wanted.first));
    ++entry.reading.transactions;
    entry.reading.cached = entry.reading.cached || read.cached;
    entry.reading.age = std::max(entry.reading.age, read.age);
}

void settle(Plan& plan, const points::PlannedRead& read, const bus::Answer& answer) {
    const auto failed = problem_of(answer, *plan.station().profile);
    if (failed && is_refused(answer) && halve(plan, read)) return;
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

/// Reads the entries of one station. A read that a panel refuses is bisected until only the missing
/// items fail, so that no entry fails because of its neighbour.
asio::awaitable<void> read_station(std::shared_ptr<Caller> caller, Plan plan, Patience patience,
                                   unsigned* transactions) {
    part_refused(plan, *caller);
    while (!plan.reads.empty()) {
        const points::PlannedRead read = std::move(plan.reads.front());
        plan.reads.pop_front();
        const bool is_in_vain = std::ranges::all_of(
            read.wants, [&](std::size_t want) { return plan.entries[want]->problem.has_value(); });
        if (is_in_vain) continue;
        bus::Request made{.station = plan.station().id,
                          .request = modbus::Request::read(read.span)};
        const bus::Answer answer =
            co_await ask(caller, plan.station().bus, std::move(made), patience);
        if (answer.transmitted) ++*transactions;
        settle(plan, read, answer);
    }
}

asio::awaitable<void> read_line(std::shared_ptr<Caller> caller, const LineEntry* line,
                                std::vector<BatchRead*> entries, Patience patience,
                                unsigned* transactions) {
    std::map<std::uint8_t, std::vector<BatchRead*>> stations;
    for (BatchRead* entry : entries) stations[entry->target.station.id].push_back(entry);
    for (auto& [id, of_station] : stations) {
        asio::awaitable<void> reads = read_station(
            caller, plan_of(std::move(of_station), line->serial), patience, transactions);
        co_await std::move(reads);
    }
}

json::object point_result(const BatchRead& read) {
    json::object result{{"station", read.target.station.name}};
    const points::Point& point = *read.target.point;
    for (const auto& [name, value] : point_json(point, point_reading(point, read.reading)))
        result[name] = value;
    if (read.view.raw)
        result["raw"] = json::array(read.reading.items.begin(), read.reading.items.end());
    result["source"] = read.reading.cached ? "cache" : "bus";
    return result;
}

/// {"status": 200, ...}, or the members of the problem.
json::object result_of_entry(const Parsed<json::object>& done) {
    if (!done) return json_of(done.error());
    json::object result{{"status", 200}};
    for (const auto& [name, value] : *done) result[name] = value;
    return result;
}

json::object result_of_entry(const BatchRead& read) {
    Parsed<json::object> done = json::object();
    if (read.problem) {
        done = *read.problem;
    } else {
        done = read.target.point != nullptr ? point_result(read)
                                            : describe(read.target, read.view, read.reading);
    }
    json::object result = result_of_entry(done);
    result["item"] = read.item;
    return result;
}

}  // namespace

Handling post_read(HttpRequest request, const Api* api) {
    auto reads = reads_of(request, *api).value();
    unsigned transactions = 0;
    std::vector<asio::awaitable<void>> lines;
    for (auto& [name, entries] : by_line(reads)) {
        const LineEntry* line = api->directory->find_line(name);
        const Patience patience(line->deadline, api->providers.now);
        lines.push_back(
            read_line(request.caller, line, std::move(entries), patience, &transactions));
    }
    asio::awaitable<void> all = gather(std::move(lines));
    co_await std::move(all);
    if (request.caller->has_left()) co_return HttpResponse{};
    const auto read = std::make_shared<const std::vector<BatchRead>>(std::move(reads));
    Table table{.directory = api->lent, .name = "results", .count = read->size()};
    table.entry = [read](std::size_t i) { return result_of_entry((*read)[i]); };
    table.behind["transactions"] = transactions;
    co_return table_answer(request, std::move(table));
}

namespace {

Parsed<Writing> write_of(const json::object& entry, const Directory& directory) {
    const auto target =
        made_writable(entry_target(entry, directory, {"value", "round", "verify"},
                                   {"values", "value", "type", "order", "length", "verify"}));
    if (!target) return target.error();
    const auto round = flag_member(entry, "round");
    if (!round) return round.error();
    return write_of(*target, entry, *round ? points::Rounding::nearest : points::Rounding::exact);
}

/// The name of what an entry names, for the log: "press/setpoint", "press/GDT108".
std::string place_of(const json::object& entry) {
    std::string place;
    for (const char* name : {"point", "station", "device", "table", "address"}) {
        const json::value* part = entry.if_contains(name);
        if (part == nullptr) continue;
        if (!place.empty()) place += '/';
        place += part->is_string() ? std::string(part->as_string()) : json_text(*part);
    }
    return place;
}

/// An entry that cannot be written is reported in its place.
Parsed<std::vector<BatchWrite>> writes_of(const HttpRequest& request, const Api& api) {
    const auto entries = entries_of(request.body, api.providers.settings.max_items);
    if (!entries) return entries.error();
    std::vector<BatchWrite> writes;
    for (const json::object& entry : *entries) {
        auto writing = write_of(entry, *api.directory);
        if (!writing)
            writing = told_of(entry, writing.error(), request.caller->who(), *api.directory);
        if (!writing && writing.error().status == 400)
            return in_entry(writes.size(), writing.error());
        BatchWrite& write = writes.emplace_back();
        write.item = entry;
        if (writing) {
            write.writing = std::move(*writing);
        } else {
            log_refused(*request.caller, place_of(entry), writing.error());
            write.result = json_of(writing.error());
        }
    }
    return writes;
}

/// Writes the entries of a line in their order.
asio::awaitable<void> write_line(std::shared_ptr<Caller> caller, std::vector<BatchWrite*> writes,
                                 Patience patience) {
    for (BatchWrite* one : writes) {
        asio::awaitable<Parsed<json::object>> pending = write(caller, &*one->writing, patience);
        const Parsed<json::object> result = co_await std::move(pending);
        one->result = result_of_entry(result);
    }
}

}  // namespace

Handling post_write(HttpRequest request, const Api* api) {
    auto writes = writes_of(request, *api).value();
    std::vector<asio::awaitable<void>> lines;
    for (auto& [name, entries] : by_line(writes)) {
        const Patience patience(api->directory->find_line(name)->deadline, api->providers.now);
        lines.push_back(write_line(request.caller, std::move(entries), patience));
    }
    asio::awaitable<void> all = gather(std::move(lines));
    co_await std::move(all);
    json::array results;
    for (BatchWrite& write : writes) {
        write.result["item"] = std::move(write.item);
        results.push_back(std::move(write.result));
    }
    co_return json_response(200, json::object{{"results", std::move(results)}});
}

}  // namespace panelgate::web
