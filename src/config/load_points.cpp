#include <array>

#include "load_stations.hpp"

namespace panelgate::config {
namespace {

using yaml::MapReader;
using yaml::Node;

void check_poll(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a poll");
    in.required_text("read");
    in.integer("count", 1, 2040);  // the largest read of any panel: GT, ARCT1F501E 1.3.1
    in.duration("every", 1ms, 24h);
    in.finish();
}

void check_point(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a point");
    in.required_text("name");
    in.required_text("at");
    in.text("type");
    in.number("scale");
    in.text("unit");
    constexpr std::array<std::string_view, 4> kOrders{"ABCD", "BADC", "CDAB", "DCBA"};
    in.choice_index("word_order", kOrders);
    in.boolean("writable");
    in.number("min");
    in.number("max");
    in.finish();
}

}  // namespace

void check_points(Loading& loading, MapReader& station) {
    if (const Node* list = station.sequence("poll")) {
        for (const Node& item : list->items) check_poll(loading, item);
        loading.warn(station.mark("poll"), "poll is read but nothing is polled in this version");
    }
    if (const Node* list = station.sequence("points")) {
        for (const Node& item : list->items) check_point(loading, item);
        loading.warn(station.mark("points"), "points are read but not polled in this version");
    }
}

}  // namespace panelgate::config
