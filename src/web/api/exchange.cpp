#include "exchange.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/system/system_error.hpp>
#include <exception>

#include "panelgate/modbus/response.hpp"
#include "panelgate/web/api/render.hpp"
#include "panelgate/web/api/values.hpp"

namespace panelgate::web {

namespace asio = boost::asio;
namespace json = boost::json;
namespace {

/// How the coroutines of gather() have ended so far.
struct Gathering {
    std::size_t open = 0;
    std::exception_ptr failed;
};
using Gathered = std::shared_ptr<Gathering>;

}  // namespace

asio::awaitable<void> gather(std::vector<asio::awaitable<void>> all) {
    if (all.empty()) co_return;
    const auto executor = co_await asio::this_coro::executor;
    std::function<void(std::function<void(Gathered)>)> start =
        [&all, executor](const std::function<void(Gathered)>& done) {
            const auto gathering = std::make_shared<Gathering>(all.size());
            for (asio::awaitable<void>& one : all) {
                asio::co_spawn(executor, std::move(one),
                               [gathering, done](std::exception_ptr failed) {
                                   if (!gathering->failed) gathering->failed = failed;
                                   if (--gathering->open == 0) done(gathering);
                               });
            }
        };
    asio::awaitable<Gathered> pending = result_of<Gathered>(std::move(start));
    const Gathered gathering = co_await std::move(pending);
    if (gathering->failed) std::rethrow_exception(gathering->failed);
}

void introduce(Caller& caller, bus::RequestPort* bus) {
    const bus::ClientId client = caller.id();
    caller.at_leaving(bus, [bus, client] { bus->cancel(client); });
    bus->name_client(client, caller.name());
}

asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::RequestPort* bus,
                                 bus::Request request, Patience patience) {
    if (caller->has_hung_up() && !caller->has_left()) co_return bus::Answer{};  // cancelled
    if (!caller->has_left()) {
        const bool changes = !request.request.is_read();
        introduce(*caller, bus);
        request.client = caller->id();
        request.who = caller->who();
        request.within = patience.left();
        std::function<void(std::function<void(bus::Answer)>)> start =
            [bus, &request](std::function<void(bus::Answer)> done) {
                bus->transact(std::move(request), std::move(done));
            };
        asio::awaitable<bus::Answer> pending = result_of<bus::Answer>(std::move(start));
        bus::Answer answer = co_await std::move(pending);
        answer.transactions.for_each(
            [&](std::uint64_t number) { caller->add_cost({bus, number}); });
        if (answer.transmitted && changes) caller->take_effect();
        if (!caller->has_left()) co_return answer;
    }
    throw boost::system::system_error(asio::error::operation_aborted);
}

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

bool is_refused_here(const Caller& caller, const StationEntry& station, const modbus::Span& span) {
    const bus::Request request{
        .station = station.id, .request = modbus::Request::read(span), .who = caller.who()};
    return station.bus->refusal_of(request).has_value();
}

namespace {

/// The requests that read the items. A request that the bus would refuse comes first, so that a
/// read that is refused in part is not sent at all.
std::vector<modbus::Span> parts_of(const Caller& caller, const StationEntry& station,
                                   const modbus::Span& span) {
    const std::uint32_t limit = station.profile->max_count(read_function(span.table));
    std::vector<modbus::Span> parts;
    for (std::uint32_t first = span.first; first < span.end(); first += limit)
        parts.push_back({span.table, first, std::min(limit, span.end() - first)});
    if (parts.size() == 1) return parts;
    const auto refused = std::ranges::find_if(
        parts, [&](const modbus::Span& part) { return is_refused_here(caller, station, part); });
    if (refused != parts.end()) std::iter_swap(parts.begin(), refused);
    return parts;
}

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

asio::awaitable<Parsed<Reading>> read_all(std::shared_ptr<Caller> caller,
                                          const StationEntry* station, modbus::Span span,
                                          Patience patience) {
    Reading reading;
    const std::vector<modbus::Span> parts = parts_of(*caller, *station, span);
    for (const modbus::Span& part : parts) {
        auto planned = request_to(station->id, modbus::encode_read(part));
        if (!planned) co_return planned.error();
        bus::Answer answer = co_await ask(caller, station->bus, std::move(*planned), patience);
        auto failed = problem_of(answer, *station->profile);
        if (failed)
            co_return stopped(std::move(*failed), answer, patience, reading.items.size(),
                              span.count);
        reading.take(answer, part);
    }
    co_return reading;
}

std::optional<Verification> Verification::of(const modbus::Request& write) {
    constexpr std::size_t kMultipleHead = 6;  // function, address, quantity and byte count
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

namespace {

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

Parsed<modbus::Span> Verification::span_to_read(const profile::PanelProfile& panel) const {
    for (const modbus::Table table : tables_of(panel, span_)) {
        const std::uint8_t function = read_function(table);
        if (panel.has_function(function) && span_.count <= panel.max_count(function))
            return modbus::Span{table, span_.first, span_.count};
    }
    return ruled_out(bus::Rule::function,
                     "verify is not possible: the panel has no function that reads its " +
                         std::string(label(span_.table)));
}

bool Verification::holds(std::span<const std::uint16_t> items) const {
    return std::ranges::equal(items, cells_, [](std::uint16_t item, const Cell& cell) {
        return (item & cell.mask) == cell.value;
    });
}

asio::awaitable<bool> read_back(std::shared_ptr<Caller> caller, const StationEntry* station,
                                const Verification* written, Patience patience,
                                json::object* result) {
    json::object& told = *result;
    told["verified"] = nullptr;
    const auto span = written->span_to_read(*station->profile);
    if (!span) {
        told["verify_detail"] = span.error().detail;
        co_return false;
    }
    asio::awaitable<Parsed<Reading>> reads = read_all(std::move(caller), station, *span, patience);
    const Parsed<Reading> reading = co_await std::move(reads);
    if (!reading) {
        told["verify_detail"] = reading.error().detail;
        co_return false;
    }
    const bool holds = written->holds(reading->items);
    told["verified"] = holds;
    if (!holds) told["read_back"] = json::array(reading->items.begin(), reading->items.end());
    co_return holds;
}

std::vector<std::uint8_t> write_functions(modbus::Table table, std::size_t count) {
    const bool bits = modbus::is_bit_table(table);
    std::vector<std::uint8_t> functions;
    if (count == 1)
        functions.push_back(bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister);
    functions.push_back(bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters);
    return functions;
}

Bytes encode_write(std::uint8_t function, std::uint16_t address,
                   const std::vector<std::uint16_t>& cells) {
    if (function == modbus::kWriteSingleCoil)
        return modbus::encode_write_coil(address, cells.front() != 0);
    if (function == modbus::kWriteSingleRegister)
        return modbus::encode_write_register(address, cells.front());
    if (function == modbus::kWriteMultipleCoils)
        return modbus::encode_write_coils(address, std::vector<bool>(cells.begin(), cells.end()));
    return modbus::encode_write_registers(address, cells);
}

namespace {

/// The PDU that writes these cells from the first item on, with the first function that the panel
/// has for them; or why the panel cannot take them. Writes are never split.
Parsed<Bytes> plan_cells(const Target& to, const std::vector<std::uint16_t>& cells) {
    if (const auto checked = check_written(to, cells.size()); !checked) return checked.error();
    const profile::PanelProfile& panel = *to.station.profile;
    const auto functions = write_functions(to.span.table, cells.size());
    for (const std::uint8_t function : functions) {
        if (!panel.has_function(function)) continue;
        const unsigned limit = panel.max_count(function);
        if (cells.size() <= limit) return encode_write(function, to.address(), cells);
        return ruled_out(bus::Rule::quantity, "at most " + std::to_string(limit) +
                                                  " values in one write; writes are not split");
    }
    return ruled_out(bus::Rule::function, "the panel has no function " +
                                              upper_hex({&functions.back(), 1}) + " for " +
                                              std::to_string(cells.size()) + " of its " +
                                              std::string(label(to.span.table)));
}

Parsed<Bytes> plan_items(const Target& to, const json::object& body) {
    const auto cells = cells_of(body, to.span.table);
    if (!cells) return cells.error();
    return plan_cells(to, *cells);
}

Parsed<points::PointWrite> plan_point(const Target& to, const json::object& body,
                                      points::Rounding rounding) {
    const auto value = value_member(body);
    if (!value) return value.error();
    auto write = points::write_request(*to.station.profile, *to.point, *value, rounding);
    if (!write) return problem_of(write.error(), "; ?round=true writes the nearest");
    return std::move(*write);
}

Problem not_writable(modbus::Table table) {
    Problem made = problem(405, std::string(label(table)) + " cannot be written", "not-writable");
    made.headers.emplace_back("Allow", "GET, HEAD");
    return made;
}

Parsed<Writing> plan(const Target& to, const Parsed<json::object>& body,
                     const Parsed<points::Rounding>& rounding) {
    if (!rounding) return rounding.error();
    if (to.point == nullptr && !is_writable(to.span.table)) return not_writable(to.span.table);
    if (!body) return body.error();
    std::optional<points::PointWrite> point;
    Bytes pdu;
    if (to.point != nullptr) {
        auto planned = plan_point(to, *body, *rounding);
        if (!planned) return planned.error();
        point = std::move(*planned);
        pdu = point->pdu;
    } else {
        auto planned = plan_items(to, *body);
        if (!planned) return planned.error();
        pdu = std::move(*planned);
    }
    const auto verify = flag_member(*body, "verify");
    if (!verify) return verify.error();
    auto request = request_to(to.station.id, std::move(pdu));
    if (!request) return request.error();
    Writing made{.station = to.station, .request = std::move(*request), .point = std::move(point)};
    if (!*verify) return made;
    made.verification = Verification::of(made.request.request);
    const auto readable = made.verification->span_to_read(*to.station.profile);
    if (!readable) return readable.error();
    return made;
}

}  // namespace

Parsed<Writing> write_of(const Target& to, const Parsed<json::object>& body,
                         const Parsed<points::Rounding>& rounding) {
    return unless_refused(plan(to, body, rounding), *to.station.bus, to.station.id);
}

asio::awaitable<Parsed<json::object>> write(std::shared_ptr<Caller> caller, const Writing* writing,
                                            Patience patience) {
    const bus::Answer answer =
        co_await ask(caller, writing->station.bus, writing->request, patience);
    auto failed = problem_of(answer, *writing->station.profile);
    json::object result = confirmed(writing->point ? &*writing->point : nullptr);
    const bool is_unknown = answer.transmitted && !answer.refusal && !answer.pdu;
    if (writing->verification && (!failed || is_unknown)) {
        asio::awaitable<bool> reads =
            read_back(std::move(caller), &writing->station, &*writing->verification, patience,
                      failed ? &failed->extensions : &result);
        co_await std::move(reads);
    }
    if (failed) co_return std::move(*failed);
    co_return result;
}

void log_refused(const Caller& caller, const std::string& at, const Problem& why) {
    constexpr std::array<unsigned, 4> kRefusals{403, 405, 409, 422};
    if (std::ranges::find(kRefusals, why.status) == kRefusals.end()) return;
    log_client(caller, "write refused",
               {{"at", at}, {"status", std::to_string(why.status)}, {"why", why.detail}});
}

}  // namespace panelgate::web
