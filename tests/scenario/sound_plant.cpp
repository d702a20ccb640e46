#include "sound_plant.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <variant>

#include "agenda.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "sound_panel.hpp"
#include "support/request.hpp"

namespace panelgate::sound {
namespace {

constexpr int kBauds[] = {9600, 19200, 38400, 115200};
constexpr double kWrites[] = {0, 0.1, 0.3};

std::vector<Kind> draw_kinds(Random& random, bool instant) {
    constexpr unsigned kAlive = kKinds.size() - 1;
    std::vector<Kind> kinds;
    for (unsigned left = random.between(1, 6); left > 0; --left) {
        Kind kind = kKinds[random.below(kinds.empty() ? kAlive : kAlive + 1)];
        if (instant && random.chance(0.5)) kind = Kind::quick;
        kinds.push_back(kind);
    }
    // Only an unanswered request of another panel disturbs a panel of libmodbus.
    const bool disturbed = std::ranges::find(kinds, Kind::libmodbus) != kinds.end();
    if (disturbed && random.chance(0.5)) kinds.push_back(Kind::dead);
    return kinds;
}

PanelPlan draw_panel(Random& random, std::uint8_t id, Kind kind) {
    PanelPlan panel;
    panel.id = id;
    panel.kind = kind;
    panel.values = panel.kind <= Kind::moving ? panel.kind : kKinds[random.below(3)];
    if (panel.kind == Kind::pausing && random.chance(0.5)) panel.values = Kind::equal;
    panel.least_think = random.between(2ms, Duration(30ms));
    panel.most_think = panel.least_think * 5 / 4;
    if (panel.kind == Kind::quick) {
        panel.least_think = 0ms;
        panel.most_think = random.chance(0.5) ? 0ms : 1ms;
    }
    if (panel.kind == Kind::slow) {
        panel.most_think = random.between(100ms, Duration(400ms));
        panel.least_think = random.chance(0.5) ? panel.most_think * 9 / 10 : Duration(20ms);
    }
    if (panel.kind == Kind::pausing) panel.deaf = random.between(30ms, Duration(100ms));
    return panel;
}

ClientPlan draw_client(Random& random, std::vector<std::uint8_t> stations, Kind kind) {
    ClientPlan client{.stations = std::move(stations)};
    client.least_pause = random.between(20ms, Duration(500ms));
    if (kind == Kind::pausing) client.least_pause = random.between(300ms, Duration(500ms));
    if (kind == Kind::dead) client.least_pause = random.between(1s, Duration(1500ms));
    client.most_pause = client.least_pause * 2;
    client.writes = kWrites[random.below(std::size(kWrites))];
    return client;
}

/// A plain gateway does not wait for the end of a panel's pause: the only client of a pausing panel
/// leaves the pause. A refusing panel has one client, too: a refused joined read is split.
bool has_one_client(const PanelPlan& panel) {
    return panel.kind == Kind::pausing || panel.kind == Kind::refusing;
}

}  // namespace

std::string_view label(Kind kind) {
    constexpr std::array<std::string_view, kKinds.size()> kWords{
        "equal",   "constant",  "moving",    "quick",    "slow",
        "pausing", "libmodbus", "resetting", "refusing", "dead"};
    return kWords[static_cast<std::size_t>(kind)];
}

Plant draw(std::uint64_t seed) {
    Random random(seed * 0x50D);
    Plant plant;
    plant.seed = seed;
    plant.instant = random.chance(0.3);
    plant.latency = random.between(100us, Duration(1ms));
    plant.settings.serial = {.baud = plant.instant ? 9600 : kBauds[random.below(4)],
                             .parity = Parity::none};
    plant.settings.paced = !plant.instant && random.chance(0.5);
    plant.settings.may_stall = plant.instant;
    plant.settings.queue.deadline = 10s;  // a plain gateway has no deadline
    std::vector<std::uint8_t> round;
    for (const Kind kind : draw_kinds(random, plant.instant)) {
        const auto id = static_cast<std::uint8_t>(plant.panels.size() + 1);
        const PanelPlan& panel = plant.panels.emplace_back(draw_panel(random, id, kind));
        arbiter::StationSettings& station = plant.settings.stations.emplace_back();
        station.id = id;
        plant.clients.push_back(draw_client(random, {id}, panel.kind));
        if (has_one_client(panel)) continue;
        round.push_back(id);
        if (panel.kind != Kind::dead && random.chance(0.3))
            plant.clients.push_back(draw_client(random, {id}, panel.kind));
    }
    if (round.size() > 1 && random.chance(0.3))
        plant.clients.push_back(draw_client(random, round, Kind::constant));
    return plant;
}

void Count::add(const Count& more) {
    requests += more.requests;
    answered += more.answered;
    alone += more.alone;
    frames += more.frames;
    wrong += more.wrong;
    offline += more.offline;
}

double Count::share() const {
    return requests == 0 ? 1 : static_cast<double>(answered) / static_cast<double>(requests);
}

double Count::asked() const {
    return alone == 0 ? 1 : static_cast<double>(frames) / static_cast<double>(alone);
}

namespace {

/// A client asks the stations of its plan in turn, one request at a time.
struct Client {
    Client(const Plant& plant, std::size_t number)
        : plan(plant.clients[number]),
          random(plant.seed * 1000 + number),
          index(number),
          questions(draw_questions(random, number)) {}
    std::uint8_t station() const { return plan.stations[turn % plan.stations.size()]; }
    Bytes next(const PanelPlan& panel);
    Bytes write(const PanelPlan& panel);

    const ClientPlan& plan;
    Random random;
    std::size_t index;
    std::vector<Bytes> questions;  ///< reads that the client asks in turn
    unsigned turn = 0;
};

Bytes Client::next(const PanelPlan& panel) {
    ++turn;
    return random.chance(plan.writes) ? write(panel) : questions[turn % questions.size()];
}

/// Each client writes places of its own. A panel of equal values is written the same setpoint again
/// and again.
Bytes Client::write(const PanelPlan& panel) {
    if (panel.kind == Kind::resetting && random.chance(0.5))
        return Writer().u8(6).u16(kCommand).u16(1).take();
    const auto place = static_cast<std::uint16_t>(kMemory + 2 * index);
    const unsigned value = panel.values == Kind::moving ? turn : 0;
    if (random.chance(0.5)) return Writer().u8(6).u16(place).u16(value).take();
    return Writer().u8(16).u16(place).u16(2).u8(4).u16(value).u16(value).take();
}

/// One plant with one gateway in virtual time.
class World {
  public:
    World(const Plant& plant, scenario::Subject& gateway, Duration length, bool with_history);
    Outcome run();

  private:
    struct Open {
        Client& client;
        std::uint8_t station;
        Bytes pdu;
        std::size_t since;  ///< count of requests that the panel had served
    };
    /// Bytes on the half-duplex wire.
    struct Frame {
        TimePoint end;
        bool collided = false;
    };

    bool step();
    void ask(Client& client);
    void ask_again(Client& client);
    void drain();
    void act(const arbiter::Transmit& transmit);
    void act(const arbiter::Finish& finish);
    void act(const arbiter::StationEvent& event);
    void act(const arbiter::Note& note) { agenda_.tell(label(note.kind), note.bytes); }
    void act(const arbiter::Reset& reset);
    void act(const arbiter::Decision&) {}
    void act(const arbiter::Written&) {}
    void act(const arbiter::Exchange&) {}
    void heard_by_panels(const Bytes& adu, TimePoint start);
    void answer(Panel& panel, const Bytes& pdu);
    void say(const Bytes& adu);
    void deliver(Bytes piece, const Frame& frame);
    std::shared_ptr<Frame> put(Duration length);
    void reconnect();
    Panel& panel_of(std::uint8_t station) { return panels_.at(station - 1u); }
    Count& count_of(std::uint8_t station) {
        return outcome_.tally[static_cast<std::size_t>(panel_of(station).kind())];
    }
    TimePoint now() const { return agenda_.now(); }
    Duration wire_time_of(std::size_t bytes) const {
        return plant_.instant ? plant_.latency : wire_time(plant_.settings.serial, bytes);
    }

    const Plant& plant_;
    scenario::Subject& gateway_;
    scenario::Agenda agenda_;
    TimePoint end_;
    Outcome outcome_;
    std::vector<Panel> panels_;
    std::vector<Client> clients_;
    std::map<arbiter::Ticket, Open> open_;
    std::shared_ptr<Frame> on_wire_;
    unsigned connection_ = 1;
    bool up_ = true;
    int spins_ = 0;  ///< deadlines in a row that did not move time
};

World::World(const Plant& plant, scenario::Subject& gateway, Duration length, bool with_history)
    : plant_(plant), gateway_(gateway), end_(agenda_.now() + length) {
    if (with_history) agenda_.keep_history();
    for (const PanelPlan& panel : plant.panels) panels_.emplace_back(panel, plant.seed);
    for (std::size_t i = 0; i < plant.clients.size(); ++i) clients_.emplace_back(plant, i);
}

Outcome World::run() {
    gateway_.on_line_up(now());
    drain();
    for (Client& client : clients_)
        agenda_.at(now() + client.random.between(100ms, Duration(1s)),
                   [this, &client] { ask(client); });
    while (step()) {
    }
    outcome_.history = agenda_.history();
    return std::move(outcome_);
}

/// One event, or one deadline of the gateway. False when every request has an answer.
bool World::step() {
    constexpr int kMostSpins = 1000;
    const auto next = agenda_.next();
    if (!next && open_.empty()) return false;
    const auto deadline = gateway_.next_deadline();
    if (deadline && (!next || *deadline < *next)) {
        spins_ = *deadline > now() ? 0 : spins_ + 1;
        agenda_.advance_to(*deadline);
        gateway_.on_deadline(now());
        drain();
        return spins_ < kMostSpins;
    }
    if (!next) return false;
    spins_ = 0;
    agenda_.happen_next();
    return true;
}

void World::drain() {
    while (const auto action = gateway_.poll_action(now()))
        std::visit([this](const auto& one) { act(one); }, *action);
}

void World::ask(Client& client) {
    if (now() >= end_) return;
    const std::uint8_t station = client.station();
    Bytes pdu = client.next(panel_of(station).plan());
    ++count_of(station).requests;
    agenda_.tell("client " + std::to_string(client.index) + " asks " + std::to_string(station),
                 pdu);
    const modbus::Request request = test::request_of(pdu);
    arbiter::Job job{.station = station, .request = request, .client = client.index + 1};
    if (!request.is_read()) job.priority = PriorityClass::write;
    if (const auto ticket = gateway_.submit(now(), std::move(job))) {
        open_.emplace(*ticket, Open{client, station, std::move(pdu), panel_of(station).served()});
    } else {
        agenda_.tell("refused: " + std::string(label(ticket.error())));
        ask_again(client);
    }
    drain();
}

void World::ask_again(Client& client) {
    const Duration pause = client.random.between(client.plan.least_pause, client.plan.most_pause);
    agenda_.at(now() + pause, [this, &client] { ask(client); });
}

void World::act(const arbiter::Finish& finish) {
    const Open open = std::move(open_.extract(finish.ticket).mapped());
    Count& count = count_of(open.station);
    if (finish.transmitted && !finish.shared) ++count.alone;
    const std::string who = " to client " + std::to_string(open.client.index);
    if (finish.pdu) {
        const bool right = panel_of(open.station).has_said(open.pdu, *finish.pdu, open.since);
        agenda_.tell((right ? "answer" : "WRONG answer") + who, *finish.pdu);
        ++count.answered;
        count.wrong += right ? 0 : 1;
    } else {
        agenda_.tell(std::string(label(finish.pdu.error())) + who);
    }
    ask_again(open.client);
}

void World::act(const arbiter::StationEvent& event) {
    agenda_.tell(label(event.kind), ByteView(&event.station, 1));
    if (event.kind == arbiter::StationEvent::Kind::offline) ++count_of(event.station).offline;
}

/// Acting calls the gateway later: first the gateway has to say all.
void World::act(const arbiter::Reset& reset) {
    agenda_.tell(reset.why);
    agenda_.at(now(), [this] { reconnect(); });
}

/// A frame begins now. A frame that is still on the wire is damaged, and damages the new frame.
std::shared_ptr<World::Frame> World::put(Duration length) {
    const auto frame = std::make_shared<Frame>(Frame{now() + length});
    if (!plant_.instant && on_wire_ && on_wire_->end > now()) {
        agenda_.tell("collision");
        on_wire_->collided = frame->collided = true;
    }
    on_wire_ = frame;
    return frame;
}

void World::act(const arbiter::Transmit& transmit) {
    const Bytes& adu = transmit.adu;
    ++count_of(adu[0]).frames;
    agenda_.tell("sent", adu);
    const auto frame = put(wire_time_of(adu.size()));
    const TimePoint start = plant_.instant ? frame->end : now();
    agenda_.at(frame->end, [this, adu, frame, start] {
        if (!frame->collided) heard_by_panels(adu, start);
    });
}

void World::heard_by_panels(const Bytes& adu, TimePoint start) {
    for (Panel& panel : panels_) {
        if (!panel.hears_request(adu, start, now())) continue;
        const Bytes pdu(adu.begin() + 1, adu.end() - 2);
        agenda_.at(now() + panel.think(), [this, &panel, pdu, connection = connection_] {
            if (connection == connection_) return answer(panel, pdu);
            panel.forget();
        });
    }
}

void World::answer(Panel& panel, const Bytes& pdu) {
    const Bytes adu = modbus::encode_adu(panel.plan().id, panel.serve(pdu));
    panel.replies_until(now() + wire_time_of(adu.size()));
    for (Panel& other : panels_) other.hears_reply(now());
    say(adu);
}

/// A reply comes in pieces, as an adapter hands them over, or from a device server at once.
void World::say(const Bytes& adu) {
    const std::size_t piece = plant_.instant ? adu.size() : 8;
    const auto frame = put(wire_time_of(adu.size()));
    for (std::size_t from = 0; from < adu.size(); from += piece) {
        const std::size_t to = std::min(from + piece, adu.size());
        const ByteView part = ByteView(adu).subspan(from, to - from);
        agenda_.at(now() + wire_time_of(to), [this, bytes = Bytes(part.begin(), part.end()), frame,
                                              connection = connection_] {
            if (up_ && connection == connection_) deliver(bytes, *frame);
        });
    }
}

void World::deliver(Bytes piece, const Frame& frame) {
    if (frame.collided) piece.front() ^= 0x5A;
    agenda_.tell("heard", piece);
    gateway_.on_rx(now(), piece);
    drain();
}

void World::reconnect() {
    if (!up_) return;
    constexpr Duration kConnecting = 5ms;
    ++connection_;
    up_ = false;
    gateway_.on_line_down(now());
    drain();
    agenda_.at(now() + kConnecting, [this] {
        up_ = true;
        gateway_.on_line_up(now());
        drain();
    });
}

}  // namespace

Outcome play(const Plant& plant, scenario::Subject& gateway, Duration length, bool with_history) {
    return World(plant, gateway, length, with_history).run();
}

}  // namespace panelgate::sound
