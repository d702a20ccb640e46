#include "panelgate/mqtt/publisher.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "json_topics.hpp"
#include "panelgate/mqtt/home_assistant.hpp"
#include "sparkplug.hpp"

namespace panelgate::mqtt {

namespace {

// Numbers of the three queues
constexpr std::uint64_t kFirstChange = 1;  // 0: not a change
constexpr std::uint64_t kFirstCleared = std::uint64_t{1} << 63;
constexpr std::uint64_t kFirstResult = std::uint64_t{1} << 62;

std::unique_ptr<MessageFormat> make_message_format(const Settings& settings,
                                                   const Subjects& subjects) {
    if (settings.format == Format::sparkplug)
        return std::make_unique<Sparkplug>(settings, subjects);
    return std::make_unique<JsonTopics>(settings, subjects);
}

}  // namespace

Publisher::Publisher(const Settings& settings, Subjects subjects)
    : settings_(settings),
      subjects_(std::make_unique<const Subjects>(std::move(subjects))),
      format_(make_message_format(settings_, *subjects_)),
      states_(subjects_->size()),
      store_(kFirstChange, settings.store),
      results_(kFirstResult),
      cleared_(kFirstCleared) {}

Publisher::~Publisher() = default;

void Publisher::take_over(const Publisher& before) {
    std::vector<std::optional<std::size_t>> here(before.states_.size());
    for (std::size_t i = 0; i < here.size(); ++i) {
        here[i] = subjects_->find_same(*before.subjects_, i);
        if (here[i]) states_[*here[i]] = before.states_[i];
    }
    for (const auto& [number, waits] : before.store_.entries())
        if (here[waits.subject]) restore(number, *here[waits.subject], waits.state);
    if (settings_.broker() != before.settings_.broker()) return;
    for (const auto& [number, message] : before.results_.entries()) results_.add(message);
    clear_stale_topics(before);
}

/// Clears all topics of the previous publisher; earlier ones up to the store's limit.
void Publisher::clear_stale_topics(const Publisher& before) {
    const std::vector<std::string> told = before.format_->retained();
    std::set<std::string> went(told.begin(), told.end());
    const std::size_t most = went.size() + settings_.store;
    for (const auto& [number, message] : before.cleared_.entries())
        if (went.size() < most) went.insert(message.topic);
    for (const std::string& topic : format_->retained()) went.erase(topic);
    for (const std::string& topic : went) cleared_.add({topic, "", 1, true});
    for (std::size_t i = 0; i < subjects_->size(); ++i) {
        const Subject& now = (*subjects_)[i];
        const auto former = before.subjects_->find_notice(now.name);
        if (now.kind != Subject::Kind::notice || !former) continue;
        std::string farewell = home_assistant_farewell((*before.subjects_)[*former].text, now.text);
        if (!farewell.empty()) cleared_.add({now.name, std::move(farewell), 1, true});
    }
}

void Publisher::know(std::size_t subject, State state) {
    if (!states_[subject]) states_[subject] = std::move(state);
}

bool Publisher::offer(std::size_t subject, State state, bool again) {
    std::optional<State>& known = states_[subject];
    if (!again && known && known->same_as(state)) return false;
    known = state;
    change(subject, std::move(state));
    return true;
}

void Publisher::change(std::size_t subject, State state) {
    store_.add({store_.next_number(), subject, std::move(state)});
}

void Publisher::repeat(std::size_t subject) {
    if (states_[subject]) change(subject, *states_[subject]);
}

void Publisher::answer(const WriteResult& result, bool refused) {
    auto message = format_->result(result);
    if (!message) return;
    const std::size_t kept = refused ? std::min(settings_.writes, settings_.results) : 0;
    if (results_.size() + kept >= settings_.results) {
        ++results_dropped_;
    } else {
        results_.add(std::move(*message));
    }
}

void Publisher::connected() {
    connected_ = true;
    again_ = false;
    before_ = 0;
    behind_ = 0;
}

void Publisher::disconnected() {
    store_.lost();
    results_.lost();
    cleared_.lost();
    connected_ = false;
}

void Publisher::rebirth() {
    if (before_ < format_->steps_before()) {
        again_ = before_ > 0;
    } else {
        before_ = 0;
    }
}

void Publisher::delivered(std::uint64_t change) {
    store_.delivered(change);
    results_.delivered(change);
    cleared_.delivered(change);
}

std::optional<Message> Publisher::next_before(WallTime now) {
    while (before_ < format_->steps_before()) {
        auto message = format_->before(before_++, states_, store_.next_number(), now);
        if (before_ == format_->steps_before() && std::exchange(again_, false)) before_ = 0;
        if (message) return message;
    }
    return std::nullopt;
}

std::optional<Message> Publisher::next_behind() {
    while (behind_ < format_->steps_behind()) {
        auto message = format_->behind(behind_++, states_);
        if (message) return message;
    }
    return std::nullopt;
}

std::optional<Publisher::Outgoing> Publisher::next(WallTime now) {
    if (!connected_) return std::nullopt;
    if (auto message = next_before(now)) return Outgoing{std::move(*message)};
    if (const auto* cleared = cleared_.next()) return Outgoing{cleared->second, cleared->first};
    while (const auto* waits = store_.next()) {
        const std::uint64_t number = waits->first;
        auto message = format_->change(waits->second, states_, store_.next_number(), now);
        if (message) return Outgoing{std::move(*message), number};
        store_.delivered(number);  // a birth covers it
    }
    if (const auto* result = results_.next()) return Outgoing{result->second, result->first};
    if (auto message = next_behind()) return Outgoing{std::move(*message)};
    return std::nullopt;
}

}  // namespace panelgate::mqtt
