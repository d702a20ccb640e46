#include "panelgate/gateway/images.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::gateway {

namespace {

Duration deadline_of(const Plant& plant, const std::string& line) {
    const auto found = std::ranges::find(
        plant.lines(), line, [](const Line& one) -> const auto& { return one.configured->name; });
    return found->configured->arbiter.queue.deadline;
}

std::shared_ptr<const images::Content> content_of(const images::Settings& settings,
                                                  const std::shared_ptr<const Snapshot>& snapshot) {
    auto content = std::make_shared<images::Content>();
    content->owner = snapshot;
    content->settings = settings;
    content->layout = {content->settings, [&](std::string_view station, std::string_view point) {
                           const Station* const owner = snapshot->plant.find(station);
                           const bool has_points = owner != nullptr && owner->points;
                           return has_points ? owner->points->find(point) : nullptr;
                       }};
    for (const images::Place& place : content->layout.places()) {
        const Station& station = *snapshot->plant.find(place.entry->station);
        content->sources.push_back({station.bus, station.id, station.configured->profile,
                                    &*station.points, deadline_of(snapshot->plant, station.line)});
    }
    return content;
}

}  // namespace

Images::Images(boost::asio::any_io_executor executor, rt::Clock& clock, images::Refused refused)
    : executor_(std::move(executor)), clock_(clock), refused_(std::move(refused)) {}

images::ImageBus& Images::bus(const std::string& name) {
    auto& bus = buses_[name];
    if (!bus) bus = std::make_unique<images::ImageBus>(executor_, clock_, refused_);
    return *bus;
}

void Images::add_to(Plant& plant, const config::Config& config) {
    for (const images::Settings& image : config.images) plant.add(image, config, bus(image.name));
}

void Images::show(const std::shared_ptr<const Snapshot>& snapshot) {
    for (const auto& [name, bus] : buses_) bus->show(nullptr);
    for (const images::Settings& image : snapshot->config->images)
        bus(image.name).show(content_of(image, snapshot));
}

}  // namespace panelgate::gateway
