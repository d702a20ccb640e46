#include "own_unit.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/listener.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

// The registers: the same as input and as holding registers. describe_register_map() documents
// them.
constexpr std::uint16_t kMapVersion = 2;
constexpr std::size_t kRegisters = 5000;
constexpr std::size_t kInputs = 256;  // one for each unit
constexpr std::size_t kLines = 4;
constexpr std::size_t kRegistersPerLine = 3;
constexpr std::size_t kMostLines = 32;
constexpr std::size_t kGateway = 100;
constexpr std::size_t kStations = 1000;
constexpr std::size_t kRegistersPerStation = 16;
constexpr std::size_t kMostUnits = 248;  // 0..247
static_assert(kLines + kMostLines * kRegistersPerLine <= kGateway);
static_assert(kStations + kMostUnits * kRegistersPerStation <= kRegisters);

constexpr std::size_t kMostRegisters = 125;  // per read, AP 6.3
constexpr std::size_t kMostInputs = 2000;    // AP 6.2
// Identification, AP 6.21
constexpr std::uint8_t kBasicStream = 0x01;
constexpr std::uint8_t kIndividual = 0x04;
constexpr std::uint8_t kConformity = 0x82;  // regular, stream and individual access
constexpr std::size_t kBasicObjects = 3;
constexpr std::size_t kLongest = 60;  // characters of an object: all objects fit one reply

constexpr std::string_view kText =
    R"(gateway: its own unit, on each Modbus listener that has diagnostics_unit, such as 255

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

  43/14       basic and regular identification: vendor, product, version, URL, name, model, machine

Nothing can be written; every other function is exception 01.
)";

using Map = std::vector<std::uint16_t>;

std::uint16_t clamp16(double value) {
    return static_cast<std::uint16_t>(std::clamp(std::round(value), 0.0, 65535.0));
}

/// Two registers, the high word first.
void put_wide(Map& map, std::size_t at, std::uint64_t value) {
    map[at] = static_cast<std::uint16_t>(value >> 16);
    map[at + 1] = static_cast<std::uint16_t>(value);
}

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

void show_gateway(Map& map, const Diagnostics& state) {
    map[0] = kMapVersion;
    map[1] = clamp16(static_cast<double>(state.lines.size()));
    put_wide(map, 2, static_cast<std::uint64_t>(to_seconds(state.uptime)));
    for (std::size_t i = 0; i < std::min(state.lines.size(), kMostLines); ++i) {
        const Diagnostics::Line& line = state.lines[i];
        const std::size_t at = kLines + i * kRegistersPerLine;
        map[at] = line.up ? 1 : 0;
        map[at + 1] = clamp16(static_cast<double>(line.queue_depth));
        map[at + 2] = clamp16(line.load_percent * 10);
    }
    for (std::size_t i = 0; i < 3; ++i) map[kGateway + i] = part_of(state.version, i);
    map[kGateway + 3] = clamp16(static_cast<double>(state.counters.connections));
    put_wide(map, kGateway + 4, state.counters.requests);
    put_wide(map, kGateway + 6, state.counters.exceptions);
    put_wide(map, kGateway + 8, state.counters.protocol_errors);
}

std::uint16_t word_of(Health state) {
    constexpr std::array kWords{Health::unknown, Health::online, Health::suspect, Health::offline,
                                Health::heard};
    const auto* const found = std::ranges::find(kWords, state);
    return static_cast<std::uint16_t>(1 + (found - kWords.begin()));
}

void show_station(Map& map, std::size_t at, const Diagnostics::Station& station) {
    constexpr std::uint64_t kNever = std::numeric_limits<std::uint32_t>::max();
    const OutcomeCounts& outcomes = station.outcomes;
    map[at] = word_of(station.state);
    map[at + 1] = station.line ? static_cast<std::uint16_t>(*station.line + 1) : 0;
    map[at + 2] = station.id;
    put_wide(map, at + 4,
             !station.last_answer
                 ? kNever
                 : std::min(static_cast<std::uint64_t>(to_milliseconds(*station.last_answer)),
                            kNever - 1));
    put_wide(map, at + 6,
             outcomes[Outcome::ok] + outcomes[Outcome::cached] + outcomes[Outcome::shared]);
    put_wide(map, at + 8, outcomes[Outcome::exception]);
    put_wide(map, at + 10, outcomes[Outcome::timeout]);
    put_wide(map, at + 12, outcomes[Outcome::damaged]);
    put_wide(map, at + 14,
             outcomes[Outcome::refused] + outcomes[Outcome::busy] + outcomes[Outcome::expired] +
                 outcomes[Outcome::cancelled] + outcomes[Outcome::offline] +
                 outcomes[Outcome::line_down]);
}

std::optional<Diagnostics::Station> station_at(const Diagnostics& state, std::size_t unit) {
    if (unit >= kMostUnits || !state.station) return std::nullopt;
    return state.station(static_cast<std::uint8_t>(unit));
}

Bytes refuse(ByteView request, ExceptionCode code) {
    return modbus::encode_exception(request[0], code);
}

/// Returns the registers from `first` to before `end`, as they stand in a reply.
Bytes registers(const Diagnostics& state, std::size_t first, std::size_t end) {
    Map map(kRegisters);
    show_gateway(map, state);
    for (std::size_t unit = 0; unit < kMostUnits; ++unit) {
        const std::size_t at = kStations + unit * kRegistersPerStation;
        if (at >= end || at + kRegistersPerStation <= first) continue;
        if (const auto station = station_at(state, unit)) show_station(map, at, *station);
    }
    Writer out;
    for (std::size_t at = first; at < end; ++at) out.u16(map[at]);
    return out.take();
}

/// The same of the inputs.
Bytes inputs(const Diagnostics& state, std::size_t first, std::size_t end) {
    std::vector<bool> bits;
    for (std::size_t unit = first; unit < end; ++unit) {
        const auto station = station_at(state, unit);
        bits.push_back(station && station->state == Health::online);
    }
    return modbus::pack_bits(bits);
}

Bytes read(ByteView request, const Diagnostics& state) {
    const bool bits = request[0] == modbus::kReadDiscreteInputs;
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t end = first + in.u16();
    if (end == first || end - first > (bits ? kMostInputs : kMostRegisters))
        return refuse(request, ExceptionCode::illegal_data_value);
    if (end > (bits ? kInputs : kRegisters))
        return refuse(request, ExceptionCode::illegal_data_address);
    const Bytes data = bits ? inputs(state, first, end) : registers(state, first, end);
    return Writer().u8(request[0]).u8(static_cast<unsigned>(data.size())).raw(data).take();
}

/// Returns the reply to 2B/0E (AP 6.21): basic objects (vendor, product code, version) and regular
/// ones (URL, product, model, host). `request` is a PDU of four bytes.
Bytes identify(ByteView request, const Diagnostics& state) {
    const std::uint8_t code = request[2];
    if (code < kBasicStream || code > kIndividual)
        return refuse(request, ExceptionCode::illegal_data_value);
    const std::array<std::string_view, 7> objects = {"panelgate", "panelgate", state.version,
                                                     state.url,   "panelgate", "Modbus gateway",
                                                     state.host};
    const std::size_t count = code == kBasicStream ? kBasicObjects : objects.size();
    std::size_t first = request[3];
    if (first >= count) {
        if (code == kIndividual) return refuse(request, ExceptionCode::illegal_data_address);
        first = 0;  // a stream restarts at the beginning
    }
    const std::size_t end = code == kIndividual ? first + 1 : count;
    Writer out;
    out.u8(request[0]).u8(modbus::kMeiDeviceIdentification).u8(code).u8(kConformity);
    out.u8(0).u8(0).u8(static_cast<unsigned>(end - first));  // nothing follows in another reply
    for (std::size_t id = first; id < end; ++id) {
        const std::string_view text = objects.at(id).substr(0, kLongest);
        out.u8(static_cast<unsigned>(id)).u8(static_cast<unsigned>(text.size()));
        for (const char c : text) out.u8(static_cast<unsigned char>(c));
    }
    return out.take();
}

}  // namespace

std::string describe_register_map() { return std::string(kText); }

Bytes answer_diagnostics(ByteView request, const Diagnostics& state) {
    const bool reads = request[0] == modbus::kReadDiscreteInputs ||
                       request[0] == modbus::kReadHoldingRegisters ||
                       request[0] == modbus::kReadInputRegisters;
    const bool identifies = request[0] == modbus::kEncapsulatedInterface &&
                            (request.size() < 2 || request[1] == modbus::kMeiDeviceIdentification);
    if (!reads && !identifies) return refuse(request, ExceptionCode::illegal_function);
    if (!modbus::check_request(request)) return refuse(request, ExceptionCode::illegal_data_value);
    return reads ? read(request, state) : identify(request, state);
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
