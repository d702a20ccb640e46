#include "heard_stations.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/exception.hpp"

namespace panelgate::bus {

Outcome outcome_of(const tap::Transaction& heard) {
    switch (heard.end) {
        case tap::End::answered:
            return modbus::exception_of(heard.reply) ? Outcome::exception : Outcome::ok;
        case tap::End::silent:
            return Outcome::timeout;
        case tap::End::damaged:
            return Outcome::damaged;
        case tap::End::unasked:
            return Outcome::ok;
    }
    std::abort();
}

HeardStations::HeardStations(const Stations& listed, int offline_after) {
    apply(listed, offline_after);
}

void HeardStations::apply(const Stations& listed, int offline_after) {
    offline_after_ = offline_after;
    Wire before = std::exchange(wire_, {});
    wire_[0] = std::move(before[0]);
    for (const auto& [id, station] : listed) wire_[id] = std::move(before[id]);
}

arbiter::StationCounters& HeardStations::wire_of(std::uint8_t station) {
    const auto listed = wire_.find(station);
    return listed == wire_.end() ? wire_[0] : listed->second;
}

void HeardStations::count(const tap::Transaction& heard) {
    line_.busy += heard.sent - heard.asked;
    if (heard.end == tap::End::unasked) {
        if (heard.station == 0) ++line_.broadcasts;
        return;
    }
    One& one = stations_[heard.station];
    if (heard.doubtful) ++one.counts.doubtful;
    if (heard.end == tap::End::answered) return count_answer(one, heard);
    if (!heard.doubtful) count_failure(one, heard);
}

void HeardStations::count_answer(One& one, const tap::Transaction& heard) {
    arbiter::StationCounters& wire = wire_of(heard.station);
    line_.busy += heard.ended - heard.sent;
    ++one.counts.requests;
    ++wire.symptoms.answered;
    if (const auto code = modbus::exception_of(heard.reply)) {
        ++one.counts.exceptions;
        ++wire.exceptions[*code];
    } else {
        ++one.counts.replies;
    }
    one.silences = 0;
    one.failed = false;
    wire.symptoms.mute_in_a_row = 0;
    one.last_success = heard.ended;
    if (heard.doubtful) return;
    const Duration think = std::max<Duration>(heard.replied - heard.sent, Duration::zero());
    one.counts.think = think;
    one.counts.longest_think = std::max(one.counts.longest_think, think);
    wire.turnaround.observe(think);
    wire.bus_transaction.observe(heard.ended - heard.asked);
}

void HeardStations::count_failure(One& one, const tap::Transaction& heard) {
    arbiter::StationCounters& wire = wire_of(heard.station);
    ++one.counts.requests;
    one.failed = true;
    if (heard.end == tap::End::damaged) {
        ++one.counts.damaged;
        ++wire.symptoms.damaged_long;
        one.silences = 0;
        wire.symptoms.mute_in_a_row = 0;
        return;
    }
    ++one.counts.timeouts;
    ++one.silences;
    ++wire.symptoms.silent;
    ++wire.symptoms.mute_in_a_row;
}

void HeardStations::count(const tap::Frame& frame) {
    arbiter::StationCounters& wire = wire_of(frame.station);
    switch (frame.kind) {
        case FrameKind::damaged:
            ++wire.damaged_frames;
            break;
        case FrameKind::late:
            ++wire.late_frames;
            break;
        case FrameKind::copy:
        case FrameKind::foreign:
            ++wire.foreign_frames;
            break;
        case FrameKind::request:
        case FrameKind::retry:
        case FrameKind::probe:
        case FrameKind::learn_echo:
        case FrameKind::broadcast:
        case FrameKind::reply:
        case FrameKind::heard_request:
        case FrameKind::echo:
        case FrameKind::foreign_request:
            return;
    }
    wire.discarded_bytes += frame.bytes.size();
}

Health HeardStations::health(std::uint8_t station) const {
    const auto found = stations_.find(station);
    if (found == stations_.end() || found->second.counts.requests == 0) return Health::unknown;
    const One& one = found->second;
    if (one.silences >= offline_after_) return Health::offline;
    return one.failed ? Health::suspect : Health::heard;
}

StationStatus HeardStations::status(std::uint8_t station, TimePoint now) const {
    StationStatus status;
    status.state = health(station);
    const auto found = stations_.find(station);
    status.heard = found == stations_.end() ? HeardCounts{} : found->second.counts;
    if (found != stations_.end() && found->second.last_success)
        status.last_success = now - *found->second.last_success;
    return status;
}

}  // namespace panelgate::bus
