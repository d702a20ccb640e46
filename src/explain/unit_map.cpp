#include "panelgate/explain/unit_map.hpp"

#include "panelgate/images/settings.hpp"

namespace panelgate::explain {

tcp_server::LineInfo line_info(const config::Line& line, Unlisted unlisted) {
    tcp_server::LineInfo info;
    info.name = line.name;
    info.pass_unlisted = unlisted == Unlisted::as_the_line && !line.refuse_unlisted;
    for (const config::Station& station : line.stations) info.stations.push_back(station.id);
    return info;
}

tcp_server::LineInfo image_info(const images::Settings& image, const config::Config& config) {
    tcp_server::LineInfo info;
    info.name = "image " + image.name;  // no line can be called so
    info.stations = {image.unit};
    info.shows = config::lines_of(image, config);
    return info;
}

tcp_server::UnitMap unit_map(const tcp_server::Settings& listener, const config::Config& config,
                             Unlisted unlisted) {
    std::vector<tcp_server::LineInfo> lines;
    for (const config::Line& line : config.lines) lines.push_back(line_info(line, unlisted));
    for (const images::Settings& image : config.images) lines.push_back(image_info(image, config));
    return {listener, lines};
}

}  // namespace panelgate::explain
