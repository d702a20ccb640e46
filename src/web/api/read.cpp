#include <algorithm>
#include <boost/json/array.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "answer.hpp"
#include "ask.hpp"
#include "handlers.hpp"
#include "panel_limits.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/notation.hpp"
#include "station_path.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

/// One GET must not occupy a line for minutes: at 19200 baud this many full reads take about 10 s.
constexpr unsigned kMaxTransactions = 64;

enum class ValueType : std::uint8_t { u16, i16, boolean };

Parsed<ValueType> parse_type(const HttpRequest& request, modbus::Table table) {
    const bool bits = modbus::is_bit_table(table);
    const auto given = request.query.find("type");
    if (given == request.query.end()) return bits ? ValueType::boolean : ValueType::u16;
    if (bits && given->second == "bool") return ValueType::boolean;
    if (!bits && given->second == "u16") return ValueType::u16;
    if (!bits && given->second == "i16") return ValueType::i16;
    return problem(400,
                   bits ? "the type of a bit is bool" : "the type of a register is u16 or i16");
}

/// Values read so far, and what the answer says of them.
struct Reading {
    json::array values;
    unsigned transactions = 0;
    Duration age{};
    bool cached = false;
};

void append_values(Reading& reading, ByteView reply, const Items& part, ValueType type) {
    if (type == ValueType::boolean) {
        for (const bool bit : modbus::bits_of(reply, part.span.count))
            reading.values.push_back(bit);
        return;
    }
    for (const std::uint16_t value : modbus::registers_of(reply)) {
        if (type == ValueType::i16) {
            reading.values.push_back(static_cast<std::int16_t>(value));
        } else {
            reading.values.push_back(value);
        }
    }
}

json::object describe(const Items& items, Reading reading) {
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
    body["values"] = std::move(reading.values);
    body["age_ms"] = whole_ms(reading.age);
    body["source"] = reading.cached ? "cache" : "bus";
    if (reading.transactions > 1) body["transactions"] = reading.transactions;
    return body;
}

std::optional<Problem> take_answer(Reading& reading, const bus::Answer& answer, const Items& part,
                                   ValueType type) {
    if (auto failed = problem_of(answer, *part.station.profile)) return failed;
    append_values(reading, *answer.pdu, part, type);
    ++reading.transactions;
    if (answer.source == bus::Source::cache) {
        reading.cached = true;
        reading.age = std::max(reading.age, answer.age);
    }
    return std::nullopt;
}

Handling read_items(HttpRequest request, Parsed<Items> items) {
    if (!items) co_return to_response(items.error());
    const auto type = parse_type(request, items->span.table);
    if (!type) co_return to_response(type.error());
    const unsigned limit = items->station.profile->max_count(read_function(items->span.table));
    if (items->span.count > limit * kMaxTransactions) {
        co_return to_response(
            problem(422, "at most " + std::to_string(limit * kMaxTransactions) + " at once"));
    }
    Reading reading;
    for (unsigned done = 0; done < items->span.count;) {
        Items part = *items;
        part.span.first = items->span.first + done;
        part.span.count = std::min(limit, items->span.count - done);
        auto planned = request_to(part.station.id, modbus::encode_read(part.span));
        if (!planned) co_return to_response(planned.error());
        bus::Request made = std::move(*planned);
        bus::Answer answer = co_await ask(request.caller, part.station.bus, std::move(made));
        const auto failed = take_answer(reading, answer, part, *type);
        if (failed) co_return to_response(*failed);
        done += part.span.count;
    }
    co_return json_response(200, describe(*items, std::move(reading)));
}

/// A notation names memory: it is read through the first table that the panel can read it by.
Parsed<Items> device_to_read(const HttpRequest& request, const Directory& directory) {
    auto items = items_of_device_path(request, directory);
    if (!items) return items;
    const auto range = check_range(*items, items->area->readable, "readable");
    if (!range) return range.error();
    const auto table = table_to_read(*items);
    if (!table) return table.error();
    items->span.table = *table;
    return items;
}

}  // namespace

Handling get_table(HttpRequest request, const Api* api) {
    auto items = items_of_table_path(request, *api->directory);
    return read_items(std::move(request), std::move(items));
}

Handling get_device(HttpRequest request, const Api* api) {
    auto items = device_to_read(request, *api->directory);
    return read_items(std::move(request), std::move(items));
}

}  // namespace panelgate::web
