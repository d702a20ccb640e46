#include "sight.hpp"

#include <algorithm>

#include "panelgate/base/text.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/web/api/render.hpp"

namespace panelgate::web {

namespace {

using access::Act;
using modbus::Span;

/// Stands for stations that nobody has listed.
constexpr std::uint8_t kUnlisted = 0;

/// What hides something of the station.
access::Verdict hiding(const LineEntry& line, const WhoRef& who, std::uint8_t id) {
    for (const modbus::Table table : modbus::kTables) {
        const Span all{table, 0, modbus::kTableItems};
        const auto verdict =
            line.access->judge(who, id, Act::read, modbus::read_function(table), all);
        if (!verdict.allowed) return verdict;
    }
    return {.allowed = false};
}

/// Counts it as a denial, too.
Problem denied(const LineEntry& line, const WhoRef& who, std::uint8_t id,
               const std::string& station) {
    const access::Verdict verdict = hiding(line, who, id);
    line.bus->count_denied(verdict.rule_name());
    return problem_of(bus::denial(verdict, station));
}

/// The client, who may read as well if its own role has this right: as far as rules allow it.
WhoRef as_reader(const HttpRequest& request, Right right) {
    const WhoRef& who = request.caller->who();
    if (!who->standing.own || !who->standing.may(right)) return who;
    Who reader = *who;
    reader.standing.own->rights.add(Right::read);
    return make_who(std::move(reader));
}

}  // namespace

bool Sight::everything() const {
    return std::ranges::all_of(directory_.lines,
                               [&](const LineEntry& line) { return whole(line); });
}

/// A role of the configuration may be without.
bool Sight::reads() const {
    return !who_ || !who_->standing.own || who_->standing.may(Right::read);
}

bool Sight::line(const LineEntry& line) const {
    if (!line.access || !reads()) return reads();
    if (line.access->is_open()) return true;
    bool listed = false;
    for (const StationEntry& one : directory_.stations) {
        if (one.line != line.name) continue;
        if (station(line, one.id)) return true;
        listed = true;
    }
    return !listed && station(line, kUnlisted);
}

bool Sight::whole(const LineEntry& line) const {
    if (!line.access || !reads()) return reads();
    if (line.access->is_open()) return true;
    const bool listed = std::ranges::all_of(directory_.stations, [&](const StationEntry& one) {
        return one.line != line.name || whole(line, one.id);
    });
    return listed && whole(line, kUnlisted);
}

bool Sight::station(const LineEntry& line, std::uint8_t id) const {
    return !line.access || line.access->may_some(who_, id, Act::read);
}

bool Sight::station(const StationEntry& one) const {
    const LineEntry* line = directory_.find_line(one.line);
    return line == nullptr || station(*line, one.id);
}

bool Sight::whole(const LineEntry& line, std::uint8_t id) const {
    return !line.access || line.access->may_all(who_, id, Act::read);
}

bool Sight::point(const StationEntry& station, const points::Point& point) const {
    const LineEntry* line = directory_.find_line(station.line);
    if (line == nullptr || !line->access) return true;
    return line->access
        ->judge(who_, station.id, Act::read, modbus::read_function(point.table),
                Span{point.table, point.address, point.count()})
        .allowed;
}

bool Sight::concerns(const StationEntry& one, std::string_view name) const {
    const LineEntry* on = directory_.find_line(one.line);
    if (on == nullptr || !on->access) return true;
    const points::Point* const named = one.points != nullptr ? one.points->find(name) : nullptr;
    if (named == nullptr)
        return station(*on, one.id) || on->access->may_some(who_, one.id, Act::write);
    const Span items{named->table, named->address, named->count()};
    const auto writes = [&](std::uint8_t function) {
        return on->access->judge(who_, one.id, Act::write, function, items).allowed;
    };
    const bool bits = modbus::is_bit_table(named->table);
    return point(one, *named) ||
           writes(bits ? modbus::kWriteMultipleCoils : modbus::kWriteMultipleRegisters) ||
           writes(bits ? modbus::kWriteSingleCoil : modbus::kWriteSingleRegister);
}

const StationEntry* Sight::find(std::string_view line, std::string_view station) const {
    const auto found = std::ranges::find_if(directory_.stations, [&](const StationEntry& one) {
        return one.name == station && (line.empty() || one.line == line);
    });
    return found == directory_.stations.end() ? nullptr : &*found;
}

bool Sight::named(std::string_view line_name, std::string_view station_name,
                  std::string_view point_name) const {
    if (line_name.empty()) return true;
    const LineEntry* on = directory_.find_line(line_name);
    if (on == nullptr || !line(*on)) return on == nullptr && everything();
    if (station_name.empty() || station_name == kAllStations) return true;
    const StationEntry* one = find(line_name, station_name);
    if (one == nullptr)
        return station(*on, to_number<std::uint8_t>(station_name).value_or(kUnlisted));
    if (point_name.empty() || one->points == nullptr) return station(*one);
    const points::Point* const named = one->points->find(point_name);
    return named == nullptr ? whole(*on, one->id) : point(*one, *named);
}

bool Sight::event(const EventTopic& topic) const {
    if (!topic.station.empty()) return named(topic.line, topic.station, topic.point);
    if (!topic.about.empty()) return named(topic.line, topic.about, "");
    const LineEntry* on = directory_.find_line(topic.line);
    if (on == nullptr) return everything();
    // What others tell may be about any of the line's stations.
    return topic.type == "line" ? line(*on) : whole(*on);
}

namespace {

std::optional<Problem> check_line(const LineEntry& line, const Directory& directory,
                                  const Sight& sight, bool whole) {
    if (whole ? sight.whole(line) : sight.line(line)) return std::nullopt;
    const auto hidden = std::ranges::find_if(directory.stations, [&](const StationEntry& one) {
        return one.line == line.name && !sight.whole(line, one.id);
    });
    const bool none = hidden == directory.stations.end();
    return denied(line, sight.who(), none ? kUnlisted : hidden->id, "");
}

}  // namespace

std::optional<Problem> check_sight(const HttpRequest& request, const Directory& directory,
                                   Shown shown, Right right) {
    if (shown == Shown::nothing) return std::nullopt;
    const Sight sight(directory, as_reader(request, right));
    const std::string& name = request.arguments[0];
    if (shown == Shown::line || shown == Shown::whole_line) {
        const LineEntry* line = directory.find_line(name);
        if (line == nullptr) return std::nullopt;
        return check_line(*line, directory, sight, shown == Shown::whole_line);
    }
    const auto station = directory.find_station(name);
    const LineEntry* line = station ? directory.find_line(station->line) : nullptr;
    if (line == nullptr) return std::nullopt;
    const points::Point* const point = shown == Shown::point && station->points != nullptr
                                           ? station->points->find(request.arguments[1])
                                           : nullptr;
    const bool seen =
        point != nullptr ? sight.point(*station, *point) : sight.station(*line, station->id);
    if (seen) return std::nullopt;
    return denied(*line, sight.who(), station->id, station->name);
}

std::optional<Problem> instead_of_telling(std::string_view station, std::string_view point,
                                          const WhoRef& who, const Directory& directory) {
    const auto one = directory.find_station(station);
    if (!one || Sight(directory, who).concerns(*one, point)) return std::nullopt;
    const LineEntry* on = directory.find_line(one->line);
    return denied(*on, who, one->id, one->name);
}

std::optional<Problem> instead_of_telling(const std::vector<std::string>& path, const WhoRef& who,
                                          const Directory& directory) {
    if (path.size() < 5 || path[0] != "api" || path[2] != "stations") return std::nullopt;
    const bool names_point = path.size() > 5 && path[4] == "points";
    return instead_of_telling(path[3], names_point ? std::string_view(path[5]) : "", who,
                              directory);
}

namespace {

/// The value of a label in a line of the exposition; names have no quotes. "" if it has none.
std::string_view label_in(std::string_view line, std::string_view name) {
    for (const char before : {'{', ','}) {
        const std::string wanted = before + std::string(name) + "=\"";
        const auto at = line.find(wanted);
        if (at == line.npos) continue;
        const std::string_view rest = line.substr(at + wanted.size());
        return rest.substr(0, rest.find('"'));
    }
    return "";
}

bool is_seen(std::string_view line, const Sight& sight) {
    if (line.starts_with('#')) return true;
    if (!label_in(line, "relay").empty()) return false;
    for (const std::string_view whose : {"rule", "token", "name"})
        if (!label_in(line, whose).empty()) return sight.everything();
    return sight.named(label_in(line, "line"), label_in(line, "station"), label_in(line, "point"));
}

}  // namespace

std::string seen_metrics(std::string_view text, const Sight& sight) {
    std::string seen;
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size() - 1) + 1;
        const std::string_view line = text.substr(0, end);
        if (is_seen(line, sight)) seen += line;
        text.remove_prefix(end);
    }
    return seen;
}

}  // namespace panelgate::web
