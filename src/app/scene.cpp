#include "scene.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>

#include "panelgate/tcp_server/unit_map.hpp"
#include "showing.hpp"

namespace panelgate::app {

std::shared_ptr<Scene> make_scene(std::shared_ptr<const config::Config> config,
                                  std::vector<std::shared_ptr<RunningLine>> lines) {
    auto scene = std::make_shared<Scene>();
    scene->config = std::move(config);
    scene->lines = std::move(lines);
    for (std::size_t i = 0; i < scene->lines.size(); ++i) {
        const config::Line& line = scene->config->lines[i];
        RunningLine& runs = *scene->lines[i];
        scene->plant.add(line, runs.bus(), runs.simulated());
    }
    std::size_t at = 0;  // the plant has the stations in this order
    for (std::size_t i = 0; i < scene->lines.size(); ++i) {
        for (const config::Station& station : scene->config->lines[i].stations)
            scene->plant.stations()[at++].points = scene->lines[i]->points_of(station);
    }
    for (const tcp_server::Settings& settings : scene->config->modbus_tcp)
        scene->plant.add_units(tcp_server::UnitMap(settings, scene->plant.listener_lines()));
    return scene;
}

void keep_histories(Scene& scene, const Scene* before, LineHistories& lines) {
    std::size_t points = 0;
    for (const Station& station : scene.plant.stations())
        points += station.points ? station.points->points().size() : 0;
    const Duration width = points::StationHistory::width_for(points);
    using Key = std::pair<std::string_view, std::uint8_t>;
    std::map<Key, const Station*> known;
    if (before != nullptr) {
        for (const Station& station : std::as_const(before->plant).stations())
            if (station.history) known.emplace(Key(station.line, station.id), &station);
    }
    for (Station& station : scene.plant.stations()) {
        if (!station.points) continue;
        station.history.emplace(station.points->points(), width);
        const auto was = known.find(Key(station.line, station.id));
        if (was != known.end()) station.history->adopt(*was->second->history);
    }
    std::vector<const bus::LineBus*> buses;
    for (const auto& line : scene.lines) buses.push_back(&line->bus());
    lines.apply(std::move(buses));
    for (std::size_t i = 0; i < scene.lines.size(); ++i) scene.histories.push_back(lines.at(i));
}

}  // namespace panelgate::app
