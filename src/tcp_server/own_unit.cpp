#include "own_unit.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/register_map_text.hpp"

namespace panelgate::tcp_server {

/// The gateway's own register map, the same for input and holding registers, with a discrete input
/// per unit. Every address below these is readable; unassigned ones are 0. describe_register_map()
/// (panelgate/tcp_server/register_map_text.hpp) documents it.
inline constexpr std::size_t kMapRegisters = 5000;
inline constexpr std::size_t kMapInputs = 256;

/// The registers and inputs, computed from `state`; unassigned addresses read 0.
class RegisterMap {
  public:
    /// `state` must outlive it.
    explicit RegisterMap(const Diagnostics& state) : state_(state) {}
    std::uint16_t at(std::size_t address);
    /// True if the station behind this unit is online.
    bool input(std::size_t unit);

  private:
    std::uint16_t of_gateway(std::size_t address) const;
    std::uint16_t fixed(std::size_t address) const;
    std::uint16_t of_station(std::size_t offset) const;
    void look_at(std::size_t unit);

    const Diagnostics& state_;
    std::optional<std::size_t> unit_;  ///< unit of `station_`
    std::optional<Diagnostics::Station> station_;
};

namespace {

constexpr std::uint16_t kMapVersion = 2;
constexpr std::size_t kLines = 4;
constexpr std::size_t kRegistersPerLine = 3;
constexpr std::size_t kMostLines = 32;
constexpr std::size_t kGateway = 100;  // gateway registers
constexpr std::size_t kStations = 1000;
constexpr std::size_t kRegistersPerStation = 16;
constexpr std::size_t kMostUnits = 248;  // 0..247
static_assert(kLines + kMostLines * kRegistersPerLine <= kGateway);
static_assert(kStations + kMostUnits * kRegistersPerStation <= kMapRegisters);

std::uint16_t clamp16(double value) {
    return static_cast<std::uint16_t>(std::clamp(std::round(value), 0.0, 65535.0));
}

std::uint16_t high(std::uint64_t value) { return static_cast<std::uint16_t>(value >> 16); }
std::uint16_t low(std::uint64_t value) { return static_cast<std::uint16_t>(value); }

/// Returns part `index` (from 0) of "1.2.3".
std::uint16_t part_of(std::string_view version, std::size_t index) {
    for (; index > 0; --index) {
        const std::size_t dot = version.find('.');
        if (dot == std::string_view::npos) return 0;
        version.remove_prefix(dot + 1);
    }
    std::uint16_t number = 0;
    std::from_chars(version.data(), version.data() + version.size(), number);
    return number;
}

std::uint16_t word_of(Health state) {
    switch (state) {
        case Health::unknown:
            return 1;
        case Health::online:
            return 2;
        case Health::suspect:
            return 3;
        case Health::offline:
            return 4;
        case Health::heard:
            return 5;
    }
    std::abort();
}

/// Returns the age in ms, capped to 32 bits; all ones: never answered.
std::uint64_t age_of(const std::optional<Duration>& last_answer) {
    constexpr std::uint64_t kNever = std::numeric_limits<std::uint32_t>::max();
    if (!last_answer) return kNever;
    return std::min(static_cast<std::uint64_t>(to_milliseconds(*last_answer)), kNever - 1);
}

std::uint64_t answered(const OutcomeCounts& outcomes) {
    return outcomes[Outcome::ok] + outcomes[Outcome::cached] + outcomes[Outcome::shared];
}

std::uint64_t not_sent(const OutcomeCounts& outcomes) {
    return outcomes[Outcome::refused] + outcomes[Outcome::busy] + outcomes[Outcome::expired] +
           outcomes[Outcome::cancelled] + outcomes[Outcome::offline] + outcomes[Outcome::line_down];
}

constexpr std::string_view kText =
    R"(gateway: its own unit, on each Modbus listener (diagnostics_unit, default 255)

Input and holding registers 0..4999 (03 and 04), the same in both; every read inside succeeds, and
what nothing stands at is 0. Two registers: the high word first.

  0           version of this map: 2
  1           lines of this listener
  2, 3        seconds since it started
  4 + 3i      line i (from 0 to 31, in the order of the listener): 1 up, 0 down
  5 + 3i      requests that wait for it
  6 + 3i      its load in 0.1 % of the wire, over the last ten seconds
  100 .. 102  version of the program: major, minor, patch
  103         connections to this listener that are open
  104, 105    requests it has taken
  106, 107    exceptions it has answered, the panels' included
  108, 109    what it took for no request
  1000 + 16u  unit u (from 0 to 247): 0 no listed station, 1 not asked yet, 2 online,
              3 its last transaction failed, 4 offline, 5 answers another master
  1001 + 16u  its line, from 1; 0: an alias of another listener's line
  1002 + 16u  its station address on that line
  1004 + 16u  (2) milliseconds since its last answer; 4294967295: it has never answered
  1006 + 16u  (2) requests that got values, of all who ask, polls and REST included
  1008 + 16u  (2) requests that it refused with an exception
  1010 + 16u  (2) requests without an answer
  1012 + 16u  (2) requests with a damaged answer
  1014 + 16u  (2) requests that were not sent: refused, queue full, too late, offline, line down

Discrete inputs 0..255 (02): 1 where unit u is online.

  08          00 gives back what was sent; counters of this listener: 0B requests and what was taken
              for none, 0C what was taken for none, 0D exceptions, 0E requests, 0F requests without
              an answer, 10 none, 11 exceptions 06, 12 none; 02 is 0
  11          requests without an exception
  17          'P', running, "panelgate" and the version
  43/14       basic, regular and extended identification: vendor, product, version, URL, name, model,
              machine; 128 + i is the name of line i

Nothing can be written; every other function is exception 01.
)";

}  // namespace

std::uint16_t RegisterMap::at(std::size_t address) {
    if (address < kStations) return of_gateway(address);
    look_at((address - kStations) / kRegistersPerStation);
    return of_station((address - kStations) % kRegistersPerStation);
}

bool RegisterMap::input(std::size_t unit) {
    look_at(unit);
    return station_ && station_->state == Health::online;
}

void RegisterMap::look_at(std::size_t unit) {
    if (unit_ == unit) return;
    unit_ = unit;
    const bool may_be = unit < kMostUnits && state_.station;
    station_ = may_be ? state_.station(static_cast<std::uint8_t>(unit)) : std::nullopt;
}

std::uint16_t RegisterMap::of_gateway(std::size_t address) const {
    const std::size_t line = address < kLines ? 0 : (address - kLines) / kRegistersPerLine;
    if (address >= kLines && line < std::min(state_.lines.size(), kMostLines)) {
        const Diagnostics::Line& shown = state_.lines[line];
        const std::size_t what = (address - kLines) % kRegistersPerLine;
        if (what == 0) return shown.up ? 1 : 0;
        return what == 1 ? clamp16(static_cast<double>(shown.queue_depth))
                         : clamp16(shown.load_percent * 10);
    }
    return fixed(address);
}

std::uint16_t RegisterMap::fixed(std::size_t address) const {
    const auto uptime = static_cast<std::uint64_t>(to_seconds(state_.uptime));
    const Counters& counters = state_.counters;
    switch (address) {
        case 0:
            return kMapVersion;
        case 1:
            return clamp16(static_cast<double>(state_.lines.size()));
        case 2:
            return high(uptime);
        case 3:
            return low(uptime);
        case kGateway:
        case kGateway + 1:
        case kGateway + 2:
            return part_of(state_.version, address - kGateway);
        case kGateway + 3:
            return clamp16(static_cast<double>(counters.connections));
        case kGateway + 4:
            return high(counters.requests);
        case kGateway + 5:
            return low(counters.requests);
        case kGateway + 6:
            return high(counters.exceptions);
        case kGateway + 7:
            return low(counters.exceptions);
        case kGateway + 8:
            return high(counters.protocol_errors);
        case kGateway + 9:
            return low(counters.protocol_errors);
        default:
            return 0;
    }
}

std::uint16_t RegisterMap::of_station(std::size_t offset) const {
    if (!station_) return 0;
    const OutcomeCounts& outcomes = station_->outcomes;
    const std::array<std::uint64_t, 6> wide = {
        age_of(station_->last_answer), answered(outcomes),         outcomes[Outcome::exception],
        outcomes[Outcome::timeout],    outcomes[Outcome::damaged], not_sent(outcomes)};
    switch (offset) {
        case 0:
            return word_of(station_->state);
        case 1:
            return station_->line ? static_cast<std::uint16_t>(*station_->line + 1) : 0;
        case 2:
            return station_->id;
        case 3:
            return 0;
        default:
            return offset % 2 == 0 ? high(wide[(offset - 4) / 2]) : low(wide[(offset - 4) / 2]);
    }
}

std::string describe_register_map() { return std::string(kText); }

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

std::optional<Diagnostics::Station> station_of(std::uint8_t unit, const UnitMap& units,
                                               const WhoRef& who) {
    const Result<Target> target = units.route(unit);
    if (!target || !units.is_listed(unit)) return std::nullopt;
    if (!target->bus->tells(who, target->station)) return std::nullopt;
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

Diagnostics own_state(const Shared& shared, WhoRef who) {
    Diagnostics state;
    state.uptime = shared.clock.now() - shared.started;
    state.counters = shared.counters;
    state.version = shared.version;
    state.url = shared.settings.url;
    state.host = shared.settings.host;
    for (const bus::LineView* line : shared.units.lines()) {
        if (!line->tells(who, 0)) {
            state.lines.emplace_back();  // the others keep their places
            continue;
        }
        const bus::LineStatus status = line->status();
        state.lines.push_back({status.name, status.up, status.queue_depth, status.load_percent});
    }
    state.station = [&shared, who = std::move(who)](std::uint8_t unit) {
        return station_of(unit, shared.units, who);
    };
    return state;
}

}  // namespace panelgate::tcp_server
