#include "panelgate/sim/simulated_bus.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <utility>

#include "panelgate/line/pty.hpp"
#include "panelgate/line/termios_setup.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/sim/misbehaviour.hpp"

namespace panelgate::sim {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::size_t kMaxRequest = 520;  // the GT's 512 bytes, and some to detect more
constexpr std::size_t kMaxAsciiRequest = 2 * kMaxRequest + 1;
constexpr Duration kAsciiPause = 1s;  // the longest between two characters (SL 2.5.2.1)
constexpr Duration kTick = 1ms;       // granularity of reply bytes; the last one is exact

}  // namespace

struct SimulatedBus::State : std::enable_shared_from_this<SimulatedBus::State> {
    State(const asio::any_io_executor& executor, rt::Clock& c, Settings s, std::vector<Station> all)
        : settings(std::move(s)),
          stations(std::move(all)),
          pty(settings.serial),
          descriptor(executor),
          clock(c),
          alarm(clock.make_alarm()),
          chance(settings.seed) {
        descriptor.assign(::dup(pty.master()));
    }

    /// A reply that one panel will send; it hears nothing until then.
    struct PendingReply {
        std::uint8_t station = 0;
        TimePoint start;  ///< of the first start bit
        Spoken spoken;
    };

    void wait_readable();
    void read_all();
    void hear(TimePoint now, ByteView bytes);
    void arm();
    void on_alarm();
    TimePoint request_over() const;
    void request_ended();
    Bytes received_adu(Bytes wire) const;
    bool has_pending_reply(std::uint8_t station) const;
    Bytes reply_to(ByteView adu);
    void think(std::uint8_t station, Spoken spoken);
    void begin(PendingReply pending_reply);
    TimePoint end_of(std::size_t byte) const;
    TimePoint next_look() const;
    void play(TimePoint until);
    void send(TimePoint until);

    Settings settings;
    std::vector<Station> stations;
    line::Pty pty;  ///< its default format is this line's
    asio::posix::stream_descriptor descriptor;
    rt::Clock& clock;
    std::unique_ptr<rt::Alarm> alarm;
    Bytes request;
    TimePoint request_start;    ///< wire time of its first bit
    TimePoint request_end;      ///< ... and of its last
    Duration longest_pause{};   ///< longest gap inside it
    bool wrong_format = false;  ///< part of it came at another rate
    bool collided = false;      ///< a panel sent meanwhile
    std::mt19937 chance;
    std::vector<PendingReply> pending_replies;  ///< at most one per station
    Bytes reply;                                ///< on the wire
    std::vector<std::uint32_t> ends;            ///< of its bytes, in bit times
    std::size_t sent = 0;
    TimePoint reply_start;
    TimePoint last_step;
    bool stopped = false;
};

void SimulatedBus::State::wait_readable() {
    descriptor.async_wait(asio::posix::stream_descriptor::wait_read,
                          [self = shared_from_this()](error_code error) {
                              if (error || self->stopped) return;
                              self->read_all();
                              self->wait_readable();
                          });
}

void SimulatedBus::State::read_all() {
    std::array<std::uint8_t, 1024> buffer;
    const ssize_t n = ::read(descriptor.native_handle(), buffer.data(), buffer.size());
    if (n > 0) hear(clock.now(), ByteView(buffer).first(static_cast<std::size_t>(n)));
}

void SimulatedBus::State::hear(TimePoint now, ByteView bytes) {
    play(now);
    const auto colon = std::find(bytes.rbegin(), bytes.rend(), ':');
    if (settings.serial.mode == SerialMode::ascii && colon != bytes.rend()) {  // a new frame
        request.clear();
        bytes = bytes.last(static_cast<std::size_t>(colon - bytes.rbegin()) + 1);
    }
    const bool first = request.empty();
    if (first) request_start = now;
    collided = (!first && collided) || !reply.empty();
    wrong_format = (!first && wrong_format) || !line::tty_speaks(pty.master(), settings.serial);
    longest_pause = first ? Duration::zero() : std::max(longest_pause, now - request_end);
    request_end =
        (first ? now : std::max(now, request_end)) + wire_time(settings.serial, bytes.size());
    const bool ascii = settings.serial.mode == SerialMode::ascii;
    append_up_to(ascii ? kMaxAsciiRequest : kMaxRequest, request, bytes);
    arm();
}

/// Arms the alarm for the next event on the wire: a request's end, a reply's beginning, its bytes.
void SimulatedBus::State::arm() {
    TimePoint next = TimePoint::max();
    if (!request.empty()) next = std::min(next, request_over());
    if (!reply.empty()) next = std::min(next, next_look());
    for (const PendingReply& pending_reply : pending_replies)
        next = std::min(next, pending_reply.start);
    if (next == TimePoint::max()) return alarm->cancel();
    alarm->arm(next, [this] { on_alarm(); });
}

void SimulatedBus::State::on_alarm() {
    const TimePoint now = clock.now();
    if (!request.empty() && request_over() <= now) {
        play(request_over());
        request_ended();
    }
    play(now);
    arm();
}

/// Plays the replies of the panels up to `until`.
void SimulatedBus::State::play(TimePoint until) {
    for (;;) {
        const auto first = std::ranges::min_element(pending_replies, {}, &PendingReply::start);
        if (first == pending_replies.end() || first->start > until) break;
        PendingReply pending_reply = std::move(*first);
        pending_replies.erase(first);
        send(pending_reply.start);
        begin(std::move(pending_reply));
    }
    send(until);
}

/// An RTU frame ends by silence, an ASCII frame with its last character.
TimePoint SimulatedBus::State::request_over() const {
    const bool open = settings.serial.mode == SerialMode::ascii && request.back() != '\n';
    return request_end + (open ? kAsciiPause : silent_interval(settings.serial));
}

/// Returns the request as an RTU frame; in ASCII the last frame, or empty.
Bytes SimulatedBus::State::received_adu(Bytes wire) const {
    if (settings.serial.mode == SerialMode::rtu) return wire;
    modbus::AsciiTranscript transcript(modbus::HexDigits::upper_only);
    transcript.feed(request_end, wire);
    Bytes open;
    Bytes frame;
    while (const auto piece = transcript.next()) {
        open.insert(open.end(), piece->bytes.begin(), piece->bytes.end());
        if (piece->end == modbus::AsciiTranscript::Piece::End::none) continue;
        frame = std::exchange(open, {});
        if (piece->end != modbus::AsciiTranscript::Piece::End::frame) frame.clear();
    }
    return frame;
}

void SimulatedBus::State::request_ended() {
    Bytes wire = std::exchange(request, {});
    if (collided) return;  // no panel understands it
    if (settings.echo && ::write(descriptor.native_handle(), wire.data(), wire.size()) < 0) return;
    if (wrong_format) return;
    const Bytes adu = received_adu(std::move(wire));
    const std::uint8_t station = adu.empty() ? 0 : adu[0];
    const auto found = settings.faults.find(station);
    const Misbehaviour faults = found == settings.faults.end() ? Misbehaviour{} : found->second;
    think(station, misbehave(faults, reply_to(adu), chance, settings.serial));
}

bool SimulatedBus::State::has_pending_reply(std::uint8_t station) const {
    return std::ranges::find(pending_replies, station, &PendingReply::station) !=
           pending_replies.end();
}

void SimulatedBus::State::think(std::uint8_t station, Spoken spoken) {
    if (spoken.adu.empty()) return;
    const auto bits = static_cast<std::uint32_t>(settings.serial.bits_per_character());
    for (auto i = static_cast<std::uint32_t>(spoken.ends.size()); i < spoken.adu.size(); ++i)
        spoken.ends.push_back((i + 1) * bits);
    const TimePoint start =
        request_end + silent_interval(settings.serial) + settings.think_time + spoken.delay;
    pending_replies.push_back({station, start, std::move(spoken)});
}

/// A panel sends whether the wire is free or not: over another reply, both are damaged.
void SimulatedBus::State::begin(PendingReply pending_reply) {
    if (!request.empty() && pending_reply.start < request_end) collided = true;
    if (!reply.empty()) {
        const auto bit = Duration(1s) / settings.serial.baud;
        const TimePoint rest = sent == 0 ? reply_start : end_of(sent - 1);
        const auto later = static_cast<std::size_t>(
            std::max<Duration::rep>((pending_reply.start - rest) / bit, 0));
        HeardBytes heard = collide(ByteView(reply).subspan(sent), pending_reply.spoken.adu, later,
                                   settings.serial);
        pending_reply = {
            pending_reply.station, rest, {std::move(heard.bytes), {}, std::move(heard.ends)}};
    }
    reply = std::move(pending_reply.spoken.adu);
    ends = std::move(pending_reply.spoken.ends);
    reply_start = pending_reply.start;
    last_step = pending_reply.start;
    sent = 0;
}

TimePoint SimulatedBus::State::end_of(std::size_t byte) const {
    return reply_start + Duration(1s) * ends[byte] / settings.serial.baud;
}

TimePoint SimulatedBus::State::next_look() const {
    return std::min(end_of(reply.size() - 1), std::max(last_step + kTick, end_of(sent)));
}

/// Returns an empty reply for damage, a broadcast, or an address without a panel.
Bytes SimulatedBus::State::reply_to(ByteView adu) {
    if (adu.size() < modbus::kMinAdu) return {};
    const ByteView pdu = modbus::pdu_of(adu);
    const TimePoint now = clock.now();
    const std::int64_t wall = rt::local_wall_seconds();
    Bytes answer;
    for (Station& station : stations) {
        const auto faults = settings.faults.find(station.id());
        const bool dead = faults != settings.faults.end() && faults->second.dead;
        const modbus::CrcOrder order = settings.crc_orders.of(station.id());
        if (dead || has_pending_reply(station.id()) ||
            station.rejects_gap(longest_pause, settings.serial) || !modbus::crc_ok(adu, order))
            continue;
        if (adu[0] == 0) station.broadcast(now, wall, pdu);
        if (adu[0] == station.id())
            answer = modbus::encode_adu(station.id(), station.handle(now, wall, pdu), order);
    }
    return answer;
}

/// Delivers the bytes that are due, except those that came while the master was sending.
void SimulatedBus::State::send(TimePoint until) {
    last_step = until;
    Bytes due;
    for (; sent < reply.size() && end_of(sent) <= until; ++sent) {
        if (end_of(sent) > request_start && end_of(sent) <= request_end) {
            collided = true;
        } else {
            due.push_back(reply[sent]);
        }
    }
    const bool nobody_reads = !due.empty() &&
                              ::write(descriptor.native_handle(), due.data(), due.size()) < 0 &&
                              errno == EAGAIN;  // a real line would not wait either
    if (sent == reply.size() || nobody_reads) reply.clear();
}

SimulatedBus::SimulatedBus(asio::any_io_executor executor, rt::Clock& clock, Settings settings,
                           std::vector<Station> stations)
    : state_(std::make_shared<State>(executor, clock, settings, std::move(stations))) {}

SimulatedBus::~SimulatedBus() { stop(); }

const std::string& SimulatedBus::device() const { return state_->pty.path(); }

bool SimulatedBus::has(std::uint8_t station) const {
    return std::ranges::find(state_->stations, station, &Station::id) != state_->stations.end();
}

void SimulatedBus::set_faults(std::uint8_t station, const Misbehaviour& faults) {
    state_->settings.faults[station] = faults;
}

Misbehaviour SimulatedBus::faults(std::uint8_t station) const {
    const auto found = state_->settings.faults.find(station);
    return found == state_->settings.faults.end() ? Misbehaviour{} : found->second;
}

void SimulatedBus::start() { state_->wait_readable(); }

void SimulatedBus::stop() {
    state_->stopped = true;
    state_->alarm->cancel();
    error_code ignored;
    state_->descriptor.close(ignored);
}

}  // namespace panelgate::sim
