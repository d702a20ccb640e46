#include "discoveries.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "panelgate/rt/log.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/web/api/event_text.hpp"

namespace panelgate::app {
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
    // Of a far end nobody knows how its panels are set.
    if (line.configured->kind != config::Line::Kind::tcp)
        settings.format = line.configured->device.serial;
    const std::string key(name);
    auto search = std::make_shared<LineDiscovery>(clock_, *line.bus, place.profiles,
                                                  std::move(settings), [this, key] { tell(key); });
    by_line_[key] = search;
    rt::log(rt::LogLevel::info, "discovery begins",
            {{"line", key},
             {"stations", std::string(stations)},
             {"share_percent", std::to_string(share_percent)}});
    search->start();
    return std::nullopt;
}

void Discoveries::tell(const std::string& line) const {
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
    if (!hub_.announce("discovery")) return;
    hub_.publish({"discovery", line, {}, {}},
                 web::discovery_event(line, state, what.asked(), what.of(), found));
}

void Discoveries::stop(std::string_view line) {
    const auto found = by_line_.find(line);
    if (found != by_line_.end()) found->second->stop("somebody has ended it");
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

}  // namespace panelgate::app
