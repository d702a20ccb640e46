#include "reading.hpp"

#include <algorithm>
#include <boost/json/array.hpp>
#include <optional>
#include <string>
#include <utility>

#include "answer.hpp"
#include "ask.hpp"
#include "panel_limits.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// What stopped a read after some of its items: its time may just have been too short for all, and
/// then no panel is to blame.
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

boost::asio::awaitable<Parsed<Reading>> read_all(std::shared_ptr<Caller> caller,
                                                 const StationEntry* station, modbus::Span span,
                                                 Patience patience) {
    Reading reading;
    const unsigned limit = station->profile->max_count(read_function(span.table));
    while (reading.items.size() < span.count) {
        const auto done = static_cast<unsigned>(reading.items.size());
        const modbus::Span part{span.table, span.first + done, std::min(limit, span.count - done)};
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

Parsed<View> prepare_read(Items& items, const Wording& wording, unsigned max_transactions) {
    auto view = view_of(wording, items.span.table);
    if (!view) return view;
    items.span.count = view->items;
    if (items.area != nullptr) {
        const auto range = check_range(items, items.area->readable, "readable");
        if (!range) return range.error();
    }
    if (items.span.end() > modbus::kTableItems)
        return problem(400, std::to_string(items.span.count) + " items from " +
                                std::to_string(items.span.first) + " go beyond address 65535");
    // A notation names memory: it is read through the first table that the panel can read it by.
    const auto table = table_to_read(items);
    if (!table) return table.error();
    items.span.table = *table;
    const unsigned most =
        items.station.profile->max_count(read_function(items.span.table)) * max_transactions;
    if (items.span.count > most)
        return problem(422, "at most " + std::to_string(most) + " at once", "too-many");
    return view;
}

json::object describe(const Items& items, const View& view, const Reading& reading) {
    std::string notation;
    if (items.area != nullptr) {
        notation = profile::format_notation(*items.area, items.address());
    } else if (!items.station.unknown_panel) {
        notation =
            profile::format_notation(*items.station.profile, items.span.table, items.address());
    }
    json::object body;
    body["station"] = items.station.name;
    body["table"] = label(items.span.table);
    body["address"] = items.span.first;
    body["notation"] = nullptr;
    if (!notation.empty()) body["notation"] = notation;
    body["values"] = values_of(view, reading.items);
    if (view.raw) body["raw"] = json::array(reading.items.begin(), reading.items.end());
    body["age_ms"] = whole_ms(reading.age);
    body["source"] = reading.cached ? "cache" : "bus";
    if (reading.transactions > 1) body["transactions"] = reading.transactions;
    return body;
}

}  // namespace panelgate::web
