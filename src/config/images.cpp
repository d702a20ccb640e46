// Images: their rows, and what may stand in an image.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/images/layout.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Node;

constexpr std::string_view kPointsExample = "[press/temperature, {skip: 2}, oven/temperature]";

const Keys<images::Entry>& entry_keys() {
    static const auto kKeys = Keys<images::Entry>()
                                  .integer("skip", &images::Entry::skip, 1, modbus::kTableItems,
                                           "Registers that are left free, instead of a point.")
                                  .initially("")
                                  .example("2");
    return kKeys;
}

std::optional<images::Entry> read_entry(Reader& in, const Node& node) {
    images::Entry entry;
    if (node.kind == Node::Kind::map) {
        Reader inside(in.loading, node, "an entry of points", "{skip: 2}");
        entry_keys().read(inside, entry);
        if (!inside.has("skip")) inside.problem("skip", "a map here is {skip: NUMBER}");
        inside.finish();
        return entry;
    }
    const auto path = parse_point_path(node.scalar);
    if (!path) {
        in.problems().add(node.mark,
                          "points lists STATION/POINT such as oven/temperature, or "
                          "{skip: 2}, not " +
                              yaml::quote(node.scalar));
        return std::nullopt;
    }
    if (find_point(in.loading, node.mark, *path) == nullptr) return std::nullopt;
    entry.station = path->station;
    entry.point = path->point;
    return entry;
}

bool read_entries(Reader& in, images::Settings& image) {
    if (!in.require("points")) return false;
    const Node* const list = in.sequence("points", kPointsExample);
    if (list == nullptr) return false;
    for (const Node& node : list->items)
        if (auto entry = read_entry(in, node)) image.entries.push_back(std::move(*entry));
    if (list->items.empty())
        in.problem("points", "an image needs points, such as " + std::string(kPointsExample));
    return true;
}

/// In the order of the file, because the order is the map.
std::string entries_text(const images::Settings& image) {
    std::string text;
    for (const images::Entry& entry : image.entries)
        text += (text.empty() ? "[" : ", ") + (entry.station.empty()
                                                   ? "{skip: " + std::to_string(entry.skip) + '}'
                                                   : entry.station + '/' + entry.point);
    return text.empty() ? text : text + ']';
}

void check_size(Reader& in, const images::Settings& image) {
    const images::Layout layout = layout_of(image, in.loading.config);
    for (const auto& [table, what] : {std::pair(modbus::Table::holding_registers, " registers"),
                                      std::pair(modbus::Table::coils, " bits")})
        if (layout.size(table) > modbus::kTableItems)
            in.problem("points", "an image has at most " + std::to_string(modbus::kTableItems) +
                                     what + ", not " + std::to_string(layout.size(table)));
}

/// The unit must be free at each listener and serial master that serves the image.
void check_unit(Reader& in, const images::Settings& image, const std::string& door,
                const tcp_server::Settings& reach) {
    if (!reach.serves_all(lines_of(image, in.loading.config))) return;
    const std::string unit = "unit " + std::to_string(image.unit);
    const auto clash = [&](const std::string& what) {
        in.problem("unit", unit + " of " + door + " is " + what +
                               " already; an image needs a unit "
                               "of its own");
    };
    if (const auto alias = reach.units.find(image.unit); alias != reach.units.end())
        return clash(alias->second.line + '/' + std::to_string(alias->second.station));
    if (reach.diagnostics_unit == image.unit) return clash("the gateway itself");
    for (const std::string& name : reach.lines) {
        const Line* const line = find_line(in.loading.config, name);
        if (line == nullptr) continue;
        const auto station = std::ranges::find(line->stations, image.unit, &Station::id);
        if (station != line->stations.end()) return clash("station '" + station->name + '\'');
    }
}

}  // namespace

std::optional<images::Settings> load_image(Reader& root, const Node& node) {
    Reader in(root.loading, node, "an image",
              "{name: plant, unit: 100, points: [press/temperature]}");
    images::Settings image;
    image_keys().read(in, image);
    check_unique(in, "image", image.name);
    if (in.has("unit"))
        in.loading.firsts.once(in, "unit", "image unit " + std::to_string(image.unit),
                               "there are two images with unit " + std::to_string(image.unit));
    check_size(in, image);
    for (const tcp_server::Settings& listener : root.loading.config.modbus_tcp)
        check_unit(in, image, "listener " + listener.name(), listener);
    for (const serial_server::Settings& master : root.loading.config.serial_masters)
        check_unit(in, image, "serial master " + master.name, master.access);
    in.finish();
    return image;
}

std::vector<std::string> lines_of(const images::Settings& image, const Config& config) {
    std::vector<std::string> lines;
    for (const Line& line : config.lines) {
        const bool is_shown = std::ranges::any_of(image.entries, [&](const images::Entry& entry) {
            return std::ranges::find(line.stations, entry.station, &Station::name) !=
                   line.stations.end();
        });
        if (is_shown) lines.push_back(line.name);
    }
    return lines;
}

images::Layout layout_of(const images::Settings& image, const Config& config) {
    return {image, [&](std::string_view station, std::string_view point) {
                return point_named(config, station, point);
            }};
}

const Keys<images::Settings>& image_keys() {
    static constexpr Words<images::Stale, 2> kStale{
        {{"exception", images::Stale::exception}, {"last", images::Stale::last}}};
    KeyShape points = shape_of("points", Kind::list,
                               "STATION/POINT of each point in the order of its items, or {skip: "
                               "NUMBER}.");
    points.required = true;
    points.pattern = "^[^/]+/.";
    points.may_be_number = false;
    points.may_be_text = true;
    points.fewest = 1;
    points.example = kPointsExample;
    static const auto kKeys =
        Keys<images::Settings>()
            .text("name", &images::Settings::name, name_form(), "Name of the image; unique.")
            .required()
            .example("plant")
            .integer("unit", &images::Settings::unit, 1, modbus::kMaxListedStation,
                     "Unit id of the image at the listeners and serial masters that serve all its "
                     "lines.")
            .required()
            .example("100")
            .below(points, []() -> const Table& { return entry_keys(); }, read_entries, {})
            .shown_as(entries_text)
            .word("stale", &images::Settings::stale, kStale,
                  "What a read of a point without a good value gets: exception 0B, or the last "
                  "value.")
            .boolean(
                "quality", &images::Settings::quality,
                "Behind each point an item tells its quality: 0 good, 1 stale, 2 bad; behind a "
                "bit 0 good, 1 not.");
    return kKeys;
}

}  // namespace panelgate::config
