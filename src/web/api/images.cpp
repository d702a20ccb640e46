#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "routes.hpp"
#include "sight.hpp"
#include "target.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

using images::Place;

constexpr std::string_view kMapColumns[] = {"table",   "address", "count", "quality_at",
                                            "station", "point",   "type",  "word_order",
                                            "scale",   "offset",  "unit",  "writable"};

json::object describe(const ImageEntry& image) {
    const images::Settings& settings = *image.settings;
    json::object object{{"name", settings.name}, {"unit", settings.unit}};
    object["stale"] = settings.stale == images::Stale::last ? "last" : "exception";
    object["quality"] = settings.quality;
    object["registers"] = image.layout.size(modbus::Table::holding_registers);
    object["bits"] = image.layout.size(modbus::Table::coils);
    return object;
}

json::object describe(const Place& place) {
    const points::Point& point = *place.point;
    json::object object{{"table", label(place.items.table)},
                        {"address", place.items.first},
                        {"count", place.items.count}};
    object["quality_at"] = nullptr;
    if (place.quality) object["quality_at"] = *place.quality;
    object["station"] = place.entry->station;
    object["point"] = place.entry->point;
    object["type"] = label(point.type);
    object["word_order"] = label(point.word_order);
    object["scale"] = point.scale;
    object["offset"] = point.offset;
    object["unit"] = point.unit;
    object["writable"] = point.writable;
    return object;
}

}  // namespace

Handling get_images(HttpRequest request, const Api* api) {
    Table table{.directory = api->lent, .name = "images", .count = api->directory->images.size()};
    table.entry = [directory = api->lent](std::size_t i) { return describe(directory->images[i]); };
    co_return table_answer(request, std::move(table));
}

Handling get_image(HttpRequest request, const Api* api) {
    const std::string& name = request.arguments[0];
    const auto& all = api->directory->images;
    const auto image = std::ranges::find_if(
        all, [&](const ImageEntry& one) { return one.settings->name == name; });
    if (image == all.end()) refuse(404, "there is no image '" + excerpt(name) + '\'');
    const Sight sight(*api->directory, request.caller->who());
    std::vector<const Place*> seen;
    for (const Place& place : image->layout.places()) {
        const auto station = find_station(*api->directory, place.entry->station);
        if (station && sight.point(*station, *place.point)) seen.push_back(&place);
    }
    Table table{.directory = api->lent,
                .members = describe(*image),
                .name = "points",
                .columns = kMapColumns,
                .count = seen.size()};
    table.entry = [seen = std::move(seen)](std::size_t i) { return describe(*seen[i]); };
    co_return table_answer(request, std::move(table));
}

}  // namespace panelgate::web
