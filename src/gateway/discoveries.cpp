#include "panelgate/gateway/discoveries.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/web/api/render.hpp"

namespace panelgate::gateway {

namespace {

constexpr const char* kName = "discovery";
constexpr int kHundred = 100;

using Reply = scan::Discovery::Reply;

/// Only a transmitted request can time out: a refusal says nothing about the address.
Reply reply_of(const bus::Answer& answer) {
    if (answer.pdu) return Reply::answered;
    switch (answer.pdu.error()) {
        case Fault::timeout:
        case Fault::line_lost:
            return answer.transmitted ? Reply::silent : Reply::unsent;
        case Fault::offline:
            return answer.transmitted ? Reply::silent : Reply::refused;
        case Fault::damaged:
        case Fault::wrong:
            return Reply::damaged;
        case Fault::denied:
        case Fault::malformed:
        case Fault::not_routed:
        case Fault::busy:
        case Fault::expired:
        case Fault::line_down:
        case Fault::cancelled:
            return Reply::unsent;
    }
    return Reply::unsent;
}

}  // namespace

LineDiscovery::LineDiscovery(rt::Clock& clock, bus::BusClient& bus,
                             std::shared_ptr<const profile::Catalogue> profiles,
                             scan::DiscoverySettings settings, std::function<void()> on_step)
    : clock_(clock),
      bus_(bus),
      profiles_(std::move(profiles)),
      discovery_(*profiles_, settings, clock.now()),
      share_percent_(static_cast<unsigned>(std::lround(settings.share * kHundred))),
      on_step_(std::move(on_step)),
      client_(bus::next_client_id()),
      who_(own_task(kName)),
      alarm_(clock.make_alarm()),
      began_(clock.now()),
      ended_(began_) {}

void LineDiscovery::start() {
    bus_.name_client(client_, kName);
    step();
}

void LineDiscovery::step() {
    if (state_ != State::running) return;
    if (discovery_.done()) ask_late_stations();
    if (discovery_.gave_up()) return end(State::stopped, "the line takes no questions");
    if (discovery_.done()) return end(State::done, {});
    const TimePoint now = clock_.now();
    if (const auto request = discovery_.question(now)) return ask(*request);
    alarm_->arm(discovery_.due(), [this] { step(); });
}

void LineDiscovery::ask(const scan::ReadRequest& request) {
    Bytes pdu(request.pdu().begin(), request.pdu().end());
    bus::Request wanted{
        .station = request.station(),
        .request = *modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide),
        .client = client_,
        .who = who_,
        .poll = true,
        .search = true};
    asked_ = clock_.now();
    paid_ = used();
    bus_.transact(std::move(wanted), [self = weak_from_this()](const bus::Answer& answer) {
        if (const auto still_there = self.lock()) still_there->on_answer(answer);
    });
}

void LineDiscovery::on_answer(const bus::Answer& answer) {
    if (state_ != State::running) return;
    const TimePoint now = clock_.now();
    scan::Discovery::Answer result;
    result.reply = reply_of(answer);
    if (answer.pdu) result.pdu = *answer.pdu;
    // If the bus does not report the cost, assume the whole time.
    const Duration cost = used() - paid_;
    const bool unknown = answer.transmitted && cost <= Duration::zero();
    result.cost = unknown ? now - asked_ : std::max(cost, Duration::zero());
    discovery_.on_answer(now, result);
    on_step_();
    step();
}

/// Asks again the stations whose reply came after its timeout.
void LineDiscovery::ask_late_stations() {
    const auto silent = discovery_.silent();
    for (const std::uint8_t station : silent) {
        const auto heard = bus_.station_status(station).last_reply;
        if (heard && clock_.now() - *heard >= began_) discovery_.ask_late(station);
    }
}

Duration LineDiscovery::used() const {
    const auto clients = bus_.clients();
    const auto found = std::ranges::find(clients, kName, &bus::ClientShare::name);
    return found == clients.end() ? Duration::zero() : found->busy;
}

void LineDiscovery::end(State state, std::string why) {
    if (state_ != State::running) return;
    ended_ = clock_.now();
    bus_total_ = used();
    state_ = state;
    why_ = std::move(why);
    alarm_->cancel();
    bus_.cancel(client_);
    on_step_();
}

web::DiscoveryReport LineDiscovery::report() const {
    web::DiscoveryReport report;
    report.state = state_;
    report.share_percent = share_percent_;
    report.asked = discovery_.asked();
    report.refused = discovery_.refused();
    report.of = discovery_.of();
    report.asked_stations = scan::station_ranges(discovery_.asked_stations());
    report.silent_stations = scan::station_ranges(discovery_.silent());
    if (state_ == State::running) report.remaining = discovery_.remaining(clock_.now());
    for (const scan::StationFinding& finding : discovery_.findings()) {
        web::DiscoveredStation& station = report.stations.emplace_back();
        station.id = finding.station;
        for (const scan::Candidate& candidate : finding.candidates)
            station.profiles.push_back(candidate.profile);
        station.evidence = scan::evidence_text(finding);
    }
    report.bus = state_ == State::running ? used() : bus_total_;
    report.took = (state_ == State::running ? clock_.now() : ended_) - began_;
    report.why = why_;
    return report;
}

namespace {

constexpr double kPercent = 0.01;

}  // namespace

std::optional<std::string> Discoveries::start(std::string_view name, std::string_view stations,
                                              unsigned share_percent) {
    const auto list = scan::station_list(stations);
    if (!list) return std::string("is not ") + scan::kStationListForm;
    const Place place = place_();
    const Line& line = *std::ranges::find(place.plant.lines(), name, [](const Line& one) {
        return std::string_view(one.configured->name);
    });
    scan::DiscoverySettings settings;
    settings.share = share_percent * kPercent;
    for (const std::uint8_t id : *list)
        if (place.plant.find(name, id) == nullptr) settings.stations.push_back(id);
    // For a TCP device the serial format of the far end is unknown.
    if (line.configured->kind != config::Line::Kind::tcp)
        settings.format = line.configured->device.serial;
    const std::string key(name);
    auto search =
        std::make_shared<LineDiscovery>(clock_, *line.bus, place.profiles, std::move(settings),
                                        [this, key] { report_progress(key); });
    by_line_[key] = search;
    rt::log(rt::LogLevel::info, "discovery begins",
            {{"line", key},
             {"stations", std::string(stations)},
             {"share_percent", std::to_string(share_percent)}});
    search->start();
    return std::nullopt;
}

void Discoveries::report_progress(const std::string& line) const {
    const LineDiscovery& search = *by_line_.at(line);
    const std::string_view state = label(search.state());
    const scan::Discovery& what = search.discovery();
    const std::size_t found = what.findings().size();
    if (search.state() != LineDiscovery::State::running)
        rt::log(rt::LogLevel::info, "discovery ends",
                {{"line", line},
                 {"state", std::string(state)},
                 {"asked", std::to_string(what.asked())},
                 {"found", std::to_string(found)}});
    if (!events_.is_wanted()) return;
    events_.publish({"discovery", line, {}, {}},
                    web::discovery_event(line, state, what.asked(), what.of(), found));
}

void Discoveries::stop(std::string_view line) {
    const auto found = by_line_.find(line);
    if (found != by_line_.end()) found->second->stop("it was ended by a request");
}

void Discoveries::stop_all() {
    for (const auto& [line, search] : by_line_) search->stop("the gateway ends");
}

web::DiscoveryReport Discoveries::report(std::string_view line) const {
    const auto found = by_line_.find(line);
    if (found == by_line_.end()) return {};
    web::DiscoveryReport report = found->second->report();
    report.yaml = scan::stations_yaml(found->first, found->second->discovery().findings());
    return report;
}

}  // namespace panelgate::gateway
