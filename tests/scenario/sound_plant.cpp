#include "sound_plant.hpp"

#include <algorithm>
#include <list>
#include <map>
#include <memory>

#include "agenda.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "sound_gateway.hpp"
#include "sound_panel.hpp"

namespace panelgate::scenario {
namespace {

constexpr int kBauds[] = {9600, 19200, 38400, 115200};
constexpr double kWrites[] = {0, 0.1, 0.3};

std::vector<Sound> draw_kinds(Random& random, bool instant) {
    constexpr unsigned kAlive = kSounds.size() - 1;
    std::vector<Sound> kinds;
    for (unsigned left = random.between(1, 6); left > 0; --left) {
        Sound kind = kSounds[random.below(kinds.empty() ? kAlive : kAlive + 1)];
        if (instant && random.chance(0.5)) kind = Sound::quick;
        kinds.push_back(kind);
    }
    // Only an unanswered request of another panel disturbs a panel of libmodbus.
    const bool disturbed = std::ranges::find(kinds, Sound::libmodbus) != kinds.end();
    if (disturbed && random.chance(0.5)) kinds.push_back(Sound::dead);
    return kinds;
}

SoundPanel draw_panel(Random& random, std::uint8_t id, Sound kind) {
    SoundPanel panel;
    panel.id = id;
    panel.kind = kind;
    panel.values = panel.kind <= Sound::moving ? panel.kind : kSounds[random.below(3)];
    if (panel.kind == Sound::pausing && random.chance(0.5)) panel.values = Sound::equal;
    panel.least_think = random.between(2ms, Duration(30ms));
    panel.most_think = panel.least_think * 5 / 4;
    if (panel.kind == Sound::quick) {
        panel.least_think = 0ms;
        panel.most_think = random.chance(0.5) ? 0ms : 1ms;
    }
    if (panel.kind == Sound::slow) {
        panel.most_think = random.between(100ms, Duration(400ms));
        panel.least_think = random.chance(0.5) ? panel.most_think * 9 / 10 : Duration(20ms);
    }
    if (panel.kind == Sound::pausing) panel.deaf = random.between(30ms, Duration(100ms));
    return panel;
}

SoundClient draw_client(Random& random, std::vector<std::uint8_t> stations, Sound kind) {
    SoundClient client{.stations = std::move(stations)};
    client.least_pause = random.between(20ms, Duration(500ms));
    if (kind == Sound::pausing) client.least_pause = random.between(300ms, Duration(500ms));
    if (kind == Sound::dead) client.least_pause = random.between(1s, Duration(1500ms));
    client.most_pause = client.least_pause * 2;
    client.writes = kWrites[random.below(std::size(kWrites))];
    return client;
}

/// A plain gateway does not wait for the end of a panel's pause: the only client of a pausing panel
/// leaves the pause. A refusing panel has one client, too: a refused joined read is split.
bool has_one_client(const SoundPanel& panel) {
    return panel.kind == Sound::pausing || panel.kind == Sound::refusing;
}

}  // namespace

std::string_view label(Sound kind) {
    constexpr std::array<std::string_view, kSounds.size()> kWords{
        "equal",   "constant",  "moving",    "quick",    "slow",
        "pausing", "libmodbus", "resetting", "refusing", "dead"};
    return kWords[static_cast<std::size_t>(kind)];
}

SoundPlant draw_sound(std::uint64_t seed) {
    Random random(seed * 0x50D);
    SoundPlant plant;
    plant.seed = seed;
    plant.instant = random.chance(0.3);
    plant.latency = random.between(100us, Duration(1ms));
    plant.settings.serial = {.baud = plant.instant ? 9600 : kBauds[random.below(4)],
                             .parity = Parity::none};
    plant.settings.paced = !plant.instant && random.chance(0.5);
    plant.settings.may_stall = plant.instant;
    plant.settings.queue.deadline = 10s;  // a plain gateway has no deadline
    std::vector<std::uint8_t> round;
    for (const Sound kind : draw_kinds(random, plant.instant)) {
        const auto id = static_cast<std::uint8_t>(plant.panels.size() + 1);
        const SoundPanel& panel = plant.panels.emplace_back(draw_panel(random, id, kind));
        arbiter::StationSettings& station = plant.settings.stations.emplace_back();
        station.id = id;
        plant.clients.push_back(draw_client(random, {id}, panel.kind));
        if (has_one_client(panel)) continue;
        round.push_back(id);
        if (panel.kind != Sound::dead && random.chance(0.3))
            plant.clients.push_back(draw_client(random, {id}, panel.kind));
    }
    if (round.size() > 1 && random.chance(0.3))
        plant.clients.push_back(draw_client(random, round, Sound::constant));
    return plant;
}

void SoundCount::add(const SoundCount& more) {
    requests += more.requests;
    answered += more.answered;
    alone += more.alone;
    frames += more.frames;
    wrong += more.wrong;
    offline += more.offline;
}

double SoundCount::share() const {
    return requests == 0 ? 1 : static_cast<double>(answered) / static_cast<double>(requests);
}

double SoundCount::asked() const {
    return alone == 0 ? 1 : static_cast<double>(frames) / static_cast<double>(alone);
}

namespace {

/// One plant with one gateway in virtual time.
class SoundWorld {
  public:
    SoundWorld(const SoundPlant& plant, SoundGateway gateway, Duration length, bool with_history);
    SoundOutcome run();

  private:
    struct Client {
        Client(const SoundPlant& plant, std::size_t index);
        const SoundClient& plan;
        Random random;
        std::size_t index;
        std::vector<Bytes> questions;  ///< reads that the client asks in turn
        unsigned turn = 0;
        Bytes next(const SoundPanel& panel);
        Bytes write(const SoundPanel& panel);
    };
    struct Open {
        std::size_t client = 0;
        SoundRequest request;
        std::size_t since = 0;  ///< count of requests that the panel had served
    };
    /// Bytes on the half-duplex wire.
    struct Frame {
        TimePoint end;
        bool collided = false;
    };

    bool step();
    void ask(Client& client);
    void finish(std::uint64_t number, const std::optional<Bytes>& reply, bool alone);
    void transmit(const Bytes& adu);
    void heard_by_panels(const Bytes& adu, TimePoint start);
    void answer(PanelOfPlant& panel, const Bytes& pdu);
    void say(const Bytes& adu);
    void deliver(const Bytes& piece, const std::shared_ptr<Frame>& frame);
    std::shared_ptr<Frame> put(Duration length);
    void reconnect();
    SoundMaster::Callbacks callbacks();
    PanelOfPlant& panel_of(std::uint8_t station) { return panels_.at(station - 1u); }
    SoundCount& count_of(std::uint8_t station) {
        return outcome_.tally[static_cast<std::size_t>(panel_of(station).kind())];
    }
    TimePoint now() const { return agenda_.now(); }
    Duration wire_time_of(std::size_t bytes) const {
        return plant_.instant ? plant_.latency : wire_time(plant_.settings.serial, bytes);
    }

    const SoundPlant& plant_;
    Agenda agenda_;
    TimePoint end_;
    SoundOutcome outcome_;
    std::vector<PanelOfPlant> panels_;
    std::vector<Client> clients_;
    std::unique_ptr<SoundMaster> master_;
    std::map<std::uint64_t, Open> open_;
    std::uint64_t last_number_ = 0;
    std::shared_ptr<Frame> on_wire_;
    unsigned connection_ = 1;
    bool up_ = true;
    int spins_ = 0;  ///< deadlines in a row that did not move time
};

SoundWorld::Client::Client(const SoundPlant& plant, std::size_t number)
    : plan(plant.clients[number]),
      random(plant.seed * 1000 + number),
      index(number),
      questions(draw_questions(random, number)) {}

Bytes SoundWorld::Client::next(const SoundPanel& panel) {
    ++turn;
    return random.chance(plan.writes) ? write(panel) : questions[turn % questions.size()];
}

/// Each client writes places of its own. A panel of equal values is written the same setpoint again
/// and again.
Bytes SoundWorld::Client::write(const SoundPanel& panel) {
    if (panel.kind == Sound::resetting && random.chance(0.5))
        return Writer().u8(6).u16(kCommand).u16(1).take();
    const auto place = static_cast<std::uint16_t>(kMemory + 2 * index);
    const unsigned value = panel.values == Sound::moving ? turn : 0;
    if (random.chance(0.5)) return Writer().u8(6).u16(place).u16(value).take();
    return Writer().u8(16).u16(place).u16(2).u8(4).u16(value).u16(value).take();
}

SoundWorld::SoundWorld(const SoundPlant& plant, SoundGateway gateway, Duration length,
                       bool with_history)
    : plant_(plant), end_(agenda_.now() + length) {
    if (with_history) agenda_.keep_history();
    for (const SoundPanel& panel : plant.panels) panels_.emplace_back(panel, plant.seed);
    for (std::size_t i = 0; i < plant.clients.size(); ++i) clients_.emplace_back(plant, i);
    if (gateway == SoundGateway::plain)
        master_ = std::make_unique<PlainMaster>(plant.settings, callbacks());
    else
        master_ = std::make_unique<PanelgateMaster>(plant.settings, callbacks());
}

SoundMaster::Callbacks SoundWorld::callbacks() {
    return {.transmit = [this](const Bytes& adu) { transmit(adu); },
            .finish = [this](std::uint64_t number, const std::optional<Bytes>& reply,
                             bool alone) { finish(number, reply, alone); },
            .offline =
                [this](std::uint8_t station) {
                    if (station > 0 && station <= panels_.size()) ++count_of(station).offline;
                },
            .reset = [this] { agenda_.at(now(), [this] { reconnect(); }); },
            .tell = [this](std::string_view what, ByteView bytes) { agenda_.tell(what, bytes); }};
}

SoundOutcome SoundWorld::run() {
    master_->on_line_up(now());
    for (Client& client : clients_)
        agenda_.at(now() + client.random.between(100ms, Duration(1s)),
                   [this, &client] { ask(client); });
    while (step()) {
    }
    outcome_.history = agenda_.history();
    return std::move(outcome_);
}

/// One event, or one deadline of the gateway. False when every request has an answer.
bool SoundWorld::step() {
    constexpr int kMostSpins = 1000;
    const auto next = agenda_.next();
    if (!next && open_.empty()) return false;
    const auto deadline = master_->next_deadline();
    if (deadline && (!next || *deadline < *next)) {
        spins_ = *deadline > now() ? 0 : spins_ + 1;
        agenda_.advance_to(*deadline);
        master_->on_deadline(now());
        return spins_ < kMostSpins;
    }
    if (!next) return false;
    spins_ = 0;
    agenda_.happen_next();
    return true;
}

void SoundWorld::ask(Client& client) {
    if (now() >= end_) return;
    const std::uint8_t station = client.plan.stations[client.turn % client.plan.stations.size()];
    SoundRequest request{++last_number_, client.index + 1, station,
                         client.next(panel_of(station).plan())};
    ++count_of(station).requests;
    agenda_.tell("client " + std::to_string(client.index) + " asks " + std::to_string(station),
                 request.pdu);
    open_[request.number] = {client.index, request, panel_of(station).served()};
    master_->submit(now(), std::move(request));
}

void SoundWorld::finish(std::uint64_t number, const std::optional<Bytes>& reply, bool alone) {
    const Open open = open_.at(number);
    open_.erase(number);
    Client& client = clients_[open.client];
    agenda_.tell("answer to client " + std::to_string(open.client) + (reply ? "" : ": none"),
                 reply.value_or(Bytes{}));
    SoundCount& count = count_of(open.request.station);
    if (alone) ++count.alone;
    if (reply) {
        ++count.answered;
        const PanelOfPlant& panel = panel_of(open.request.station);
        if (!panel.has_said(open.request.pdu, *reply, open.since)) {
            agenda_.tell("WRONG", *reply);
            ++count.wrong;
        }
    }
    const Duration pause = client.random.between(client.plan.least_pause, client.plan.most_pause);
    agenda_.at(now() + pause, [this, &client] { ask(client); });
}

/// A frame begins now. A frame that is still on the wire is damaged, and damages the new frame.
std::shared_ptr<SoundWorld::Frame> SoundWorld::put(Duration length) {
    const auto frame = std::make_shared<Frame>(Frame{now() + length});
    if (!plant_.instant && on_wire_ && on_wire_->end > now()) {
        agenda_.tell("collision");
        on_wire_->collided = frame->collided = true;
    }
    on_wire_ = frame;
    return frame;
}

void SoundWorld::transmit(const Bytes& adu) {
    if (adu[0] > 0 && adu[0] <= panels_.size()) ++count_of(adu[0]).frames;
    agenda_.tell("sent", adu);
    const auto frame = put(wire_time_of(adu.size()));
    const TimePoint start = plant_.instant ? frame->end : now();
    agenda_.at(frame->end, [this, adu, frame, start] {
        if (!frame->collided) heard_by_panels(adu, start);
    });
}

void SoundWorld::heard_by_panels(const Bytes& adu, TimePoint start) {
    for (PanelOfPlant& panel : panels_) {
        if (!panel.hears_request(adu, start, now())) continue;
        const Bytes pdu(adu.begin() + 1, adu.end() - 2);
        agenda_.at(now() + panel.think(), [this, &panel, pdu, connection = connection_] {
            if (connection == connection_) return answer(panel, pdu);
            panel.forget();
        });
    }
}

void SoundWorld::answer(PanelOfPlant& panel, const Bytes& pdu) {
    const Bytes adu = modbus::encode_adu(panel.plan().id, panel.serve(pdu));
    panel.replies_until(now() + wire_time_of(adu.size()));
    for (PanelOfPlant& other : panels_) other.hears_reply(now());
    say(adu);
}

/// A reply comes in pieces, as an adapter hands them over, or from a device server at once.
void SoundWorld::say(const Bytes& adu) {
    constexpr std::size_t kPiece = 8;
    const auto frame = put(wire_time_of(adu.size()));
    const std::size_t piece = plant_.instant ? adu.size() : kPiece;
    for (std::size_t from = 0; from < adu.size(); from += piece) {
        const std::size_t to = std::min(from + piece, adu.size());
        const Bytes part(adu.begin() + static_cast<std::ptrdiff_t>(from),
                         adu.begin() + static_cast<std::ptrdiff_t>(to));
        agenda_.at(now() + wire_time_of(to), [this, part, frame, connection = connection_] {
            if (up_ && connection == connection_) deliver(part, frame);
        });
    }
}

void SoundWorld::deliver(const Bytes& piece, const std::shared_ptr<Frame>& frame) {
    Bytes bytes = piece;
    if (frame->collided) bytes.front() ^= 0x5A;
    agenda_.tell("heard", bytes);
    master_->on_rx(now(), bytes);
}

void SoundWorld::reconnect() {
    if (!up_) return;
    constexpr Duration kConnecting = 5ms;
    ++connection_;
    up_ = false;
    master_->on_line_down(now());
    agenda_.at(now() + kConnecting, [this] {
        up_ = true;
        master_->on_line_up(now());
    });
}

}  // namespace

SoundOutcome play_sound(const SoundPlant& plant, SoundGateway gateway, Duration length,
                        bool with_history) {
    return SoundWorld(plant, gateway, length, with_history).run();
}

}  // namespace panelgate::scenario
