#include "register_map.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>
#include <system_error>

#include "panelgate/tcp_server/register_map_text.hpp"

namespace panelgate::tcp_server {
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

}  // namespace panelgate::tcp_server
