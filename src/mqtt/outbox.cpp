#include "panelgate/mqtt/outbox.hpp"

#include <algorithm>
#include <boost/json/object.hpp>
#include <exception>
#include <iterator>
#include <optional>

#include "panelgate/base/text.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::mqtt {
namespace json = boost::json;
namespace {

/// Keys sort as their numbers do.
std::string key_of(std::uint64_t number) {
    const std::string digits = std::to_string(number);
    return std::string(Outbox::kPrefix) + std::string(20 - digits.size(), '0') + digits;
}

std::string text_of(const Subjects& subjects, const Change& change) {
    const Subject& subject = subjects[change.subject];
    const State& state = change.state;
    json::object kept;
    kept["kind"] = static_cast<int>(subject.kind);
    kept["name"] = subject.name;
    if (subject.kind == Subject::Kind::point) kept["station"] = subjects.station_of(change.subject);
    if (state.value) kept["value"] = web::json_of(*state.value);
    kept["text"] = state.text;
    kept["quality"] = static_cast<int>(state.quality);
    kept["time"] = state.time.time_since_epoch().count();
    kept["body"] = state.body;
    return web::json_text(kept);
}

std::optional<std::size_t> subject_of(const Subjects& subjects, const json::object& kept) {
    const std::string name(kept.at("name").as_string());
    switch (static_cast<Subject::Kind>(kept.at("kind").to_number<int>())) {
        case Subject::Kind::line:
            return subjects.find_line(name);
        case Subject::Kind::station:
            return subjects.find_station(name);
        case Subject::Kind::alarm:
            return subjects.find_alarm(name);
        case Subject::Kind::notice:
            return std::nullopt;
        case Subject::Kind::point:
            break;
    }
    return subjects.find_point(std::string_view(kept.at("station").as_string()), name);
}

/// Nothing if the text is none of text_of(), or its subject is gone.
std::optional<std::pair<std::size_t, State>> parse(const Subjects& subjects,
                                                   const std::string& text) try {
    const auto parsed = web::parse_json(text);
    if (!parsed) return std::nullopt;
    const json::object& kept = parsed->as_object();
    const auto subject = subject_of(subjects, kept);
    if (!subject) return std::nullopt;
    State state;
    if (const json::value* value = kept.if_contains("value")) state.value = *web::value_of(*value);
    state.text = kept.at("text").as_string();
    const int quality = kept.at("quality").to_number<int>();
    if (quality < 0 || quality > static_cast<int>(points::Quality::bad)) return std::nullopt;
    state.quality = static_cast<points::Quality>(quality);
    state.time = WallTime(WallTime::duration(kept.at("time").to_number<std::int64_t>()));
    state.body = kept.at("body").as_string();
    return std::pair(*subject, std::move(state));
} catch (const std::exception&) {
    return std::nullopt;
}

}  // namespace

Outbox::Texts Outbox::next(const Publisher& publisher) {
    Texts texts;
    const auto& waits = publisher.store().entries();
    const auto is_full = [&] { return texts.size() >= kTurn; };
    for (; !stale_.empty() && !is_full(); stale_.pop_back()) texts.emplace_back(stale_.back(), "");
    std::erase_if(kept_, [&](std::uint64_t number) {
        if (is_full() || waits.contains(number)) return false;
        texts.emplace_back(key_of(number), "");
        return true;
    });
    if (publisher.is_connected()) return texts;
    auto at = kept_.empty() ? waits.begin() : waits.upper_bound(kept_.back());
    for (; at != waits.end() && !is_full(); ++at) {
        texts.emplace_back(key_of(at->first), text_of(publisher.subjects(), at->second));
        kept_.push_back(at->first);
    }
    return texts;
}

void Outbox::restore(Publisher& publisher, const Texts& kept) {
    for (const auto& [key, text] : kept) {
        const auto number = to_number<std::uint64_t>(std::string_view(key).substr(kPrefix.size()));
        auto change = number ? parse(publisher.subjects(), text) : std::nullopt;
        if (!change) {
            stale_.push_back(key);
            continue;
        }
        kept_.push_back(*number);
        publisher.restore(*number, change->first, std::move(change->second));
    }
}

}  // namespace panelgate::mqtt
