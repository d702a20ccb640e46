#include "json_topics.hpp"

#include <boost/json/object.hpp>
#include <utility>

#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::mqtt {
namespace json = boost::json;
namespace {

constexpr std::string_view kSet = "/set";

std::string payload_of(const Subject& subject, const State& state) {
    if (subject.kind == Subject::Kind::alarm) return state.body;
    json::object object;
    if (subject.kind == Subject::Kind::point) {
        object["value"] = nullptr;
        if (state.value) object["value"] = web::json_of(*state.value);
        if (!state.text.empty()) object["label"] = state.text;
        object["quality"] = label(state.quality);
        object["unit"] = subject.unit;
    } else {
        object["state"] = state.text;
    }
    object["time"] = rfc3339(state.time);
    return web::json_text(object);
}

/// Parses a value, or an object with a member `value`.
Command command_of(std::size_t point, std::string_view topic, std::string_view payload) {
    auto parsed = web::parse_json(payload);
    if (!parsed) return BadCommand{std::string(topic), parsed.error().detail};
    std::string id;
    json::value value = *parsed;
    if (const json::object* object = parsed->if_object()) {
        for (const auto& [name, member] : *object) {
            if (name == "value" || name == "id") continue;
            return BadCommand{std::string(topic), "the members are value and id, not " +
                                                      web::excerpt(std::string(name))};
        }
        if (const json::value* told = object->if_contains("id")) id = web::json_text(*told);
        const json::value* given = object->if_contains("value");
        if (given == nullptr) return BadCommand{std::string(topic), "there is no value", id};
        json::value inner = *given;
        value = std::move(inner);
    }
    auto wanted = web::value_of(value);
    if (!wanted) return BadCommand{std::string(topic), wanted.error().detail, id};
    return WriteCommand{point, std::move(*wanted), std::move(id)};
}

}  // namespace

Message JsonTopics::status(std::string payload) const {
    return {settings_.topic + "/status", std::move(payload), 1, true};
}

Message JsonTopics::will() { return status(R"({"state":"offline"})"); }

Message JsonTopics::farewell(WallTime now) {
    return status(web::json_text(json::object{{"state", "offline"}, {"time", rfc3339(now)}}));
}

std::vector<std::string> JsonTopics::subscriptions() const {
    std::vector<std::string> topics;
    if (settings_.write) topics.push_back(settings_.topic + "/+/+/set");
    if (settings_.shared) topics.push_back(status({}).topic);
    return topics;
}

std::vector<std::string> JsonTopics::retained() const {
    std::vector<std::string> topics{status({}).topic};
    for (std::size_t i = 0; i < subjects_.size(); ++i) topics.push_back(name_of(i));
    return topics;
}

std::optional<Message> JsonTopics::before(std::size_t, const States&, std::uint64_t, WallTime now) {
    return status(web::json_text(json::object{{"state", "online"}, {"time", rfc3339(now)}}));
}

std::optional<Message> JsonTopics::behind(std::size_t step, const States& states) {
    const Subject& subject = subjects_[step];
    if (subject.kind == Subject::Kind::notice) return Message{subject.name, subject.text, 1, true};
    if (!states[step]) return std::nullopt;
    return message(step, *states[step]);
}

std::optional<Message> JsonTopics::change(const Change& change, const States&, std::uint64_t,
                                          WallTime) {
    return message(change.subject, change.state);
}

std::string JsonTopics::name_of(std::size_t subject) const {
    const Subject& one = subjects_[subject];
    const std::string top = settings_.topic + '/';
    switch (one.kind) {
        case Subject::Kind::line:
            return top + "line/" + one.name + "/state";
        case Subject::Kind::station:
            return top + "station/" + one.name + "/state";
        case Subject::Kind::notice:
            return one.name;
        case Subject::Kind::alarm:
            return top + "alarm/" + one.name;
        case Subject::Kind::point:
            break;
    }
    return top + subjects_.station_of(subject) + '/' + one.name;
}

Message JsonTopics::message(std::size_t subject, const State& state) const {
    return {name_of(subject), payload_of(subjects_[subject], state), settings_.qos, true};
}

std::string JsonTopics::topic_of(std::size_t point) const {
    return name_of(point) + std::string(kSet);
}

std::vector<Command> JsonTopics::commands(std::string_view topic, std::string_view payload,
                                          bool retained) const {
    std::string_view rest = topic;
    // The last word of the other gateway, while this one publishes.
    if (settings_.shared && topic == status({}).topic)
        return payload.find("offline") != payload.npos ? std::vector<Command>{Rebirth{}}
                                                       : std::vector<Command>{};
    if (!settings_.write || !rest.starts_with(settings_.topic + '/')) return {};
    rest.remove_prefix(settings_.topic.size() + 1);
    if (!rest.ends_with(kSet)) return {};
    rest.remove_suffix(kSet.size());
    const std::size_t slash = rest.find('/');
    if (slash == rest.npos) return {};
    const std::string name(topic);
    if (retained) return {BadCommand{name, "a write must not be retained: its age is unknown"}};
    if (payload.size() > settings_.payload)
        return {BadCommand{name,
                           "a write has at most " + std::to_string(settings_.payload) + " bytes"}};
    const auto point = subjects_.find_point(rest.substr(0, slash), rest.substr(slash + 1));
    if (!point) return {BadCommand{name, "there is no such point"}};
    return {command_of(*point, topic, payload)};
}

std::optional<Message> JsonTopics::result(const WriteResult& result) const {
    std::string payload = result.body;
    if (!result.id.empty()) payload.insert(1, "\"id\":" + result.id + ',');
    return Message{result.topic + "/result", std::move(payload), settings_.qos, false};
}

}  // namespace panelgate::mqtt
