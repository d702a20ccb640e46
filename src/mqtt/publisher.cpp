#include "panelgate/mqtt/publisher.hpp"

#include <set>
#include <utility>

#include "json_topics.hpp"
#include "sparkplug.hpp"

namespace panelgate::mqtt {
namespace {

constexpr std::uint64_t kFirstCleared = std::uint64_t{1} << 63;

std::unique_ptr<Wording> make_wording(const Settings& settings, const Subjects& subjects) {
    if (settings.format == Format::sparkplug)
        return std::make_unique<Sparkplug>(settings, subjects);
    return std::make_unique<JsonTopics>(settings, subjects);
}

}  // namespace

Publisher::Publisher(const Settings& settings, Subjects subjects)
    : settings_(settings),
      subjects_(std::make_unique<const Subjects>(std::move(subjects))),
      wording_(make_wording(settings_, *subjects_)),
      states_(subjects_->size()),
      store_(settings.store) {}

Publisher::~Publisher() = default;

void Publisher::take_over(const Publisher& before) {
    std::vector<std::optional<std::size_t>> here(before.states_.size());
    for (std::size_t i = 0; i < here.size(); ++i) {
        here[i] = subjects_->find_same(*before.subjects_, i);
        if (here[i]) states_[*here[i]] = before.states_[i];
    }
    for (const Change& change : before.store_.changes())
        if (here[change.subject]) store_.add(*here[change.subject], change.state);
    if (settings_.broker() != before.settings_.broker()) return;
    results_ = before.results_;
    awaited_ = before.connected_ || before.awaited_;
    clear_what_went(before);
}

/// All of the one before; of those before it what the store's limit allows.
void Publisher::clear_what_went(const Publisher& before) {
    const std::vector<std::string> told = before.wording_->retained();
    std::set<std::string> went(told.begin(), told.end());
    const std::size_t most = went.size() + settings_.store;
    for (const auto& [number, topic] : before.cleared_)
        if (went.size() < most) went.insert(topic);
    for (const std::string& topic : wording_->retained()) went.erase(topic);
    for (const std::string& topic : went) cleared_.emplace(kFirstCleared + cleared_.size(), topic);
}

void Publisher::know(std::size_t subject, State state) {
    if (!states_[subject]) states_[subject] = std::move(state);
}

bool Publisher::offer(std::size_t subject, State state) {
    std::optional<State>& known = states_[subject];
    if (known && known->same_as(state)) return false;
    known = state;
    store_.add(subject, std::move(state));
    return true;
}

void Publisher::repeat(std::size_t subject) {
    if (states_[subject]) store_.add(subject, *states_[subject]);
}

void Publisher::answer(const WriteResult& result) {
    if ((!connected_ && !awaited_) || results_.size() >= settings_.results) return;
    if (auto message = wording_->result(result)) results_.push_back(std::move(*message));
}

void Publisher::connected() {
    connected_ = true;
    awaited_ = false;
    again_ = false;
    before_ = 0;
    behind_ = 0;
    next_cleared_ = kFirstCleared;
}

void Publisher::disconnected() {
    store_.lost();
    if (connected_) results_.clear();  // who has asked has gone as well
    connected_ = false;
}

void Publisher::rebirth() {
    if (before_ < wording_->steps_before()) {
        again_ = before_ > 0;
    } else {
        before_ = 0;
    }
}

void Publisher::delivered(std::uint64_t change) {
    store_.delivered(change);
    cleared_.erase(change);
}

std::optional<Message> Publisher::next_before(WallTime now) {
    while (before_ < wording_->steps_before()) {
        auto message = wording_->before(before_++, states_, store_.next_number(), now);
        if (before_ == wording_->steps_before() && std::exchange(again_, false)) before_ = 0;
        if (message) return message;
    }
    return std::nullopt;
}

std::optional<Publisher::Outgoing> Publisher::next_cleared() {
    const auto found = cleared_.lower_bound(next_cleared_);
    if (found == cleared_.end()) return std::nullopt;
    next_cleared_ = found->first + 1;
    return Outgoing{{found->second, "", 1, true}, found->first};
}

std::optional<Message> Publisher::next_behind() {
    while (behind_ < wording_->steps_behind()) {
        auto message = wording_->behind(behind_++, states_);
        if (message) return message;
    }
    return std::nullopt;
}

std::optional<Publisher::Outgoing> Publisher::next(WallTime now) {
    if (!connected_) return std::nullopt;
    if (auto message = next_before(now)) return Outgoing{std::move(*message)};
    if (auto cleared = next_cleared()) return cleared;
    while (const Change* change = store_.next()) {
        auto message = wording_->change(*change, states_, store_.next_number(), now);
        if (!message) {
            store_.skip();
            continue;
        }
        const std::uint64_t number = change->number;
        store_.sent();
        return Outgoing{std::move(*message), number};
    }
    if (!results_.empty()) {
        Outgoing result{std::move(results_.front())};
        results_.pop_front();
        return result;
    }
    if (auto message = next_behind()) return Outgoing{std::move(*message)};
    return std::nullopt;
}

}  // namespace panelgate::mqtt
