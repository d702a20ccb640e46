#include "writing.hpp"

#include <algorithm>
#include <array>
#include <boost/json/array.hpp>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "answer.hpp"
#include "body.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/web/api/point_order.hpp"
#include "panelgate/web/http/message.hpp"
#include "reading.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace {

/// Offset of the data of 0F and 10: function, address, quantity and byte count.
constexpr std::size_t kMultipleHead = 6;

/// The tables that show this memory: the request's, the area's own, then the others.
std::vector<modbus::Table> tables_of(const profile::PanelProfile& panel, const modbus::Span& span) {
    std::vector<modbus::Table> tables{span.table};
    const profile::Area* area = panel.find_area(span.table, span.first);
    if (area == nullptr) return tables;
    tables.push_back(area->table);
    tables.insert(tables.end(), area->also.begin(), area->also.end());
    std::erase_if(tables, [&](modbus::Table table) {
        return modbus::is_bit_table(table) != modbus::is_bit_table(span.table);
    });
    return tables;
}

}  // namespace

std::optional<Verification> Verification::of(const modbus::Request& write) {
    const auto span = write.access().write;
    if (!span) return std::nullopt;
    const ByteView pdu = write.pdu();
    Verification made;
    made.span_ = *span;
    Reader in(pdu.subspan(3));
    switch (write.function()) {
        case modbus::kWriteSingleCoil:
            made.cells_.push_back({static_cast<std::uint16_t>(in.u16() != 0)});
            return made;
        case modbus::kWriteSingleRegister:
            made.cells_.push_back({in.u16()});
            return made;
        case modbus::kMaskWriteRegister: {
            const std::uint16_t kept = in.u16();
            const std::uint16_t set = in.u16();
            const auto mask = static_cast<std::uint16_t>(~kept);
            made.cells_.push_back({static_cast<std::uint16_t>(set & mask), mask});
            return made;
        }
        case modbus::kWriteMultipleCoils:
            for (unsigned i = 0; i < span->count; ++i) {
                const unsigned bit = pdu[kMultipleHead + i / 8] >> (i % 8) & 1u;
                made.cells_.push_back({static_cast<std::uint16_t>(bit)});
            }
            return made;
        case modbus::kWriteMultipleRegisters: {
            Reader data(pdu.subspan(kMultipleHead));
            for (unsigned i = 0; i < span->count; ++i) made.cells_.push_back({data.u16()});
            return made;
        }
        default:
            return std::nullopt;
    }
}

Parsed<modbus::Span> Verification::span_to_read(const profile::PanelProfile& panel) const {
    for (const modbus::Table table : tables_of(panel, span_)) {
        const std::uint8_t function = read_function(table);
        if (panel.has_function(function) && span_.count <= panel.max_count(function))
            return modbus::Span{table, span_.first, span_.count};
    }
    return ruled_out(bus::Rule::function,
                     "verify is not possible: the panel has no function that "
                     "reads its " +
                         std::string(label(span_.table)));
}

bool Verification::holds(std::span<const std::uint16_t> items) const {
    return std::ranges::equal(items, cells_, [](std::uint16_t item, const Cell& cell) {
        return (item & cell.mask) == cell.value;
    });
}

namespace {

/// Checks the written items against the area's writable range.
Parsed<void> check_area(Items items, std::size_t count) {
    if (items.area == nullptr) return {};
    items.span.count = static_cast<unsigned>(count);
    return check_range(items, *items.area->writable, "writable");
}

}  // namespace

Parsed<Bytes> plan_write(const Items& items, const std::vector<std::uint16_t>& cells) {
    if (cells.size() > modbus::kTableItems - items.span.first) {
        return problem(422, "these values go beyond address 65535");
    }
    const auto range = check_area(items, cells.size());
    if (!range) return range.error();
    const profile::PanelProfile& panel = *items.station.profile;
    const auto functions = write_functions(items.span.table, cells.size());
    for (const std::uint8_t function : functions) {
        if (!panel.has_function(function)) continue;
        const unsigned limit = panel.max_count(function);
        if (cells.size() > limit) {
            return ruled_out(bus::Rule::quantity, "at most " + std::to_string(limit) +
                                                      " values in one write; writes are not split");
        }
        return encode_write(function, items.address(), cells);
    }
    return ruled_out(bus::Rule::function, "the panel has no function " +
                                              upper_hex({&functions.back(), 1}) + " for " +
                                              std::to_string(cells.size()) + " of its " +
                                              std::string(label(items.span.table)));
}

std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count) {
    const bool bits = modbus::is_bit_table(table);
    std::vector<std::uint8_t> functions;
    if (count == 1) {
        functions.push_back(bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister);
    }
    functions.push_back(bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters);
    return functions;
}

Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells) {
    if (function == modbus::kWriteSingleCoil) {
        return modbus::encode_write_coil(address, cells.front() != 0);
    }
    if (function == modbus::kWriteSingleRegister) {
        return modbus::encode_write_register(address, cells.front());
    }
    if (function == modbus::kWriteMultipleCoils) {
        return modbus::encode_write_coils(address, std::vector<bool>(cells.begin(), cells.end()));
    }
    return modbus::encode_write_registers(address, cells);
}

namespace json = boost::json;
namespace {

Problem not_writable(modbus::Table table) {
    Problem made = problem(405, std::string(label(table)) + " cannot be written", "not-writable");
    made.headers.emplace_back("Allow", "GET, HEAD");
    return made;
}

/// Makes the write, with its verification if the body asks for it.
Parsed<Writing> writing_of(const StationEntry& station, Bytes pdu, const json::object& body) {
    const auto verify = flag_member(body, "verify");
    if (!verify) return verify.error();
    auto request = request_to(station.id, std::move(pdu));
    if (!request) return request.error();
    Writing made{.station = station, .request = std::move(*request)};
    if (!*verify) return made;
    made.verification = Verification::of(made.request.request);
    const auto readable = made.verification->span_to_read(*station.profile);
    if (!readable) return readable.error();
    return made;
}

/// How messages call a value of the body: "value", or "values[2]".
std::string place_in(const json::object& body, std::size_t index) {
    if (body.contains("value")) return "value";
    return "values[" + std::to_string(index) + ']';
}

/// Encodes typed values ("f32", "i32", ...) as registers. A string takes `length` characters, or as
/// many as it needs.
Parsed<std::vector<std::uint16_t>> typed_cells(const json::object& body, modbus::Table table) {
    const auto format = format_of(body);
    if (!format) return format.error();
    auto view = view_of(*format, table);
    if (!view) return view.error();
    const auto values = values_member(body);
    if (!values) return values.error();
    std::vector<std::uint16_t> cells;
    for (std::size_t i = 0; i < values->size(); ++i) {
        const auto value = value_of((*values)[i]);
        if (!value) return value.error();
        view->value.name = place_in(body, i);
        const auto* text = std::get_if<std::string>(&*value);
        if (text != nullptr && !format->length)
            view->value.length = static_cast<unsigned>(text->size() + text->size() % 2);
        const auto registers = points::encode(view->value, *value);
        if (!registers) return problem_of(registers.error(), "");
        cells.insert(cells.end(), registers->begin(), registers->end());
    }
    return cells;
}

Parsed<std::vector<std::uint16_t>> cells_of(const json::object& body, modbus::Table table) {
    const bool is_typed =
        std::ranges::any_of(std::array{"type", "order", "length"},
                            [&](const char* name) { return body.contains(name); });
    return is_typed ? typed_cells(body, table) : values_member(body, table);
}

Parsed<Writing> plan(const Items& items, const Parsed<json::object>& body) {
    if (!is_writable(items.span.table)) return not_writable(items.span.table);
    if (!body) return body.error();
    const auto cells = cells_of(*body, items.span.table);
    if (!cells) return cells.error();
    auto pdu = plan_write(items, *cells);
    if (!pdu) return pdu.error();
    return writing_of(items.station, std::move(*pdu), *body);
}

Parsed<Writing> plan(const PointOfStation& to, const Parsed<json::object>& body,
                     const Parsed<points::Rounding>& rounding) {
    if (!rounding) return rounding.error();
    if (!body) return body.error();
    const auto value = value_member(*body);
    if (!value) return value.error();
    auto write = points::write_request(*to.station.profile, *to.point, *value, *rounding);
    if (!write) return problem_of(write.error(), "; ?round=true writes the nearest");
    auto made = writing_of(to.station, write->pdu, *body);
    if (made) made->point = std::move(*write);
    return made;
}

/// The outcome is unknown: the request was transmitted, and no reply came.
bool is_unknown(const bus::Answer& answer) {
    return answer.transmitted && !answer.refusal && !answer.pdu;
}

json::object confirmed(const Writing& writing) {
    if (writing.point) return web::confirmed(*writing.point);
    return {{"transmitted", true}, {"confirmed", true}};
}

}  // namespace

void log_refused(const Caller& caller, const std::string& at, const Problem& why) {
    constexpr std::array<unsigned, 4> kRefusals{403, 405, 409, 422};
    if (std::ranges::find(kRefusals, why.status) == kRefusals.end()) return;
    log_client(caller, "write refused",
               {{"at", at}, {"status", std::to_string(why.status)}, {"why", why.detail}});
}

void add_read_back(json::object& result, const ReadBack& back) {
    result["verified"] = nullptr;
    if (!back.holds) {
        result["verify_detail"] = back.why;
        return;
    }
    result["verified"] = *back.holds;
    if (!*back.holds) result["read_back"] = json::array(back.items.begin(), back.items.end());
}

boost::asio::awaitable<ReadBack> read_back(std::shared_ptr<Caller> caller,
                                           const StationEntry* station, const Verification* written,
                                           Patience patience) {
    ReadBack back;
    const auto span = written->span_to_read(*station->profile);
    if (!span) {
        back.why = span.error().detail;
        co_return back;
    }
    boost::asio::awaitable<Parsed<Reading>> reads =
        read_all(std::move(caller), station, *span, patience);
    const Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) {
        back.why = reading.error().detail;
        co_return back;
    }
    back.holds = written->holds(reading->items);
    if (!*back.holds) back.items = reading->items;
    co_return back;
}

Parsed<Items> made_writable(Parsed<Items> items) {
    if (!items || items->area == nullptr) return items;
    const auto& also = items->area->also;
    const auto writable = std::ranges::find_if(also, is_writable);
    if (!is_writable(items->span.table) && writable != also.end()) items->span.table = *writable;
    if (is_writable(items->span.table) && !items->area->writable) {
        return ruled_out(bus::Rule::write_protected,
                         items->area->name + " is read-only in this panel");
    }
    return items;
}

Parsed<Writing> write_of(const Items& items, const Parsed<json::object>& body) {
    return unless_refused(plan(items, body), *items.station.bus, items.station.id);
}

Parsed<Writing> write_of(const PointOfStation& to, const Parsed<json::object>& body,
                         const Parsed<points::Rounding>& rounding) {
    return unless_refused(plan(to, body, rounding), *to.station.bus, to.station.id);
}

boost::asio::awaitable<Parsed<json::object>> write(std::shared_ptr<Caller> caller,
                                                   const Writing* writing, Patience patience) {
    bus::Request request = writing->request;
    request.within = patience.left();
    const bus::Answer answer = co_await ask(caller, writing->station.bus, std::move(request));
    auto failed = problem_of(answer, *writing->station.profile);
    json::object result = confirmed(*writing);
    json::object& verified = failed ? failed->extensions : result;
    if (writing->verification && (!failed || is_unknown(answer))) {
        boost::asio::awaitable<ReadBack> reads =
            read_back(std::move(caller), &writing->station, &*writing->verification, patience);
        const ReadBack back = co_await std::move(reads);
        add_read_back(verified, back);
    }
    if (failed) co_return std::move(*failed);
    co_return result;
}

}  // namespace panelgate::web
