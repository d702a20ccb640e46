#include "panelgate/scan/scanner.hpp"

#include <algorithm>
#include <utility>

#include "attempt.hpp"
#include "panelgate/modbus/response.hpp"
#include "state.hpp"

namespace panelgate::scan {
namespace {

constexpr unsigned kSearchRetries = 5;  // of a request with a damaged reply

}  // namespace

Scanner::State::State(const profile::Catalogue& catalogue, Settings s, TimePoint now)
    : profiles(catalogue),
      settings(std::move(s)),
      formats(likely_formats(profiles, settings)),
      stations(likely_stations(profiles, settings)),
      plan(formats, stations),
      started(now),
      format(formats.front()),
      not_before(now) {
    plan.add_high_first(profiles, settings, formats, stations);
    const std::vector<SerialFormat> ascii = ascii_formats(settings);
    plan.add(ascii, stations);
    formats.insert(formats.end(), ascii.begin(), ascii.end());
    if (!settings.remote) actions.emplace_back(SetFormat{format});
    result.remote = settings.remote;
    listen(now, settings.listen);
}

TimePoint Scanner::State::due() const { return attempt ? attempt->ends_at() : not_before; }

void Scanner::State::step(TimePoint now) {
    if (phase == Phase::listening) return end_listening(now);
    if (attempt) return finish_attempt();
    start_next(now);
}

/// The driver drops buffered bytes of the old format and needs time.
void Scanner::State::set_format(TimePoint now, const SerialFormat& wanted) {
    if (wanted == format) return;
    format = wanted;
    asked.reset();
    transcript.cut();
    if (settings.remote) return;  // only the encoding changes
    actions.emplace_back(SetFormat{format});
    not_before = now + settings.after_format;
}

void Scanner::State::start_next(TimePoint now) {
    if (phase == Phase::searching) {
        start_search(now);
    } else {
        start_asking(now);
    }
}

void Scanner::State::start_search(TimePoint now) {
    if (!again.empty()) {
        retry = again.front();
        again.pop_front();
        return ask(now, retry->station, settings.leave_timeout, Purpose::again);
    }
    if (!cell) cell = plan.next();
    if (!cell) {
        result.ending = Result::Ending::finished;
        phase = Phase::done;
        return;
    }
    if (cell->format != format)
        return set_format(now, cell->format);  // asked once the format is set
    const Duration timeout =
        plan.is_last_of_format() ? settings.leave_timeout : settings.search_timeout;
    orders.set(cell->station, cell->crc_order);
    ask(now, cell->station, timeout, Purpose::search);
    cell.reset();
}

void Scanner::State::start_asking(TimePoint now) {
    const auto take = [](std::deque<std::uint8_t>& queue) {
        const std::uint8_t station = queue.front();
        queue.pop_front();
        return station;
    };
    if (examination) {
        if (const auto next = examination->next()) return transmit(now, *next, Purpose::examine);
        result.stations.push_back(examination->finding());
        examination.reset();
    }
    if (!again.empty()) {
        retry = again.front();
        again.pop_front();
        return ask(now, retry->station, settings.second_timeout, Purpose::again);
    }
    if (!first_pass.empty()) {
        // Late replies are heard while others are asked; after the last one nobody is.
        const bool is_last = settings.quick && first_pass.size() == 1;
        return ask(now, take(first_pass),
                   is_last ? settings.second_timeout : settings.first_timeout, Purpose::first_pass);
    }
    if (!to_examine.empty()) {
        const std::uint8_t station = take(to_examine);
        examination = std::make_unique<Examination>(profiles, settings, station, known_format(),
                                                    orders.of(station));
        return;
    }
    if (!second_pass.empty())
        return ask(now, take(second_pass), settings.second_timeout, Purpose::second_pass);
    if (!high_first_pass.empty())
        return ask(now, take(high_first_pass), settings.first_timeout, Purpose::high_first_pass);
    result.ending = Result::Ending::finished;
    phase = Phase::done;
}

void Scanner::State::ask(TimePoint now, std::uint8_t station, Duration timeout, Purpose why) {
    const auto request = ReadRequest::make(station, first_request(), orders.of(station));
    if (request) transmit(now, {*request, {timeout, settings.quiet}}, why);
}

void Scanner::State::transmit(TimePoint now, const Ask& wanted, Purpose why) {
    ReplyTimeouts timeouts = wanted.timeouts;
    timeouts.start += latency;
    purpose = why;
    asked.set(wanted.request.station());
    attempt = std::make_unique<Attempt>(wanted.request, format, now, timeouts);
    transcript.cut();
    actions.emplace_back(Transmit{wanted.request, format.mode});
}

void Scanner::State::finish_attempt() {
    const Outcome outcome = attempt->finish();
    const std::uint8_t station = attempt->request().station();
    attempt.reset();
    if (purpose == Purpose::examine) {
        examination->on_outcome(outcome);
    } else {
        on_outcome(station, outcome);
    }
    for (const Frame& frame : outcome.unsolicited) on_unsolicited(frame);
}

void Scanner::State::on_outcome(std::uint8_t station, const Outcome& outcome) {
    switch (outcome.kind) {
        case Outcome::Kind::replied:
            other_evidence[station].twice += outcome.more;
            found(station);
            break;
        case Outcome::Kind::damaged:
            on_damaged(station, outcome.header_seen);
            break;
        case Outcome::Kind::silent:
            if (retry && retry->late) found(station);  // it was heard before
            queue_second_pass(station);
            break;
    }
    retry.reset();
}

/// Queues one more request with a longer timeout, after all other stations.
void Scanner::State::queue_second_pass(std::uint8_t station) {
    if (phase != Phase::asking || answered.contains(station) || settings.quick) return;
    if (waited_for[station]) return queue_high_first(station);
    waited_for.set(station);
    second_pass.push_back(station);
}

/// Queues a request with the CRC's high byte first, for a station silent so far.
void Scanner::State::queue_high_first(std::uint8_t station) {
    if (orders.of(station) == modbus::CrcOrder::high_first || !station_may_be_high_first(station))
        return;
    orders.set(station, modbus::CrcOrder::high_first);
    high_first_pass.push_back(station);
}

/// A station answers. Two at one address are readable now and then; a wrong parity never.
void Scanner::State::on_damaged(std::uint8_t station, bool header_seen) {
    Again next = retry.value_or(Again{station, 0, false, false});
    next.header_seen = next.header_seen || header_seen;
    if (++next.tries <= kSearchRetries) {
        again.push_back(next);
    } else if (phase == Phase::asking) {
        if (next.header_seen || next.late) found(station);
        queue_second_pass(station);
    } else {
        plan.hint({.format = format, .station = station});
        append_new(result.damaged_formats, format);
    }
}

/// Handles a valid frame that does not answer the last request: a late reply, a duplicate, or
/// another master's frame.
void Scanner::State::on_unsolicited(const Frame& frame) {
    if (examination && frame.station == examination->station() &&
        examination->on_unsolicited(frame))
        return;
    const bool ours = asked[frame.station] && modbus::answers(first_request(), frame.pdu);
    if (!ours) {
        add_frame(result.talk, frame);
        return;
    }
    Evidence& seen = other_evidence[frame.station];
    if (answered.contains(frame.station)) {
        ++(seen.late > 0 ? seen.late : seen.twice);
        return;
    }
    ++seen.late;
    orders.set(frame.station, frame.crc_order);
    const auto waits = [&](const Again& other) { return other.station == frame.station; };
    if (std::ranges::none_of(again, waits)) again.push_front({frame.station, 0, true, false});
    if (phase == Phase::searching) accept_format();
}

/// Accepts the current format as the line's and queues every station in it.
void Scanner::State::accept_format() {
    phase = Phase::asking;
    for (const std::uint8_t station : stations) {
        const auto waits = [&](const Again& other) { return other.station == station; };
        if (answered.contains(station) || std::ranges::any_of(again, waits)) continue;
        orders.set(station, modbus::CrcOrder::low_first);
        first_pass.push_back(station);
    }
}

void Scanner::State::found(std::uint8_t station) {
    if (!answered.insert(station).second) return;
    to_examine.push_back(station);
    std::erase(second_pass, station);
    std::erase(high_first_pass, station);
    if (phase == Phase::searching) accept_format();
}

std::optional<SerialFormat> Scanner::State::known_format() const {
    return settings.remote ? std::nullopt : std::optional(format);
}

bool Scanner::State::station_may_be_high_first(std::uint8_t station) const {
    if (format.mode == SerialMode::ascii) return false;
    return may_be_high_first(profiles, station, known_format());
}

void Scanner::State::receive(TimePoint now, ByteView bytes) {
    if (attempt) return attempt->on_rx(now, bytes);
    if (phase != Phase::listening) return;  // in the previous format
    append_up_to(kMaxHeard, heard, bytes);
}

Bytes on_wire(const Transmit& transmit) {
    const Bytes& adu = transmit.request.adu();
    return transmit.mode == SerialMode::ascii ? modbus::to_ascii(adu) : adu;
}

Scanner::Scanner(const profile::Catalogue& profiles, Settings settings, TimePoint now)
    : state_(std::make_unique<State>(profiles, std::move(settings), now)) {}
Scanner::~Scanner() = default;

void Scanner::on_rx(TimePoint now, ByteView bytes) {
    if (state_->format.mode == SerialMode::rtu) return state_->receive(now, bytes);
    state_->transcript.feed(now, bytes);
    while (const auto piece = state_->transcript.next()) state_->receive(now, piece->bytes);
}

void Scanner::on_deadline(TimePoint now) {
    while (!done() && state_->due() <= now) state_->step(now);
}

void Scanner::set_latency(Duration latency) { state_->latency = latency; }

std::optional<Action> Scanner::poll_action() {
    if (state_->actions.empty()) return std::nullopt;
    Action action = std::move(state_->actions.front());
    state_->actions.pop_front();
    return action;
}

std::optional<TimePoint> Scanner::next_deadline() const {
    return done() ? std::nullopt : std::optional(state_->due());
}

const std::vector<StationFinding>& Scanner::examined() const { return state_->result.stations; }

bool Scanner::done() const { return state_->phase == State::Phase::done; }

}  // namespace panelgate::scan
