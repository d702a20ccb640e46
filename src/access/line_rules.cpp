#include "panelgate/access/line_rules.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace panelgate::access {

namespace {

using modbus::Span;

constexpr std::size_t kMeetings = 2048;  ///< remembered; then all are forgotten
constexpr std::size_t kAddresses = modbus::kMaxStation + std::size_t{1};

template <class List, class Value>
bool holds(const List& list, const Value& value) {
    return std::ranges::find(list, value) != list.end();
}

bool is_trusted(const WhoRef& who) { return who && who->face == Face::gateway; }

bool is_named(const Rule& rule, std::uint8_t function) { return holds(rule.functions, function); }

/// True if the rule speaks of this act by this function.
bool is_about(const Rule& rule, Act act, std::uint8_t function) {
    if (!rule.acts.has(act)) return false;
    return rule.functions.empty() || is_named(rule, function);
}

/// A request for no items still names a place.
std::optional<Span> with_items(std::optional<Span> span) {
    if (span && span->count == 0) span->count = 1;
    return span;
}

modbus::Function function_for(Act act, modbus::Table table) {
    if (act == Act::read) return modbus::read_function(table);
    return table == modbus::Table::coils ? modbus::kWriteMultipleCoils
                                         : modbus::kWriteMultipleRegisters;
}

bool can_be(Act act, modbus::Table table) {
    return act == Act::read || table == modbus::Table::coils ||
           table == modbus::Table::holding_registers;
}

}  // namespace

LineRules::LineRules(std::shared_ptr<const Settings> settings, std::string line,
                     std::vector<std::uint8_t> listed)
    : settings_(std::move(settings)), line_(std::move(line)), listed_(std::move(listed)) {
    for (const Rule& rule : settings_->rules) {
        unlisted_items_.emplace_back();
        if (rule.unlisted_items) unlisted_items_.back().push_back(*rule.unlisted_items);
    }
    meetings_.resize(kAddresses);
}

Verdict LineRules::judge(const WhoRef& who, const Question& question) const {
    if (is_open() || is_trusted(who)) return {};
    if (question.station != 0) return judge_request(who, question.station, question);
    // It reaches everybody: without a listed station, those that nobody knows.
    if (listed_.empty()) return judge_request(who, 0, question);
    Verdict verdict;
    for (const std::uint8_t station : listed_) {
        verdict = judge_request(who, station, question);
        if (!verdict.allowed) return verdict;
    }
    return verdict;
}

Verdict LineRules::judge_request(const WhoRef& who, std::uint8_t station,
                                 const Question& question) const {
    const Meeting& meeting = meet(who, station);
    std::optional<Act> besides;
    if (question.raw) besides = Act::raw;
    Verdict verdict = judge_as(meeting, *question.asked, besides);
    if (verdict.allowed && question.station == 0)
        verdict = judge_as(meeting, *question.asked, Act::broadcast);
    if (verdict.allowed && question.sent != nullptr)
        verdict = judge_as(meeting, *question.sent, besides);
    return verdict;
}

/// `besides`: what the request is as well, with the same items.
Verdict LineRules::judge_as(const Meeting& meeting, const modbus::Request& request,
                            std::optional<Act> besides) const {
    const std::uint8_t function = request.function();
    // 18h names a queue, not the registers that it reads.
    const bool names_items = function != modbus::kReadFifoQueue;
    const modbus::Access access = names_items ? request.access() : modbus::Access{};
    const std::optional<Span> read = with_items(access.read);
    const std::optional<Span> written = with_items(access.write);
    Verdict verdict;
    const auto ask = [&](Act act, const std::optional<Span>& items) {
        if (verdict.allowed) verdict = decide(meeting, act, function, items);
        if (verdict.allowed && besides) verdict = decide(meeting, *besides, function, items);
    };
    if (!read && !written) ask(request.is_read() ? Act::read : Act::write, std::nullopt);
    if (read) ask(Act::read, read);
    if (written) ask(Act::write, written);
    return verdict;
}

Verdict LineRules::judge(const WhoRef& who, std::uint8_t station, Act act, std::uint8_t function,
                         const std::optional<Span>& items) const {
    if (is_open() || is_trusted(who)) return {};
    return decide(meet(who, station), act, function, with_items(items));
}

Verdict LineRules::decide(const Meeting& meeting, Act act, std::uint8_t function,
                          const std::optional<Span>& items) const {
    if (items) return decide_items(meeting, act, function, *items);
    for (const Applied& applied : meeting.rules) {
        const Rule& rule = *applied.rule;
        // A rule about items says nothing of a function without items, unless it names it.
        if (rule.has_range() && !is_named(rule, function)) continue;
        if (is_about(rule, act, function)) return {rule.allow, &rule, act};
    }
    return by_default(act);
}

/// Each item is decided by the first rule that matches it; one that is denied denies them all.
Verdict LineRules::decide_items(const Meeting& meeting, Act act, std::uint8_t function,
                                const Span& items) const {
    left_.assign(1, {items.first, items.end()});
    for (const Applied& applied : meeting.rules) {
        const Rule& rule = *applied.rule;
        if (!is_about(rule, act, function)) continue;
        if (applied.items == nullptr) return {rule.allow, &rule, act};
        for (const Span& span : *applied.items) {
            if (span.table == items.table && take_out(span) && !rule.allow)
                return {false, &rule, act};
        }
        if (left_.empty()) return {true, &rule, act};
    }
    return by_default(act);
}

bool LineRules::take_out(const Span& items) const {
    bool any = false;
    for (std::size_t i = 0; i < left_.size();) {
        const Interval part = left_[i];
        const std::uint32_t first = std::max(part.first, items.first);
        const std::uint32_t end = std::min(part.end, items.end());
        if (first >= end) {
            ++i;
            continue;
        }
        any = true;
        const Interval before{part.first, first};
        const Interval behind{end, part.end};
        left_[i] = left_.back();
        left_.pop_back();
        // What remains of it cannot overlap these items again.
        if (before.first < before.end) left_.push_back(before);
        if (behind.first < behind.end) left_.push_back(behind);
    }
    return any;
}

Verdict LineRules::by_default(Act act) const { return {settings_->allow_by_default, nullptr, act}; }

bool LineRules::may_some(const WhoRef& who, std::uint8_t station, Act act) const {
    if (is_open() || is_trusted(who)) return true;
    Meeting& meeting = meet(who, station);
    if (act == Act::read && meeting.reads_some) return *meeting.reads_some;
    const bool some = std::ranges::any_of(modbus::kTables, [&](modbus::Table table) {
        return can_be(act, table) && some_allowed(meeting, act, table);
    });
    if (act == Act::read) meeting.reads_some = some;
    return some;
}

bool LineRules::some_allowed(const Meeting& meeting, Act act, modbus::Table table) const {
    left_.assign(1, {0, modbus::kTableItems});
    for (const Applied& applied : meeting.rules) {
        const Rule& rule = *applied.rule;
        if (!is_about(rule, act, function_for(act, table))) continue;
        if (applied.items == nullptr) return rule.allow;
        for (const Span& span : *applied.items) {
            if (span.table == table && take_out(span) && rule.allow) return true;
        }
        if (left_.empty()) return false;
    }
    return settings_->allow_by_default;
}

bool LineRules::may_read_some(const WhoRef& who) const {
    if (listed_.empty()) return may_some(who, 0, Act::read);
    return std::ranges::any_of(
        listed_, [&](std::uint8_t station) { return may_some(who, station, Act::read); });
}

bool LineRules::reads_all(const WhoRef& who, std::uint8_t station) const {
    if (is_open() || is_trusted(who)) return true;
    Meeting& meeting = meet(who, station);
    if (!meeting.reads_all) meeting.reads_all = may_all(who, station, Act::read);
    return *meeting.reads_all;
}

bool LineRules::may_all(const WhoRef& who, std::uint8_t station, Act act) const {
    if (is_open() || is_trusted(who)) return true;
    const Meeting& meeting = meet(who, station);
    return std::ranges::all_of(modbus::kTables, [&](modbus::Table table) {
        const Span all{table, 0, modbus::kTableItems};
        return !can_be(act, table) ||
               decide_items(meeting, act, function_for(act, table), all).allowed;
    });
}

std::vector<std::string> LineRules::denying_names() const {
    std::vector<std::string> names;
    if (is_open()) return names;
    for (const Rule& rule : settings_->rules) {
        if (!rule.allow) names.push_back(rule.name);
    }
    names.emplace_back(kDefaultRule);
    return names;
}

LineRules::Meeting& LineRules::meet(const WhoRef& who, std::uint8_t station) const {
    Meetings& known = meetings_[station];
    if (const auto found = known.find(who.get()); found != known.end()) return *found->second;
    if (met_ >= kMeetings) {
        for (Meetings& all : meetings_) all.clear();
        met_ = 0;
    }
    ++met_;
    auto made = std::make_unique<Meeting>(Meeting{who, rules_for(who, station)});
    return *known.emplace(who.get(), std::move(made)).first->second;
}

std::vector<LineRules::Applied> LineRules::rules_for(const WhoRef& who,
                                                     std::uint8_t station) const {
    static const Who kNobody{};
    const Place place{line_, station};
    std::vector<Applied> applied;
    for (std::size_t i = 0; i < settings_->rules.size(); ++i) {
        const Rule& rule = settings_->rules[i];
        if (!is_about(rule, who ? *who : kNobody)) continue;
        if (!rule.stations.empty() && !holds(rule.stations, place)) continue;
        const std::vector<Span>* items = nullptr;
        if (rule.has_range()) {
            // A notation that this panel does not have names no item of it.
            const auto found = rule.items.find(place);
            items = found != rule.items.end() ? &found->second : &unlisted_items_[i];
        }
        applied.push_back({&rule, items});
    }
    return applied;
}

}  // namespace panelgate::access
