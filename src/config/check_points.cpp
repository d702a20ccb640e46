#include "check_points.hpp"

#include <string>

namespace panelgate::config {
namespace {

using points::Point;
using points::Type;

void warn_of_limits(Loading& loading, yaml::MapReader& in, const Point& point) {
    if (point.writable || (!point.min && !point.max)) return;
    const std::string key = point.min ? "min" : "max";
    const std::string keys = point.min && point.max ? "min and max" : key;
    loading.warn(in.mark(key), keys + (keys == key ? " has" : " have") +
                                   " no effect: what is written is limited, and the point is not "
                                   "writable; add writable: true, or leave " +
                                   keys + " out");
}

/// CDAB turns words round, and nothing else; strings keep the order of theirs.
void warn_of_order(Loading& loading, yaml::MapReader& in, const Point& point) {
    const bool turns = points::registers_of(point.type) > 1 && point.type != Type::string;
    if (point.type == Type::boolean || turns || point.word_order != points::WordOrder::cdab) return;
    const std::string why = point.type == Type::string
                                ? "a string keeps the order of its words"
                                : std::string(label(point.type)) + " is one word";
    loading.warn(in.mark("word_order"), "word_order: CDAB has no effect: " + why +
                                            "; leave it out, or write BADC to turn the bytes of "
                                            "each word");
}

}  // namespace

void warn_of_idle_keys(Loading& loading, yaml::MapReader& in, const Point& point) {
    warn_of_limits(loading, in, point);
    warn_of_order(loading, in, point);
}

}  // namespace panelgate::config
