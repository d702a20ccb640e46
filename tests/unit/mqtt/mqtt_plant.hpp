#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/mqtt/publisher.hpp"

namespace panelgate::mqtt {

inline points::Point point(std::string name, points::Type type) {
    points::Point made;
    made.name = std::move(name);
    made.type = type;
    return made;
}

/// Subject 0: line floor1; 1: station press; 2: its level (scaled, celsius), 3: mode (i16), 4: name
/// (a text); 5: station oven; 6: its level (u32).
inline Subjects small_plant() {
    points::Point level = point("level", points::Type::i16);
    level.scale = 0.1;
    level.unit = "celsius";
    Subjects subjects;
    subjects.add_line("floor1");
    subjects.add_station("press");
    subjects.add_point(level);
    subjects.add_point(point("mode", points::Type::i16));
    subjects.add_point(point("name", points::Type::string));
    subjects.add_station("oven");
    subjects.add_point(point("level", points::Type::u32));
    return subjects;
}

inline constexpr WallTime kNoon{std::chrono::microseconds(1'700'000'000'250'000)};

inline State good(points::Value value, WallTime time = kNoon) {
    State state;
    state.value = std::move(value);
    state.time = time;
    return state;
}

inline State good_number(std::int64_t value) { return good(value); }

inline State station(bool alive, std::string word) {
    State state = good(alive);
    state.text = std::move(word);
    return state;
}

/// Takes all messages due now; changes are then in flight.
inline std::vector<Publisher::Outgoing> take_all(Publisher& publisher, WallTime now = kNoon) {
    std::vector<Publisher::Outgoing> all;
    while (auto outgoing = publisher.next(now)) all.push_back(std::move(*outgoing));
    return all;
}

inline void deliver(Publisher& publisher, const std::vector<Publisher::Outgoing>& all) {
    for (const Publisher::Outgoing& one : all) publisher.delivered(one.change);
}

inline std::vector<std::string> topics(const std::vector<Publisher::Outgoing>& all) {
    std::vector<std::string> names;
    for (const Publisher::Outgoing& one : all) names.push_back(one.message.topic);
    return names;
}

inline std::string hex(std::string_view text) {
    return to_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "");
}

}  // namespace panelgate::mqtt
