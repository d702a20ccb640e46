// What the store holds: the journal, and the history of a point over days.
#include <algorithm>
#include <boost/asio/awaitable.hpp>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/store/database.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace asio = boost::asio;

namespace {

using std::chrono::seconds;

constexpr std::string_view kEntryColumns[] = {"id",      "time",  "kind", "severity", "line",
                                              "station", "point", "who",  "text",     "data"};
constexpr std::string_view kSampleColumns[] = {"time", "min", "max", "mean", "count"};

/// The text of a query; "" if the query is not given.
std::string text_of(const HttpRequest& request, const std::string& query) {
    const auto given = request.query.find(query);
    return given == request.query.end() ? std::string() : given->second;
}

std::optional<WallTime> time_of(const HttpRequest& request, const std::string& query) {
    const std::string text = text_of(request, query);
    if (text.empty()) return std::nullopt;
    const auto time = parse_rfc3339(text);
    if (!time)
        refuse(400, query + " must be a time such as 2026-11-22T07:15:00Z, not '" + excerpt(text) +
                        '\'');
    return time;
}

/// Reads from the store. `read` runs in the store's thread and must use only what `read` owns.
template <class Result>
asio::awaitable<std::optional<Result>> read_store(
    const Api* api, std::function<Result(const store::Database&)> read) {
    using Found = std::optional<Result>;
    const auto found = std::make_shared<Found>();
    if (!api->providers.ask_store) refuse(503, "this program keeps no store");
    std::function<void(std::function<void(bool)>)> start = [=](std::function<void(bool)> done) {
        api->providers.ask_store(
            [found, read](const store::Database* from) {
                found->reset();
                if (from != nullptr) *found = read(*from);
            },
            [done = std::move(done)] { done(true); });
    };
    asio::awaitable<bool> reading = result_of<bool>(std::move(start));
    co_await std::move(reading);
    co_return std::move(*found);
}

[[noreturn]] void refuse_without_store() {
    refuse(503, "the store cannot be read: the log says why", "store");
}

/// As an event of the same place: what names no station may be about any of the line.
bool may_see(const Sight& sight, const store::Entry& entry) {
    using store::Kind;
    if (entry.kind == Kind::start || entry.kind == Kind::stop) return true;
    const bool is_of_line = entry.kind == Kind::line_up || entry.kind == Kind::line_down ||
                            entry.kind == Kind::finding || entry.kind == Kind::finding_gone;
    return sight.event({is_of_line ? "line" : "", entry.line, entry.station, entry.point});
}

store::JournalQuery query_of(const HttpRequest& request, const Api* api) {
    store::JournalQuery query;
    query.since = time_of(request, "since");
    query.until = time_of(request, "until");
    query.station = text_of(request, "station");
    constexpr unsigned kMost = store::JournalQuery::kLimit;
    query.limit = query_number(request, "limit", 1, kMost, 100).value();
    query.after =
        query_number(request, "after", 0, std::numeric_limits<unsigned>::max(), 0).value();
    for (const std::string& name : query_list(request, "kind")) {
        const auto kind = store::kind_of(name);
        if (!kind)
            refuse(400,
                   "there is no kind '" + excerpt(name) + "'; kinds are " + store::known_kinds());
        query.kinds.push_back(*kind);
    }
    query.may_see = [directory = api->lent,
                     who = request.caller->who()](const store::Entry& entry) {
        return may_see(Sight(*directory, who), entry);
    };
    return query;
}

json::object describe(const store::Entry& entry) {
    json::object object;
    object["id"] = entry.id;
    object["time"] = rfc3339(entry.time);
    object["kind"] = store::label(entry.kind);
    object["severity"] = entry.severity;
    object["line"] = entry.line;
    object["station"] = entry.station;
    object["point"] = entry.point;
    object["who"] = entry.who;
    object["text"] = entry.text;
    boost::system::error_code wrong;
    object["data"] = json::parse(entry.data.empty() ? "{}" : entry.data, wrong);
    return object;
}

json::object describe(const store::HistorySample& sample) {
    json::object object;
    object["time"] = rfc3339(sample.time);
    object["min"] = sample.values.min;
    object["max"] = sample.values.max;
    object["mean"] = sample.values.mean;
    object["count"] = sample.values.count;
    return object;
}

/// A table of what the store has returned.
template <class One>
Table table_of(std::string_view name, std::span<const std::string_view> columns,
               std::vector<One> list) {
    Table table;
    table.name = name;
    table.columns = columns;
    table.count = list.size();
    table.entry = [list = std::move(list)](std::size_t i) { return describe(list[i]); };
    return table;
}

/// "60s", "5m", "1h", "1d", or seconds; a multiple of 10 s.
seconds step_of(const HttpRequest& request, Duration span) {
    const std::string text = text_of(request, "step");
    constexpr seconds kSlot = store::Block::kSlot;
    constexpr std::int64_t kUsual = 500;  // samples, for a plot
    if (text.empty()) {
        const auto least = std::chrono::ceil<seconds>(span / kUsual);
        return std::max(kSlot, (least + kSlot - seconds(1)) / kSlot * kSlot);
    }
    constexpr std::pair<std::string_view, int> kUnits[] = {
        {"", 1}, {"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86'400}};
    const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
    const auto number = to_number<std::uint32_t>(std::string_view(text).substr(0, digits));
    const auto* const unit = std::ranges::find(kUnits, std::string_view(text).substr(digits),
                                               &std::pair<std::string_view, int>::first);
    const seconds step(number && unit != std::end(kUnits) ? std::int64_t{*number} * unit->second
                                                          : 0);
    if (step < kSlot || step % kSlot != seconds(0))
        refuse(400, "step must be a multiple of 10 s such as 60s, 5m or 1h, not '" + excerpt(text) +
                        '\'');
    return step;
}

store::HistoryQuery history_query(const HttpRequest& request, const Api* api, std::string point) {
    store::HistoryQuery query;
    query.point = std::move(point);
    query.to = time_of(request, "to").value_or(api->providers.wall());
    query.from = time_of(request, "from").value_or(query.to - std::chrono::days(1));
    if (query.from >= query.to) refuse(400, "from must be before to");
    query.step = step_of(request, query.to - query.from);
    const auto steps = (query.to - query.from) / query.step;
    if (steps > static_cast<std::int64_t>(store::HistoryQuery::kSamples))
        refuse(400, "these are " + std::to_string(steps) +
                        " samples: take a longer step, at most " +
                        std::to_string(store::HistoryQuery::kSamples) + " are given");
    const auto behind = std::chrono::floor<seconds>(query.from.time_since_epoch()) % query.step;
    query.from = std::chrono::floor<seconds>(query.from) - behind;
    return query;
}

}  // namespace

bool asks_for_days(const HttpRequest& request) {
    return std::ranges::any_of(std::array{"from", "to", "step"},
                               [&](const char* query) { return request.query.contains(query); });
}

Handling get_journal(HttpRequest request, const Api* api) {
    std::function<store::JournalPage(const store::Database&)> read =
        [query = query_of(request, api)](const store::Database& from) {
            return from.journal(query);
        };
    asio::awaitable<std::optional<store::JournalPage>> reading =
        read_store<store::JournalPage>(api, std::move(read));
    auto page = co_await std::move(reading);
    if (!page) refuse_without_store();
    const std::int64_t next = page->next;
    Table table = table_of("entries", kEntryColumns, std::move(page->entries));
    table.behind["next"] = nullptr;
    if (next != 0) table.behind["next"] = next;
    co_return table_answer(request, std::move(table));
}

Handling get_days(HttpRequest request, const Api* api) {
    const auto found =
        find_point(*api->directory, request.arguments[0], request.arguments[1]).value();
    json::object members;
    members["station"] = found.station.name;
    members["point"] = found.point->name;
    members["unit"] = found.point->unit;
    const auto query = history_query(request, api, found.station.name + '/' + found.point->name);
    members["step_ms"] = std::chrono::milliseconds(query.step).count();
    api->providers.write_history(query.point);
    using Samples = std::vector<store::HistorySample>;
    std::function<Samples(const store::Database&)> read = [query](const store::Database& from) {
        return from.history(query);
    };
    asio::awaitable<std::optional<Samples>> reading = read_store<Samples>(api, std::move(read));
    auto samples = co_await std::move(reading);
    if (!samples) refuse_without_store();
    Table table = table_of("samples", kSampleColumns, std::move(*samples));
    table.members = std::move(members);
    co_return table_answer(request, std::move(table));
}

}  // namespace panelgate::web
