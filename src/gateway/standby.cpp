#include "panelgate/gateway/standby.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/json/parse.hpp>
#include <utility>
#include <variant>

#include "panelgate/base/network.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/web/http/client.hpp"

namespace panelgate::gateway {

namespace json = boost::json;
using standby::Deed;
using standby::Role;

namespace {

constexpr Duration kStandbyLook = 100ms;
constexpr Duration kOpening = 1s;          // in which a line that was arranged anew opens
constexpr Duration kQuestion = 1s;         // between two questions to the peer
constexpr std::size_t kPeerReply = 65536;  // bytes of the peer's answer that are read

/// Asks the peer for its roles. Blocks: for a worker. Returns the body, or "" without an answer.
std::string roles_of(const standby::Settings& settings) {
    const auto url = alarms::parse_url(settings.peer);
    if (!url) return {};
    std::string request =
        "GET /api/v1/standby HTTP/1.1\r\nHost: " + endpoint_text(url->host, url->port) +
        "\r\nConnection: close\r\n";
    if (!settings.token.empty()) request += "Authorization: Bearer " + settings.token + "\r\n";
    web::HttpTarget target{url->host, url->port, {}};
    if (url->secure) target.trust = tls::Trust{{}, settings.ca_pem};
    const web::HttpReply reply =
        web::ask(target, request + "\r\n", kQuestion, kPeerReply,
                 [](const web::HttpReply& so_far) { return so_far.body().ends_with('}'); });
    return reply.is_http() && reply.status().starts_with("200") ? std::string(reply.body()) : "";
}

std::string text_in(const json::object& object, std::string_view key) {
    const json::value* const value = object.if_contains(key);
    return value != nullptr && value->is_string() ? std::string(value->as_string()) : "";
}

/// A line that is only heard.
void make_listen(config::Line& line) {
    line.listens = line.standby = true;
    line.device.listen_only = true;
    for (config::Station& station : line.stations) station.listens = true;
}

/// The longest that this line's master may say nothing.
Duration quiet_of(const config::Line& line) {
    constexpr Duration kMargin = 100ms;
    Duration quiet = line.arbiter.broadcast_turnaround;
    const auto look_at = [&quiet](const arbiter::StationSettings& station) {
        quiet =
            std::max({quiet, station.response_timeout, station.station_gap, station.after_write});
    };
    look_at(line.arbiter.unlisted);
    for (const arbiter::StationSettings& station : line.arbiter.stations) look_at(station);
    return quiet + kMargin;
}

const config::Line* line_of(const config::Config& config, const std::string& station) {
    const auto found = std::ranges::find_if(config.lines, [&](const config::Line& line) {
        return std::ranges::find(line.stations, station, &config::Station::name) !=
               line.stations.end();
    });
    return found == config.lines.end() ? nullptr : &*found;
}

/// A cheap read, which a panel answers whatever is in it: by an exception, too.
bus::Request own_read(std::uint8_t station, bool poll) {
    static const WhoRef kWho = own_task("standby");
    return {.station = station,
            .request = modbus::Request::read({modbus::Table::holding_registers, 0, 1}),
            .client = bus::next_client_id(),
            .who = kWho,
            .poll = poll};
}

}  // namespace

Standby::Standby(boost::asio::any_io_executor executor, rt::Clock& clock, Hooks hooks)
    : executor_(std::move(executor)),
      clock_(clock),
      hooks_(std::move(hooks)),
      alarm_(clock.make_alarm()) {}

Standby::~Standby() { stop(); }

void Standby::stop() {
    alarm_->cancel();
    for (auto& [name, place] : places_) place.probe.reset();
}

void Standby::apply(const config::Config& config) {
    const bool other_rank = settings_ && config.standby && settings_->rank != config.standby->rank;
    if (!config.standby || other_rank) places_.clear();
    settings_ = config.standby;
    locks_.clear();
    peer_role_.clear();
    if (!settings_) return alarm_->cancel();
    std::map<std::string, Place> before = std::exchange(places_, {});
    for (const config::Line& line : config.lines) {
        if (line.kind == config::Line::Kind::tcp && !line.device.modbus_tcp)
            locks_[line.name] = {false, clock_.now()};
        if (line.kind != config::Line::Kind::serial || line.listens) continue;
        auto known = before.find(line.name);
        Place place = known != before.end()
                          ? std::move(known->second)
                          : Place{.seat = standby::Seat(settings_->rank), .line = {}};
        place.line = line;
        place.seat.set_quiet(quiet_of(line));
        for (config::Station& station : place.line.stations) {
            station.points.clear();
            station.polls.clear();
        }
        places_.emplace(line.name, std::move(place));
    }
    if (!worker_) worker_ = std::make_unique<rt::Worker>(executor_);
    look();
}

std::shared_ptr<const config::Config> Standby::arrange(
    const std::shared_ptr<const config::Config>& config) const {
    const auto is_driven = [this](const std::string& name) {
        const auto place = places_.find(name);
        return place == places_.end() || place->second.seat.role() == Role::active;
    };
    const bool all =
        std::ranges::all_of(config->lines, [&](const auto& line) { return is_driven(line.name); });
    if (all) return config;
    auto arranged = std::make_shared<config::Config>(*config);
    for (config::Line& line : arranged->lines)
        if (!is_driven(line.name)) make_listen(line);
    std::erase_if(arranged->relays, [&](const points::Relay& relay) {
        const config::Line* const from = line_of(*config, relay.from.station);
        const config::Line* const to = line_of(*config, relay.to.station);
        return from == nullptr || to == nullptr || !is_driven(from->name) || !is_driven(to->name);
    });
    if (std::ranges::none_of(places_, [&](const auto& one) { return is_driven(one.first); })) {
        arranged->mqtt.reset();
        arranged->webhook.reset();
    }
    return arranged;
}

bool Standby::may_send(const std::string& line) {
    const auto place = places_.find(line);
    if (place == places_.end()) return true;
    const TimePoint now = clock_.now();
    if (!place->second.seat.may_send(now)) return false;
    place->second.seat.on_sent(now);
    return true;
}

void Standby::on_event(const std::string& line, const bus::BusEvent& event) {
    const auto found = places_.find(line);
    if (found == places_.end()) return;
    Place& place = found->second;
    const TimePoint now = clock_.now();
    if (std::holds_alternative<tap::Transaction>(event))
        carry_out(line, place, place.seat.on_heard(now));
    if (std::holds_alternative<bus::ForeignRequest>(event))
        carry_out(line, place, place.seat.on_foreign_request(now));
}

void Standby::arranged() {
    for (auto& [name, place] : places_) {
        place.opens_by = clock_.now() + kOpening;
        look_for_device(name, place);
    }
}

void Standby::look_at_locks() {
    for (auto& [name, lock] : locks_) {
        const RunningLine* const line = hooks_.line(name);
        const bool up = line != nullptr && line->bus().status().up;
        if (up != lock.first) lock = {up, clock_.now()};
    }
}

/// A line that was arranged anew may still be opening: its device is not judged meanwhile.
void Standby::look_for_device(const std::string& name, Place& place) {
    const RunningLine* const line = hooks_.line(name);
    if (line == nullptr || place.seat.role() == Role::claiming) return;
    const bool up = line->bus().status().up;
    if (up || clock_.now() >= place.opens_by)
        carry_out(name, place, place.seat.on_line(clock_.now(), up));
}

void Standby::look() {
    alarm_->arm(clock_.now() + kStandbyLook, [this] { look(); });
    for (auto& [name, place] : places_) {
        look_for_device(name, place);
        if (place.seat.role() == Role::listening) listen_to(name, place);
        if (place.seat.role() == Role::active) {
            look_for_echo(name, place);
            look_for_answers(name, place);
        }
        carry_out(name, place, place.seat.look(clock_.now()));
    }
    look_at_locks();
    if (clock_.now() >= next_question_) ask_peer();
}

/// Any byte shows that another box has the line, even a byte of no frame.
void Standby::listen_to(const std::string& name, Place& place) {
    const RunningLine* const line = hooks_.line(name);
    if (line == nullptr) return;
    const std::uint64_t received = line->bus().report().device.bytes_received;
    if (place.received && received != *place.received)
        carry_out(name, place, place.seat.on_heard(clock_.now()));
    place.received = received;
}

/// The other box sends the same requests: on a line without an echo they look like one.
void Standby::look_for_echo(const std::string& name, Place& place) {
    const RunningLine* const line = hooks_.line(name);
    if (line == nullptr) return;
    const EchoState before = std::exchange(place.echo, line->bus().status().echo);
    if (before == EchoState::absent && place.echo == EchoState::present)
        carry_out(name, place, place.seat.on_foreign_request(clock_.now()));
}

void Standby::carry_out(const std::string& name, Place& place, std::optional<Deed> deed) {
    if (!deed) return;
    switch (*deed) {
        case Deed::probe:
            return begin_probe(name, place);
        case Deed::keep_alive:
            return keep_alive(name, place);
        case Deed::listen:
        case Deed::drive:
            return change(name, place);
    }
}

/// The line is closed and opened anew by the probe's own bus, which has no other client.
void Standby::begin_probe(const std::string& name, Place& place) {
    RunningLine* const line = hooks_.line(name);
    if (line == nullptr || place.line.stations.empty()) return;
    place.probed = station_to_probe(name, place);
    line->stop();
    bus::Settings settings = explain::bus_settings(place.line);
    for (arbiter::StationSettings& station : settings.arbiter.stations) station.retries = 0;
    settings.observe = [this, name](const bus::BusEvent& event) {
        const auto found = places_.find(name);
        if (found == places_.end()) return;
        const auto* state = std::get_if<bus::LineEvent>(&event);
        if (std::holds_alternative<bus::ForeignRequest>(event))
            end_probe(name, found->second, false);
        if (state == nullptr || state->station != 0 || found->second.asked) return;
        if (!state->up) return end_probe(name, found->second, false);
        boost::asio::post(executor_, [this, name, life = std::weak_ptr(alive_)] {
            const auto here = life.expired() ? places_.end() : places_.find(name);
            if (!life.expired() && here != places_.end() && here->second.probe)
                ask_panel(name, here->second);
        });
    };
    line::Settings device = place.line.device;
    device.owner = "line '" + name + '\'';
    place.asked = false;
    place.probe =
        std::make_unique<bus::Bus>(executor_, clock_, std::move(settings),
                                   line::make_tty_line(executor_, clock_, std::move(device)));
    place.probe->start();
}

/// First the panel whose reply was heard last, then the panels in their order.
std::size_t Standby::station_to_probe(const std::string& name, const Place& place) const {
    const auto& stations = place.line.stations;
    const RunningLine* const line = hooks_.line(name);
    std::size_t next = (place.probed + 1) % stations.size();
    std::optional<Duration> shortest;
    for (std::size_t i = 0; place.tried == 0 && i < stations.size(); ++i) {
        const auto ago = line->bus().station_status(stations[i].id).last_success;
        if (!ago || (shortest && *shortest <= *ago)) continue;
        shortest = ago;
        next = i;
    }
    return next;
}

void Standby::ask_panel(const std::string& name, Place& place) {
    place.asked = true;
    const auto done = std::make_shared<std::function<void(bool)>>(
        [this, name, life = std::weak_ptr(alive_)](bool answered) {
            if (life.expired()) return;
            if (const auto found = places_.find(name); found != places_.end())
                end_probe(name, found->second, answered);
        });
    place.probe->transact(own_read(place.line.stations[place.probed].id, false),
                          [done](const bus::Answer& answer) { (*done)(answer.pdu.has_value()); });
}

/// Posted: the bus of the probe may be the caller.
void Standby::end_probe(const std::string& name, Place& place, bool answered) {
    place.asked = true;
    boost::asio::post(executor_, [this, name, answered, life = std::weak_ptr(alive_)] {
        if (life.expired()) return;
        const auto found = places_.find(name);
        if (found == places_.end() || !found->second.probe) return;
        Place& one = found->second;
        one.tried = answered ? 0 : one.tried + 1;
        const bool all_tried = one.tried % one.line.stations.size() == 0;
        carry_out(name, one, one.seat.on_probed(clock_.now(), answered, all_tried));
    });
}

/// Any station that is not known to be dead, those that answer first. While all are dead, silence
/// is no harm: the other box has no answer to its probe, either.
void Standby::keep_alive(const std::string& name, Place& place) {
    RunningLine* const line = hooks_.line(name);
    if (line == nullptr) return;
    const auto& stations = place.line.stations;
    const auto find = [&](auto fits) {
        return std::ranges::find_if(stations, [&](const config::Station& station) {
            return fits(line->bus().station_status(station.id).state);
        });
    };
    auto station = find([](Health health) { return health == Health::online; });
    if (station == stations.end() && place.probed < stations.size() &&
        line->bus().station_status(stations[place.probed].id).state != Health::offline)
        station = stations.begin() + static_cast<std::ptrdiff_t>(place.probed);
    if (station == stations.end())
        station = find([](Health health) { return health != Health::offline; });
    if (station == stations.end()) return;
    line->bus().transact(own_read(station->id, true), [](const bus::Answer&) {});
}

/// A master whose frames get lost, or that hears nothing, leaves the line if the other box is
/// there.
void Standby::look_for_answers(const std::string& name, Place& place) {
    constexpr Duration kPatient = 10s;
    const RunningLine* const line = hooks_.line(name);
    if (line == nullptr) return;
    const TimePoint now = clock_.now();
    const bool any = std::ranges::any_of(place.line.stations, [&](const config::Station& station) {
        return line->bus().station_status(station.id).state == Health::online;
    });
    if (any) place.answered = now;
    const bool is_alone = peer_role_ != label(Role::listening) && peer_role_ != "standby";
    if (is_alone || now < std::max(place.answered, place.seat.since()) + kPatient) return;
    carry_out(name, place, place.seat.on_unanswered(now));
}

void Standby::change(const std::string& name, Place& place) {
    const bool probed = place.probe != nullptr;
    place.probe.reset();
    place.received.reset();
    if (probed && place.seat.role() == Role::listening)
        if (RunningLine* const line = hooks_.line(name)) line->restart();
    hooks_.tell(name, place.seat);
    if (!probed || place.seat.role() == Role::active)
        boost::asio::post(executor_, [this, life = std::weak_ptr(alive_)] {
            if (!life.expired()) hooks_.rearrange();
        });
}

void Standby::ask_peer() {
    next_question_ = clock_.now() + kQuestion;
    if (asking_ || settings_->peer.empty()) return;
    asking_ = true;
    const auto text = std::make_shared<std::string>();
    worker_->run([settings = *settings_, text] { *text = roles_of(settings); },
                 [this, text, life = std::weak_ptr(alive_)] {
                     if (life.expired()) return;
                     asking_ = false;
                     take_peer(*text);
                 });
}

void Standby::take_peer(const std::string& text) {
    boost::system::error_code wrong;
    const json::value body = json::parse(text, wrong);
    const json::object* const whole = wrong ? nullptr : body.if_object();
    peer_role_ = whole == nullptr ? "" : text_in(*whole, "role");
    if (whole == nullptr)  // a box that says nothing is no master that has to be waited for
        for (auto& [name, place] : places_) place.seat.on_peer(clock_.now(), false);
    const json::value* const lines = whole == nullptr ? nullptr : whole->if_contains("lines");
    if (lines == nullptr || !lines->is_array()) return;
    for (const json::value& one : lines->as_array()) {
        if (!one.is_object()) continue;
        const auto place = places_.find(text_in(one.as_object(), "line"));
        if (place != places_.end())
            place->second.seat.on_peer(clock_.now(), text_in(one.as_object(), "role") == "active");
    }
}

web::StandbyView Standby::view() const {
    web::StandbyView view;
    view.peer = peer_role_;
    if (!settings_) return view;
    view.is_on = true;
    for (const auto& [name, place] : places_) {
        const standby::Seat& seat = place.seat;
        view.lines.push_back({name, std::string(label(seat.role())), std::string(seat.why()),
                              clock_.now() - seat.since(), seat.is_deaf()});
    }
    for (const auto& [name, lock] : locks_)
        view.lines.push_back({name, std::string(label(lock.first ? Role::active : Role::listening)),
                              lock.first
                                  ? "the device server has taken the connection of this box"
                                  : "the device server has not taken the connection of this box",
                              clock_.now() - lock.second, false});
    return view;
}

}  // namespace panelgate::gateway
