#include "own_unit.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "register_map.hpp"

namespace panelgate::tcp_server {

/// Returns the reply to 2B/0E (AP 6.21), stream and individual access: basic (vendor, product code,
/// version), regular (URL, product, model, host) and extended objects (80 + i: the name of line i).
/// `request` is a PDU of four bytes. Objects that do not fit follow in the next reply.
Bytes identify(ByteView request, const Diagnostics& state);

namespace {

using modbus::ExceptionCode;

constexpr std::size_t kMostRegisters = 125;  // per read, AP 6.3
constexpr std::size_t kMostInputs = 2000;    // AP 6.2
constexpr std::uint8_t kServerId = 'P';      // AP 6.13: device specific
constexpr std::uint8_t kRunning = 0xFF;
// Sub-functions of 08, AP 6.8.1.
constexpr std::uint16_t kReturnQueryData = 0x00;

Bytes refuse(ByteView request, ExceptionCode code) {
    return modbus::encode_exception(request[0], code);
}

/// Returns the exception for a read of `count` items, at most `most` per request and `items` in
/// all; nullopt if valid.
std::optional<ExceptionCode> objection(std::size_t first, std::size_t count, std::size_t most,
                                       std::size_t items) {
    if (count == 0 || count > most) return ExceptionCode::illegal_data_value;
    if (first + count > items) return ExceptionCode::illegal_data_address;
    return std::nullopt;
}

Bytes read_registers(ByteView request, const Diagnostics& state) {
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t count = in.u16();
    if (const auto code = objection(first, count, kMostRegisters, kMapRegisters))
        return refuse(request, *code);
    RegisterMap map(state);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(2 * count));
    for (std::size_t i = first; i < first + count; ++i) out.u16(map.at(i));
    return out.take();
}

Bytes read_inputs(ByteView request, const Diagnostics& state) {
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t count = in.u16();
    if (const auto code = objection(first, count, kMostInputs, kMapInputs))
        return refuse(request, *code);
    RegisterMap map(state);
    std::vector<bool> inputs;
    for (std::size_t i = first; i < first + count; ++i) inputs.push_back(map.input(i));
    const Bytes packed = modbus::pack_bits(inputs);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(packed.size())).raw(packed);
    return out.take();
}

/// Returns the counter of a sub-function of 08; nullopt if it is not a counter.
std::optional<std::uint64_t> counter_of(std::uint16_t sub_function, const Counters& counters) {
    switch (sub_function) {
        case 0x02:  // diagnostic register
        case 0x10:  // negative acknowledgements
        case 0x12:  // character overruns
            return 0;
        case 0x0B:
            return counters.requests + counters.protocol_errors;
        case 0x0C:
            return counters.protocol_errors;
        case 0x0D:
            return counters.exceptions;
        case 0x0E:
            return counters.requests;
        case 0x0F:
            return counters.unanswered;
        case 0x11:
            return counters.busy;
        default:
            return std::nullopt;
    }
}

Bytes diagnose(ByteView request, const Counters& counters) {
    Reader in(request.subspan(1));
    const std::uint16_t sub_function = in.u16();
    const std::uint16_t data = in.u16();
    if (sub_function == kReturnQueryData) return Bytes(request.begin(), request.end());
    const auto counter = counter_of(sub_function, counters);
    if (!counter) return refuse(request, ExceptionCode::illegal_function);
    if (data != 0 || request.size() != 5) return refuse(request, ExceptionCode::illegal_data_value);
    Writer out;
    out.u8(request[0]).u16(sub_function).u16(static_cast<std::uint16_t>(*counter));
    return out.take();
}

/// AP 6.9: not busy, and the number of requests completed without an exception.
Bytes count_events(ByteView request, const Counters& counters) {
    Writer out;
    out.u8(request[0]).u16(0);
    out.u16(static_cast<std::uint16_t>(counters.requests - counters.exceptions));
    return out.take();
}

Bytes report_id(ByteView request, const std::string& version) {
    const std::string text = "panelgate " + version.substr(0, 32);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(2 + text.size())).u8(kServerId).u8(kRunning);
    for (const char c : text) out.u8(static_cast<unsigned char>(c));
    return out.take();
}

/// True if the gateway's own unit supports this function.
bool has(ByteView request) {
    switch (request[0]) {
        case modbus::kReadDiscreteInputs:
        case modbus::kReadHoldingRegisters:
        case modbus::kReadInputRegisters:
        case modbus::kDiagnostics:
        case modbus::kGetCommEventCounter:
        case modbus::kReportServerId:
            return true;
        case modbus::kEncapsulatedInterface:
            return request.size() < 2 || request[1] == modbus::kMeiDeviceIdentification;
        default:
            return false;
    }
}

}  // namespace

Bytes answer_diagnostics(ByteView request, const Diagnostics& state) {
    if (!has(request)) return refuse(request, ExceptionCode::illegal_function);
    if (!modbus::check_request(request)) return refuse(request, ExceptionCode::illegal_data_value);
    switch (request[0]) {
        case modbus::kReadDiscreteInputs:
            return read_inputs(request, state);
        case modbus::kDiagnostics:
            return diagnose(request, state.counters);
        case modbus::kGetCommEventCounter:
            return count_events(request, state.counters);
        case modbus::kReportServerId:
            return report_id(request, state.version);
        case modbus::kEncapsulatedInterface:
            return identify(request, state);
        default:
            return read_registers(request, state);
    }
}

namespace {

constexpr std::uint8_t kBasicStream = 0x01;
constexpr std::uint8_t kRegularStream = 0x02;
constexpr std::uint8_t kIndividual = 0x04;
constexpr std::uint8_t kConformity = 0x83;  // extended, stream and individual access
constexpr std::uint8_t kMoreFollows = 0xFF;
constexpr std::uint8_t kFirstRegular = 0x03;
constexpr std::uint8_t kFirstExtended = 0x80;
constexpr std::size_t kMostExtended = 0x80;
constexpr std::size_t kHeader = 7;    // of the reply's PDU
constexpr std::size_t kLongest = 64;  // characters of an object

struct Object {
    std::uint8_t id;
    std::string_view text;
};

/// Returns the objects of this access type, in the order of their ids.
std::vector<Object> objects_of(std::uint8_t code, const Diagnostics& state) {
    std::vector<Object> objects = {{0, "panelgate"}, {1, "panelgate"}, {2, state.version},
                                   {3, state.url},   {4, "panelgate"}, {5, "Modbus gateway"},
                                   {6, state.host}};
    for (std::size_t i = 0; i < std::min(state.lines.size(), kMostExtended); ++i)
        objects.push_back({static_cast<std::uint8_t>(kFirstExtended + i), state.lines[i].name});
    std::erase_if(objects, [&](const Object& object) {
        return (code == kBasicStream && object.id >= kFirstRegular) ||
               (code == kRegularStream && object.id >= kFirstExtended);
    });
    for (Object& object : objects) object.text = object.text.substr(0, kLongest);
    return objects;
}

}  // namespace

Bytes identify(ByteView request, const Diagnostics& state) {
    const std::uint8_t code = request[2];
    if (code < kBasicStream || code > kIndividual)
        return refuse(request, ExceptionCode::illegal_data_value);
    const std::vector<Object> objects = objects_of(code, state);
    auto first = std::ranges::find(objects, request[3], &Object::id);
    if (first == objects.end()) {
        if (code == kIndividual) return refuse(request, ExceptionCode::illegal_data_address);
        first = objects.begin();  // a stream restarts at the beginning (AP 6.21)
    }
    Writer list;
    std::size_t size = kHeader;
    auto next = first;
    const auto end = code == kIndividual ? first + 1 : objects.end();
    for (; next != end && size + 2 + next->text.size() <= modbus::kMaxPdu; ++next) {
        list.u8(next->id).u8(static_cast<unsigned>(next->text.size()));
        for (const char c : next->text) list.u8(static_cast<unsigned char>(c));
        size += 2 + next->text.size();
    }
    const bool more = next != end;
    Writer out(size);
    out.u8(request[0]).u8(modbus::kMeiDeviceIdentification).u8(code).u8(kConformity);
    out.u8(more ? kMoreFollows : 0).u8(more ? next->id : 0);
    out.u8(static_cast<unsigned>(next - first)).raw(list.take());
    return out.take();
}

namespace {

std::optional<Diagnostics::Station> station_of(std::uint8_t unit, const UnitMap& units) {
    const Result<Target> target = units.route(unit);
    if (!target || !units.is_listed(unit)) return std::nullopt;
    const bus::StationStatus status = target->bus->station_status(target->station);
    const auto& lines = units.lines();
    const auto line = std::ranges::find(lines, target->bus);
    Diagnostics::Station station;
    station.state = status.state;
    station.id = target->station;
    station.last_answer = status.last_success;
    station.outcomes = target->bus->outcomes(target->station);
    if (line != lines.end()) station.line = static_cast<std::size_t>(line - lines.begin());
    return station;
}

}  // namespace

Diagnostics own_state(const Shared& shared) {
    Diagnostics state;
    state.uptime = shared.clock.now() - shared.started;
    state.counters = shared.counters;
    state.version = shared.version;
    state.url = shared.settings.url;
    state.host = shared.settings.host;
    for (const bus::LineView* line : shared.units.lines()) {
        const bus::LineStatus status = line->status();
        state.lines.push_back({status.name, status.up, status.queue_depth, status.load_percent});
    }
    state.station = [&shared](std::uint8_t unit) { return station_of(unit, shared.units); };
    return state;
}

}  // namespace panelgate::tcp_server
