#include "batch_read.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "answer.hpp"
#include "ask.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/read_plan.hpp"

namespace panelgate::web {
namespace {

/// As large as the panel's own frames are, which REST may use.
points::PlanLimits limits_of(const StationEntry& station, const SerialFormat& serial) {
    points::PlanLimits limits =
        points::make_plan_limits(*station.profile, serial, silent_interval(serial));
    for (const modbus::Table table : modbus::kTables)
        limits.of(table).max_items = station.profile->max_count(read_function(table));
    return limits;
}

/// Those of one station, as the plan has them: by number.
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

/// Of what was read, the part that the entry wants.
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

/// The panel has said that it will not give all of these items.
bool is_refused(const bus::Answer& answer) {
    if (answer.refusal || !answer.pdu) return false;
    const auto code = modbus::exception_of(*answer.pdu);
    return code && *code <= 4;
}

/// Its halves are asked for next; false when it has none.
bool halve(Plan& plan, const points::PlannedRead& read) {
    auto halves = points::bisect(read, plan.wants);
    if (!halves) return false;
    plan.reads.push_front(std::move(halves->second));
    plan.reads.push_front(std::move(halves->first));
    return true;
}

void settle(Plan& plan, const points::PlannedRead& read, const bus::Answer& answer) {
    const auto failed = problem_of(answer, *plan.entries.front()->items.station.profile);
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

boost::asio::awaitable<void> read_station(std::shared_ptr<Caller> caller,
                                          std::vector<BatchRead*> entries, SerialFormat serial,
                                          Patience patience, unsigned* transactions) {
    Plan plan = plan_of(std::move(entries), serial);
    const StationEntry& station = plan.entries.front()->items.station;
    while (!plan.reads.empty()) {
        const points::PlannedRead read = std::move(plan.reads.front());
        plan.reads.pop_front();
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
