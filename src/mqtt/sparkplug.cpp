#include "sparkplug.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

namespace panelgate::mqtt {
namespace {

constexpr std::string_view kRebirth = "Node Control/Rebirth";
constexpr std::uint64_t kDeaths = 256;  // bdSeq is 0..255 (Sparkplug 3.0, 5.4)

/// By points::Type; a byte or 48 bits as the next larger one.
constexpr std::array kTypes{
    DataType::boolean, DataType::uint16, DataType::uint16, DataType::int16,   DataType::int16,
    DataType::uint16,  DataType::int16,  DataType::uint32, DataType::int32,   DataType::uint64,
    DataType::int64,   DataType::uint64, DataType::int64,  DataType::float32, DataType::float32,
    DataType::float64, DataType::uint16, DataType::uint32, DataType::string};
static_assert(kTypes.size() == std::size(points::kTypes));

DataType type_of(const Subject& subject) {
    if (subject.kind == Subject::Kind::line) return DataType::boolean;
    const DataType plain = kTypes.at(static_cast<std::size_t>(subject.type));
    const bool is_number = plain != DataType::boolean && plain != DataType::string;
    return subject.scaled && is_number ? DataType::float64 : plain;
}

bool is_alive(const std::optional<State>& station) {
    const bool* alive = station && station->value ? std::get_if<bool>(&*station->value) : nullptr;
    return alive == nullptr || *alive;
}

}  // namespace

Sparkplug::Sparkplug(const Settings& settings, const Subjects& subjects)
    : settings_(settings), subjects_(subjects) {
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
        if (subjects_[i].kind == Subject::Kind::station && subjects_.end_of(i) > i + 1)
            devices_.push_back(i);
    }
}

std::string Sparkplug::topic(std::string_view kind, std::string_view device) const {
    std::string text =
        "spBv1.0/" + settings_.group + '/' + std::string(kind) + '/' + settings_.node;
    if (!device.empty()) text += '/' + std::string(device);
    return text;
}

Message Sparkplug::message(std::string_view kind, std::string_view device,
                           const std::vector<Metric>& metrics, WallTime now) {
    return {topic(kind, device), sparkplug_payload(now, metrics, seq_++), 0, false};
}

Message Sparkplug::death(WallTime now) const {
    Metric number;
    number.name = "bdSeq";
    number.type = DataType::int64;
    number.value = death_;
    number.time = now;
    return {topic("NDEATH"), sparkplug_payload(now, {number}, std::nullopt), 1, false};
}

Message Sparkplug::will() {
    death_ = next_death_;
    next_death_ = (next_death_ + 1) % kDeaths;
    return death({});
}

Message Sparkplug::farewell(WallTime now) { return death(now); }

std::vector<std::string> Sparkplug::subscriptions() const {
    std::vector<std::string> filters{topic("NCMD")};
    if (settings_.write) filters.push_back(topic("DCMD", "+"));
    return filters;
}

Metric Sparkplug::metric(std::size_t subject, const std::optional<State>& state, bool birth,
                         WallTime now) const {
    const Subject& one = subjects_[subject];
    Metric made;
    made.alias = subject;
    made.type = type_of(one);
    made.time = state ? state->time : now;
    if (state) made.value = state->value;
    if (birth) {
        made.name = one.kind == Subject::Kind::line ? "Lines/" + one.name + "/Up" : one.name;
        made.unit = one.unit;
    }
    if (one.kind == Subject::Kind::point)
        made.quality = state ? state->quality : points::Quality::bad;
    return made;
}

Message Sparkplug::node_birth(const States& states, std::uint64_t next_change, WallTime now) {
    seq_ = 0;
    node_ = {true, next_change};
    for (auto& [station, birth] : stations_) birth.alive = false;
    std::vector<Metric> metrics(2);
    metrics[0].name = "bdSeq";
    metrics[0].type = DataType::int64;
    metrics[0].value = death_;
    metrics[0].time = now;
    metrics[1].name = kRebirth;
    metrics[1].value = false;
    metrics[1].time = now;
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
        if (subjects_[i].kind == Subject::Kind::line)
            metrics.push_back(metric(i, states[i], true, now));
    }
    return message("NBIRTH", {}, metrics, now);
}

Message Sparkplug::device_birth(std::size_t station, const States& states,
                                std::uint64_t next_change, WallTime now) {
    stations_[station] = {true, next_change};
    std::vector<Metric> metrics;
    for (std::size_t i = station + 1; i < subjects_.end_of(station); ++i)
        metrics.push_back(metric(i, states[i], true, now));
    return message("DBIRTH", subjects_[station].name, metrics, now);
}

std::optional<Message> Sparkplug::before(std::size_t step, const States& states,
                                         std::uint64_t next_change, WallTime now) {
    if (step == 0) return node_birth(states, next_change, now);
    const std::size_t station = devices_[step - 1];
    if (!is_alive(states[station])) return std::nullopt;
    return device_birth(station, states, next_change, now);
}

std::optional<Message> Sparkplug::station_change(const Change& change, const States& states,
                                                 std::uint64_t next_change, WallTime now) {
    const std::size_t station = change.subject;
    if (change.number < node_.next_change || std::ranges::find(devices_, station) == devices_.end())
        return std::nullopt;
    Birth& birth = stations_[station];
    if (is_alive(change.state) == birth.alive) return std::nullopt;
    if (!birth.alive) return device_birth(station, states, next_change, now);
    birth.alive = false;
    return message("DDEATH", subjects_[station].name, {}, now);
}

std::optional<Message> Sparkplug::change(const Change& change, const States& states,
                                         std::uint64_t next_change, WallTime now) {
    const Subject& subject = subjects_[change.subject];
    if (subject.kind == Subject::Kind::station)
        return station_change(change, states, next_change, now);
    const bool of_line = subject.kind == Subject::Kind::line;
    const Birth& birth = of_line ? node_ : stations_[subject.station];
    const bool historical = change.number < birth.next_change;
    if (!birth.alive || (of_line && historical)) return std::nullopt;
    Metric made = metric(change.subject, change.state, false, now);
    made.historical = historical;
    if (of_line) return message("NDATA", {}, {made}, now);
    return message("DDATA", subjects_[subject.station].name, {made}, now);
}

std::string Sparkplug::topic_of(std::size_t point) const {
    return topic("DCMD", subjects_.station_of(point));
}

std::vector<Command> Sparkplug::device_commands(std::size_t station, std::string_view topic,
                                                const std::vector<ReceivedMetric>& metrics) const {
    std::vector<Command> commands;
    for (const ReceivedMetric& heard : metrics) {
        std::optional<std::size_t> point;
        if (!heard.name.empty()) point = subjects_.find_point(station, heard.name);
        if (heard.name.empty() && heard.alias && *heard.alias > station &&
            *heard.alias < subjects_.end_of(station))
            point = static_cast<std::size_t>(*heard.alias);
        if (!point) {
            commands.emplace_back(BadCommand{std::string(topic), "there is no such metric"});
            continue;
        }
        auto value = value_of(heard, type_of(subjects_[*point]));
        if (value) {
            commands.emplace_back(WriteCommand{*point, std::move(*value)});
        } else {
            commands.emplace_back(BadCommand{std::string(topic), "the metric has no value"});
        }
    }
    return commands;
}

std::vector<Command> Sparkplug::commands(std::string_view topic, std::string_view payload,
                                         bool retained) const {
    const std::string name(topic);
    const bool to_node = name == this->topic("NCMD");
    const std::string devices = this->topic("DCMD") + '/';
    if (!to_node && (!settings_.write || !name.starts_with(devices))) return {};
    if (retained) return {BadCommand{name, "a command must not be retained: its age is unknown"}};
    const auto metrics = payload.size() <= settings_.payload
                             ? parse_sparkplug(payload, settings_.metrics)
                             : std::nullopt;
    if (!metrics) return {BadCommand{name, "this is no payload of Sparkplug B, or too long"}};
    if (!to_node) {
        const auto station = subjects_.find_station(topic.substr(devices.size()));
        if (!station) return {BadCommand{name, "there is no such device"}};
        return device_commands(*station, topic, *metrics);
    }
    for (const ReceivedMetric& heard : *metrics) {
        const bool* wanted = heard.value ? std::get_if<bool>(&*heard.value) : nullptr;
        if (heard.name == kRebirth && wanted != nullptr && *wanted) return {Rebirth{}};
    }
    return {};
}

}  // namespace panelgate::mqtt
