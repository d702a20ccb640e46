#include "panelgate/mqtt/subjects.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::mqtt {

void Subjects::add_line(std::string name) {
    Subject line;
    line.kind = Subject::Kind::line;
    line.name = std::move(name);
    all_.push_back(std::move(line));
}

void Subjects::add_station(std::string name) {
    Subject station;
    station.kind = Subject::Kind::station;
    station.name = std::move(name);
    station.station = all_.size();
    all_.push_back(std::move(station));
}

void Subjects::add_point(const points::Point& point) {
    Subject made;
    made.name = point.name;
    made.station = all_.back().station;
    made.unit = point.unit;
    made.type = point.bit ? points::Type::boolean : point.type;
    made.scaled = point.scale != 1 || point.offset != 0;
    all_.push_back(std::move(made));
}

void Subjects::add_alarm(std::string name) {
    Subject made;
    made.kind = Subject::Kind::alarm;
    made.name = std::move(name);
    all_.push_back(std::move(made));
}

void Subjects::add_notice(std::string topic, std::string payload) {
    Subject made;
    made.kind = Subject::Kind::notice;
    made.name = std::move(topic);
    made.text = std::move(payload);
    all_.push_back(std::move(made));
}

std::size_t Subjects::end_of(std::size_t station) const {
    std::size_t end = station + 1;
    while (end < all_.size() && all_[end].kind == Subject::Kind::point) ++end;
    return end;
}

std::optional<std::size_t> Subjects::find(Subject::Kind kind, std::string_view name) const {
    const auto found = std::ranges::find_if(
        all_, [&](const Subject& one) { return one.kind == kind && one.name == name; });
    if (found == all_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - all_.begin());
}

std::optional<std::size_t> Subjects::find_same(const Subjects& others, std::size_t subject) const {
    const Subject& one = others[subject];
    if (one.kind != Subject::Kind::point) return find(one.kind, one.name);
    return find_point(others.station_of(subject), one.name);
}

std::optional<std::size_t> Subjects::find_line(std::string_view name) const {
    return find(Subject::Kind::line, name);
}

std::optional<std::size_t> Subjects::find_station(std::string_view name) const {
    return find(Subject::Kind::station, name);
}

std::optional<std::size_t> Subjects::find_alarm(std::string_view name) const {
    return find(Subject::Kind::alarm, name);
}

std::optional<std::size_t> Subjects::find_notice(std::string_view topic) const {
    return find(Subject::Kind::notice, topic);
}

std::optional<std::size_t> Subjects::find_point(std::size_t station, std::string_view name) const {
    for (std::size_t i = station + 1; i < end_of(station); ++i)
        if (all_[i].name == name) return i;
    return std::nullopt;
}

std::optional<std::size_t> Subjects::find_point(std::string_view station,
                                                std::string_view name) const {
    const auto found = find_station(station);
    return found ? find_point(*found, name) : std::nullopt;
}

}  // namespace panelgate::mqtt
