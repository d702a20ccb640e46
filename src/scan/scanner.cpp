#include "panelgate/scan/scanner.hpp"

#include <algorithm>
#include <bitset>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include "attempt.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/response.hpp"
#include "recogniser.hpp"

namespace panelgate::scan {
namespace {

constexpr unsigned kSearchRetries = 5;   // of a request with a damaged reply
constexpr std::size_t kMaxGlitches = 2;  // bytes to be ignored
constexpr double kCollisionShare =
    0.25;  // share of replies: two panels that answer collide more often
constexpr double kNoise = 0.1;
constexpr double kDamageRatio = 3;  // factor to the damage elsewhere

double damaged_share(const Evidence& seen) {
    return seen.asked == 0 ? 0 : static_cast<double>(seen.damaged) / seen.asked;
}

/// Returns the damaged share of all other stations, without certain duplicates.
double damage_elsewhere(const Result& result, const StationFinding& finding) {
    Evidence all;
    for (const StationFinding& other : result.stations) {
        if (&other == &finding || other.evidence.twice > 0) continue;
        all.asked += other.evidence.asked;
        all.damaged += other.evidence.damaged;
    }
    return damaged_share(all);
}

/// Call when all stations are known: marks addresses shared by two stations, or the line as noisy.
/// Damage at one address among good ones is a collision, damage everywhere is noise.
void mark_duplicates(Result& result) {
    for (StationFinding& finding : result.stations) {
        const Evidence& seen = finding.evidence;
        const double share = damaged_share(seen);
        const double others = damage_elsewhere(result, finding);
        const bool collides =
            seen.damaged >= 2 && share >= kCollisionShare && share > kDamageRatio * others;
        finding.duplicate = seen.twice > 0 || seen.mixed || collides;
        if (!finding.duplicate && seen.damaged >= 2 && others >= kNoise) result.noisy = true;
    }
}

/// Adds a frame between another master and its stations.
void add_frame(Talk& talk, const Frame& frame) {
    talk[frame.station].insert(modbus::plain_function(frame.pdu[0]));
}

/// The far end's setting cannot be read: takes a format that all panels found support.
std::optional<SerialFormat> probable_format(const profile::Catalogue& profiles,
                                            const Result& result) {
    std::vector<const profile::PanelProfile*> panels;
    for (const StationFinding& finding : result.stations) {
        if (finding.candidates.empty()) continue;
        const auto* panel = profiles.find(finding.candidates.front().profile);
        if (panel != nullptr) panels.push_back(panel);
    }
    return common_format(profiles, panels);
}

template <class T>
T pop(std::deque<T>& queue) {
    T first = std::move(queue.front());
    queue.pop_front();
    return first;
}

}  // namespace

struct Scanner::State {
    enum class Phase : std::uint8_t { listening, searching, asking, done };
    /// A request that is sent again, after a late or a damaged reply.
    struct Again {
        std::uint8_t station = 0;
        unsigned tries = 0;
        bool late = false;
        bool header_seen = false;  ///< one of the damaged replies contained address and function
    };

    State(const profile::Catalogue& catalogue, Settings s, TimePoint now);

    void step(TimePoint now);
    TimePoint due() const { return attempt ? attempt->ends_at() : not_before; }
    void listen(TimePoint now, Duration how_long);
    void end_listening(TimePoint now);
    void set_format(TimePoint now, const SerialFormat& wanted);
    void start_next(TimePoint now);
    void ask(TimePoint now, std::uint8_t station, Duration timeout);
    void transmit(TimePoint now, const Ask& wanted);
    void finish_attempt();
    void on_outcome(std::uint8_t station, const Outcome& outcome);
    void on_damaged(std::uint8_t station, bool header_seen);
    void on_unsolicited(const Frame& frame);
    void accept_format();
    void found(std::uint8_t station);
    std::optional<SerialFormat> known_format() const {
        return settings.remote ? std::nullopt : std::optional(format);
    }
    /// Processes bytes received in this format, converted to RTU.
    void receive(TimePoint now, ByteView bytes);

    const profile::Catalogue& profiles;
    Settings settings;
    std::vector<SerialFormat> formats;  ///< to listen in
    std::deque<Turn> turns;
    Duration latency{};
    std::deque<Action> actions;  ///< at most a SetFormat and a Transmit

    Phase phase = Phase::listening;
    SerialFormat format;  ///< the line's current format
    TimePoint not_before;
    /// Bytes heard since the format was set, or a request was sent.
    modbus::AsciiTranscript transcript{modbus::HexDigits::any_case};

    std::size_t listening_at = 0;  ///< index into formats
    bool listened_again = false;
    Bytes heard;

    std::unique_ptr<Attempt> attempt;
    bool examines = false;       ///< `attempt` is of the examination
    std::optional<Again> retry;  ///< what `attempt` repeats

    std::bitset<256> asked;  ///< in this format
    std::set<std::uint8_t> answered;
    std::map<std::uint8_t, Evidence> other_evidence;  ///< seen outside of the examination
    std::deque<Again> again;
    modbus::CrcOrders orders;  ///< for the next request of each station
    std::deque<std::uint8_t> to_examine;
    std::unique_ptr<Examination> examination;
    Result result;
};

Scanner::State::State(const profile::Catalogue& catalogue, Settings s, TimePoint now)
    : profiles(catalogue),
      settings(std::move(s)),
      formats(likely_formats(profiles, settings)),
      turns(search_turns(profiles, settings)),
      format(formats.front()),
      not_before(now) {
    const std::vector<SerialFormat> ascii = ascii_formats(settings);
    formats.insert(formats.end(), ascii.begin(), ascii.end());
    if (!settings.remote) actions.emplace_back(SetFormat{format});
    result.remote = settings.remote;
    listen(now, settings.listen);
}

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

void Scanner::State::listen(TimePoint now, Duration how_long) {
    heard.clear();
    if (listening_at > 0) set_format(now, formats[listening_at]);
    not_before = std::max(not_before, now) + how_long;
}

/// Valid frames mean another master, unreadable bytes perhaps a master in another format. Silence
/// starts the search.
void Scanner::State::end_listening(TimePoint now) {
    const Heard parts = extract_frames(heard);
    for (const Frame& frame : parts.frames) add_frame(result.talk, frame);
    if (!result.talk.empty()) {
        result.format = format;
        if (listening_at > 0 && !std::exchange(listened_again, true)) {
            not_before = now + settings.listen;  // for other stations
            return;
        }
        if (settings.speak_anyway) return accept_format();
        result.ending = Result::Ending::another_master;
        phase = Phase::done;
        return;
    }
    const bool noise = parts.damaged > kMaxGlitches;
    if (noise) result.noise += static_cast<unsigned>(parts.damaged);
    const bool look_on = noise || listening_at > 0;
    if (look_on && listening_at + 1 < formats.size()) {
        ++listening_at;
        return listen(now, settings.listen_each);
    }
    phase = Phase::searching;
}

void Scanner::State::start_next(TimePoint now) {
    if (examination) {
        if (const auto next = examination->next()) {
            examines = true;
            return transmit(now, *next);
        }
        result.stations.push_back(examination->finding());
        examination.reset();
    }
    if (!again.empty()) {
        retry = pop(again);
        const bool known = phase == Phase::asking;
        return ask(now, retry->station, known ? settings.second_timeout : settings.leave_timeout);
    }
    while (!turns.empty() && answered.contains(turns.front().station)) turns.pop_front();
    if (!to_examine.empty() && (turns.empty() || !turns.front().hurried)) {
        const std::uint8_t station = pop(to_examine);
        examination = std::make_unique<Examination>(profiles, settings, station, known_format(),
                                                    orders.of(station));
        return;
    }
    if (turns.empty()) {
        result.ending = Result::Ending::finished;
        phase = Phase::done;
        return;
    }
    if (turns.front().format != format) return set_format(now, turns.front().format);
    const Turn turn = pop(turns);
    orders.set(turn.station, turn.crc_order);
    ask(now, turn.station, turn.timeout);
}

void Scanner::State::ask(TimePoint now, std::uint8_t station, Duration timeout) {
    examines = false;
    const auto request = ReadRequest::make(station, first_request(), orders.of(station));
    if (request) transmit(now, {*request, {timeout, settings.quiet}});
}

void Scanner::State::transmit(TimePoint now, const Ask& wanted) {
    ReplyTimeouts timeouts = wanted.timeouts;
    timeouts.start += latency;
    asked.set(wanted.request.station());
    attempt = std::make_unique<Attempt>(wanted.request, format, now, timeouts);
    transcript.cut();
    actions.emplace_back(Transmit{wanted.request, format.mode});
}

void Scanner::State::finish_attempt() {
    const Outcome outcome = attempt->finish();
    const std::uint8_t station = attempt->request().station();
    attempt.reset();
    examines ? examination->on_outcome(outcome) : on_outcome(station, outcome);
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
            break;
    }
    retry.reset();
}

/// A station answers. Two at one address are readable now and then; a wrong parity never.
void Scanner::State::on_damaged(std::uint8_t station, bool header_seen) {
    Again next = retry.value_or(Again{station, 0, false, false});
    next.header_seen = next.header_seen || header_seen;
    if (++next.tries <= kSearchRetries) {
        again.push_back(next);
    } else if (phase == Phase::searching) {
        append_new(result.damaged_formats, format);
    } else if (next.header_seen || next.late) {
        found(station);
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

/// Accepts the current format as the line's and asks every station in it.
void Scanner::State::accept_format() {
    phase = Phase::asking;
    turns = asking_turns(profiles, settings, format, known_format());
}

void Scanner::State::found(std::uint8_t station) {
    if (!answered.insert(station).second) return;
    to_examine.push_back(station);
    if (phase == Phase::searching) accept_format();
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

std::string Scanner::progress() const {
    const State& state = *state_;
    std::string text = std::to_string(state.answered.size()) + " found, " +
                       std::to_string(state.turns.size()) + " questions left at most: ";
    if (!state.settings.remote) text += to_string(state.format) + ", ";
    if (state.phase == State::Phase::listening) return text + "listening";
    if (state.examination)
        return text + "looking at station " + std::to_string(state.examination->station());
    if (!state.attempt) return text + "asking";
    return text + "station " + std::to_string(state.attempt->request().station());
}

Result Scanner::result() const {
    const State& state = *state_;
    Result result = state.result;
    if (state.examination) result.stations.push_back(state.examination->finding());
    for (const std::uint8_t station : state.to_examine) {
        StationFinding finding;
        finding.station = station;
        result.stations.push_back(std::move(finding));
    }
    for (StationFinding& finding : result.stations) {
        const auto seen = state.other_evidence.find(finding.station);
        if (seen == state.other_evidence.end()) continue;
        finding.evidence.twice += seen->second.twice;
        finding.evidence.late += seen->second.late;
    }
    if (!result.stations.empty() || !result.talk.empty()) {
        result.format =
            result.remote ? probable_format(state.profiles, result) : state.known_format();
        if (result.remote && result.format && state.format.mode == SerialMode::ascii) {
            const int baud = result.format->baud;  // manuals give nothing else for ASCII
            result.format = state.format;
            result.format->baud = baud;
        }
    }
    std::ranges::sort(result.stations, std::less(), &StationFinding::station);
    mark_duplicates(result);
    return result;
}

const std::vector<StationFinding>& Scanner::examined() const { return state_->result.stations; }

bool Scanner::done() const { return state_->phase == State::Phase::done; }

}  // namespace panelgate::scan
