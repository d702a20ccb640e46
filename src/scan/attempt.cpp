#include "attempt.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::scan {

using profile::allows;

namespace {

constexpr int kUsualRates[] = {9600, 19200, 38400, 115200, 57600, 4800, 2400};
constexpr int kAsciiRates[] = {9600, 19200, 38400, 115200};  // others only if requested
constexpr Parity kParities[] = {Parity::none, Parity::even, Parity::odd};
constexpr std::size_t kRounds[] = {4, 8};  // stations in each format; the third round has the rest
constexpr std::uint8_t kUsualLast = 31;    // of panels: their settings screens end there

/// Returns the profiles' default formats, the most frequent first, then by profile name.
std::vector<SerialFormat> profile_formats(const profile::Catalogue& profiles) {
    std::vector<SerialFormat> all;
    for (const auto& [name, profile] : profiles.all()) {
        if (!profile.serial.source.empty()) all.push_back(profile.serial.default_format);
    }
    std::map<std::ptrdiff_t, std::vector<SerialFormat>, std::greater<>> by_count;
    for (const SerialFormat& format : all)
        append_new(by_count[std::ranges::count(all, format)], format);
    std::vector<SerialFormat> ordered;
    for (const auto& [count, formats] : by_count)
        ordered.insert(ordered.end(), formats.begin(), formats.end());
    return ordered;
}

std::vector<int> with_wanted(std::vector<int> rates, const Settings& settings) {
    for (const int rate : settings.baud) append_new(rates, rate);
    return rates;
}

void keep_allowed(std::vector<SerialFormat>& formats, const Settings& settings) {
    std::erase_if(formats, [&](const SerialFormat& format) {
        return !allows(settings.baud, format.baud) || !allows(settings.parity, format.parity);
    });
}

}  // namespace

std::vector<SerialFormat> likely_formats(const profile::Catalogue& profiles,
                                         const Settings& settings) {
    if (settings.remote) return {SerialFormat{}};
    std::vector<SerialFormat> all = profile_formats(profiles);
    append_new(all, SerialFormat{});
    for (const int rate : with_wanted({std::begin(kUsualRates), std::end(kUsualRates)}, settings)) {
        for (const Parity parity : kParities) append_new(all, SerialFormat{rate, 8, parity, 1});
    }
    keep_allowed(all, settings);
    return all;
}

std::vector<SerialFormat> ascii_formats(const Settings& settings) {
    constexpr auto kAscii = SerialMode::ascii;
    SerialFormat standard;
    standard.data_bits = 7;
    standard.mode = kAscii;
    if (settings.remote) return {standard};
    std::vector<SerialFormat> all;
    for (const SerialFormat& format :
         {SerialFormat{0, 7, Parity::even, 1, kAscii}, SerialFormat{0, 8, Parity::none, 1, kAscii},
          SerialFormat{0, 7, Parity::odd, 1, kAscii},
          SerialFormat{0, 7, Parity::none, 2, kAscii}}) {
        for (const int rate :
             with_wanted({std::begin(kAsciiRates), std::end(kAsciiRates)}, settings)) {
            all.push_back(format);
            all.back().baud = rate;
        }
    }
    keep_allowed(all, settings);
    return all;
}

std::vector<std::uint8_t> likely_stations(const profile::Catalogue& profiles,
                                          const Settings& settings) {
    std::vector<std::uint8_t> wanted = settings.stations;
    if (wanted.empty()) {
        wanted.resize(kUsualLast);
        std::iota(wanted.begin(), wanted.end(), std::uint8_t{1});
    }
    std::set<std::uint8_t> ends;
    for (const auto& [name, profile] : profiles.all()) {
        ends.insert(profile.first_station);
        ends.insert(profile.last_station);
    }
    std::vector<std::uint8_t> ordered;
    for (const std::uint8_t station : ends) {
        if (allows(wanted, station)) ordered.push_back(station);
    }
    for (const std::uint8_t station : wanted) append_new(ordered, station);
    return ordered;
}

bool offers(const profile::PanelProfile& panel, const SerialFormat& format) {
    return format.mode == SerialMode::ascii ||
           (allows(panel.serial.baud, format.baud) && allows(panel.serial.parity, format.parity) &&
            allows(panel.serial.stop_bits, format.stop_bits));
}

std::optional<SerialFormat> common_format(const profile::Catalogue& profiles,
                                          const std::vector<const profile::PanelProfile*>& panels) {
    for (const SerialFormat& format : likely_formats(profiles, {})) {
        const auto fits = [&](const auto* panel) { return offers(*panel, format); };
        if (std::ranges::all_of(panels, fits)) return format;
    }
    return std::nullopt;
}

namespace {

/// True if a profile describes a panel at this address that sends the CRC's high byte first. No
/// `format`: a remote line.
bool may_be_high_first(const profile::Catalogue& profiles, std::uint8_t station,
                       const std::optional<SerialFormat>& format) {
    if (format && format->mode == SerialMode::ascii) return false;
    return std::ranges::any_of(profiles.all(), [&](const auto& entry) {
        const profile::PanelProfile& panel = entry.second;
        return panel.crc_order == modbus::CrcOrder::high_first && station >= panel.first_station &&
               station <= panel.last_station && (!format || offers(panel, *format));
    });
}

void add_rounds(std::deque<Turn>& turns, const std::vector<SerialFormat>& formats,
                const std::vector<std::uint8_t>& stations) {
    std::size_t from = 0;
    for (std::size_t round = 0; from < stations.size(); ++round) {
        const std::size_t left = stations.size() - from;
        const std::size_t count =
            round < std::size(kRounds) ? std::min(kRounds[round], left) : left;
        for (const SerialFormat& format : formats) {
            for (std::size_t i = from; i < from + count; ++i)
                turns.push_back({.format = format, .station = stations[i]});
        }
        from += count;
    }
}

}  // namespace

std::deque<Turn> search_turns(const profile::Catalogue& profiles, const Settings& settings) {
    const std::vector<SerialFormat> formats = likely_formats(profiles, settings);
    const std::vector<std::uint8_t> stations = likely_stations(profiles, settings);
    std::deque<Turn> turns;
    add_rounds(turns, formats, stations);
    for (const SerialFormat& format : formats) {
        const auto known = settings.remote ? std::nullopt : std::optional(format);
        for (const std::uint8_t station : stations) {
            if (may_be_high_first(profiles, station, known))
                turns.push_back({format, station, modbus::CrcOrder::high_first});
        }
    }
    add_rounds(turns, ascii_formats(settings), stations);
    for (std::size_t i = 0; i < turns.size(); ++i) {
        const bool leaves = i + 1 == turns.size() || turns[i + 1].format != turns[i].format;
        turns[i].timeout = leaves ? settings.leave_timeout : settings.search_timeout;
    }
    return turns;
}

std::deque<Turn> asking_turns(const profile::Catalogue& profiles, const Settings& settings,
                              const SerialFormat& format,
                              const std::optional<SerialFormat>& known) {
    constexpr auto kLow = modbus::CrcOrder::low_first;
    const std::vector<std::uint8_t> stations = likely_stations(profiles, settings);
    std::deque<Turn> turns;
    for (const std::uint8_t station : stations)
        turns.push_back({format, station, kLow, settings.first_timeout, true});
    if (settings.quick) {
        turns.back().timeout = settings.second_timeout;  // behind it nobody is heard
        return turns;
    }
    for (const std::uint8_t station : stations)
        turns.push_back({format, station, kLow, settings.second_timeout});
    for (const std::uint8_t station : stations) {
        if (format.mode == SerialMode::rtu && may_be_high_first(profiles, station, known))
            turns.push_back(
                {format, station, modbus::CrcOrder::high_first, settings.first_timeout});
    }
    return turns;
}

namespace {

bool is_plausible(ByteView bytes) {
    const std::uint8_t function = modbus::plain_function(bytes[1]);
    if (bytes[0] > modbus::kMaxStation || !modbus::is_known(function)) return false;
    return bytes[0] != 0 || modbus::is_broadcastable(bytes[1]);
}

struct Found {
    std::size_t length = 0;
    modbus::CrcOrder order = modbus::CrcOrder::low_first;
};

/// Returns the valid frame at the start of `bytes`.
std::optional<Found> frame_at_front(ByteView bytes) {
    if (bytes.size() < modbus::kMinAdu || !is_plausible(bytes)) return std::nullopt;
    const modbus::ReplyLength reply = modbus::reply_length(bytes);
    const bool known = reply.kind == modbus::ReplyLength::Kind::known;
    for (const std::size_t length :
         std::array<std::size_t, 3>{known ? reply.length : 0, modbus::kReadRequestAdu,
                                    modbus::request_adu_length(bytes)}) {
        if (length < modbus::kMinAdu || length > bytes.size()) continue;
        for (const auto& [word, order] : modbus::kCrcOrders) {
            if (modbus::crc_ok(bytes.first(length), order)) return Found{length, order};
        }
    }
    return std::nullopt;
}

}  // namespace

Heard extract_frames(ByteView bytes) {
    Heard heard;
    while (!bytes.empty()) {
        const auto found = frame_at_front(bytes);
        if (!found) {
            ++heard.damaged;
            bytes = bytes.subspan(1);
            continue;
        }
        const ByteView pdu = bytes.subspan(1, found->length - modbus::kAduOverhead);
        heard.frames.push_back({bytes[0], Bytes(pdu.begin(), pdu.end()), found->order});
        bytes = bytes.subspan(found->length);
    }
    return heard;
}

namespace {

/// USB adapters deliver bytes up to 16 ms late (FTDI AN232B-04).
constexpr Duration kAdapterPause = 25ms;
constexpr std::size_t kPauseCharacters = 5;
constexpr Duration kBabble = 300ms;
/// Fewer damaged bytes come from a transceiver switching over, not from a reply.
constexpr std::size_t kMinDamage = 3;

}  // namespace

Attempt::Attempt(ReadRequest request, const SerialFormat& format, TimePoint sent,
                 ReplyTimeouts timeouts)
    : request_(std::move(request)),
      start_by_(sent + frame_time(format, request_.adu().size()) + timeouts.start),
      latest_(start_by_ + kBabble + frame_time(format, modbus::kMaxLongRtuAdu)),
      settle_(timeouts.settle),
      gap_(std::max(kAdapterPause, wire_time(format, kPauseCharacters))) {}

/// Removes a partial echo, too: the rest is still coming.
ByteView Attempt::without_echo() const {
    const Bytes& sent = request_.adu();
    const auto same = std::ranges::mismatch(heard_, sent);
    const bool echo = same.in1 == heard_.end() || same.in2 == sent.end();
    return echo ? ByteView(heard_).subspan(std::min(heard_.size(), sent.size())) : ByteView(heard_);
}

bool Attempt::contains_header(ByteView bytes) const {
    for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
        const std::uint8_t function = modbus::plain_function(bytes[i + 1]);
        if (bytes[i] == request_.station() && function == request_.pdu()[0]) return true;
    }
    return false;
}

void Attempt::on_rx(TimePoint now, ByteView bytes) {
    last_rx_ = now;
    append_up_to(kMaxHeard, heard_, bytes);
    const Outcome so_far = finish();
    replied_ = so_far.kind == Outcome::Kind::replied;
    header_seen_ = so_far.header_seen;
}

TimePoint Attempt::ends_at() const {
    if (without_echo().empty()) return start_by_;
    if (replied_) return std::min(latest_, last_rx_ + settle_);
    if (header_seen_) return std::min(latest_, last_rx_ + std::max(gap_, settle_));
    return std::min(latest_, std::max(start_by_, last_rx_ + gap_));
}

Outcome Attempt::finish() const {
    Outcome outcome;
    Heard heard = extract_frames(without_echo());
    for (Frame& frame : heard.frames) {
        const bool ours = frame.station == request_.station() &&
                          frame.crc_order == request_.crc_order() &&
                          modbus::answers(request_.pdu(), frame.pdu);
        if (!ours) {
            outcome.unsolicited.push_back(std::move(frame));
        } else if (outcome.kind == Outcome::Kind::replied) {
            ++outcome.more;
        } else {
            outcome.kind = Outcome::Kind::replied;
            outcome.reply = std::move(frame.pdu);
        }
    }
    const bool damaged = heard.damaged >= kMinDamage;
    outcome.with_damage = damaged && outcome.kind == Outcome::Kind::replied;
    if (damaged && !outcome.with_damage) {
        outcome.kind = Outcome::Kind::damaged;
        outcome.header_seen = contains_header(without_echo());
    }
    return outcome;
}

}  // namespace panelgate::scan
