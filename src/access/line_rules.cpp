#include "panelgate/access/line_rules.hpp"

#include <algorithm>

#include "ruling.hpp"

namespace panelgate::access {

namespace {

using modbus::Span;

constexpr std::size_t kMeetings = 2048;  ///< remembered; then all are forgotten
constexpr std::size_t kAddresses = modbus::kMaxListedStation + std::size_t{1};

template <class List, class Value>
bool holds(const List& list, const Value& value) {
    return std::ranges::find(list, value) != list.end();
}

bool is_trusted(const WhoRef& who) { return who && who->face == Face::gateway; }

/// A request for no items still names a place.
std::optional<Span> with_items(std::optional<Span> span) {
    if (span && span->count == 0) span->count = 1;
    return span;
}

/// Doors judge default roles; the rights of a role of the configuration are judged here.
bool lacks(const WhoRef& who, Act act) {
    return who && who->standing.own && !who->standing.own->rights.has(right_of(act));
}

Verdict by_role(const WhoRef& who, Act act) {
    return {false, nullptr, act, who->standing.own->name};
}

/// What functions that name no items do.
Acts acts_without_items(const modbus::Request& request) {
    if (request.is_read()) return {Act::read};
    const std::uint8_t function = request.function();
    if (function == modbus::kDiagnostics || function == modbus::kWriteFileRecord)
        return {Act::write};
    return {Act::read, Act::write};  // only its vendor knows
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

Acts LineRules::Question::acts() const {
    const modbus::Access access = asked->access();
    Acts acts;
    if (!access.read && !access.write) acts = acts_without_items(*asked);
    if (access.read) acts.add(Act::read);
    if (access.write) acts.add(Act::write);
    if (station == 0) acts.add(Act::broadcast);
    if (raw) acts.add(Act::raw);
    return acts;
}

LineRules::LineRules(std::shared_ptr<const Settings> settings, std::string line,
                     std::vector<std::uint8_t> listed)
    : settings_(std::move(settings)),
      line_(std::move(line)),
      listed_(std::move(listed)),
      known_(listed_) {
    if (listed_.empty()) known_.push_back(0);  // those that nobody knows
    for (const Rule& rule : settings_->rules) {
        for (const auto& [on, station] : rule.stations)
            if (on == line_ && !holds(known_, station)) known_.push_back(station);
        unlisted_items_.emplace_back();
        if (rule.unlisted_items) unlisted_items_.back().push_back(*rule.unlisted_items);
    }
}

Verdict LineRules::judge(const WhoRef& who, const Question& question) const {
    if (is_trusted(who)) return {};
    if (who && who->standing.own) {
        const Acts acts = question.acts();
        for (const Act act : {Act::read, Act::write, Act::broadcast, Act::raw})
            if (acts.has(act) && lacks(who, act)) return by_role(who, act);
    }
    if (is_open()) return {};
    if (question.station != 0) return judge_request(who, question.station, question);
    Verdict verdict;
    for (const std::uint8_t station : known_) {  // it reaches all of them
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
    if (!read && !written) {
        const Acts acts = acts_without_items(request);
        for (const Act act : {Act::read, Act::write})
            if (acts.has(act)) ask(act, std::nullopt);
    }
    if (read) ask(Act::read, read);
    if (written) ask(Act::write, written);
    return verdict;
}

Verdict LineRules::judge(const WhoRef& who, std::uint8_t station, Act act, std::uint8_t function,
                         const std::optional<Span>& items) const {
    if (is_trusted(who)) return {};
    if (lacks(who, act)) return by_role(who, act);
    if (is_open()) return {};
    return decide(meet(who, station), act, function, with_items(items));
}

Verdict LineRules::decide(const Meeting& meeting, Act act, std::uint8_t function,
                          const std::optional<Span>& items) {
    const Ruling& ruling = *meeting.ruling;
    const Ruling::Decision decision =
        items ? ruling.decide(act, function, *items) : ruling.decide(act, function);
    return {decision.allowed, decision.rule, act};
}

bool LineRules::may_some(const WhoRef& who, std::uint8_t station, Act act) const {
    if (lacks(who, act)) return false;
    if (is_open() || is_trusted(who)) return true;
    const Ruling& ruling = *meet(who, station).ruling;
    return std::ranges::any_of(modbus::kTables, [&](modbus::Table table) {
        return can_be(act, table) && ruling.allows_some(act, function_for(act, table), table);
    });
}

bool LineRules::may_read_some(const WhoRef& who) const {
    if (listed_.empty()) return may_some(who, 0, Act::read);
    return std::ranges::any_of(
        listed_, [&](std::uint8_t station) { return may_some(who, station, Act::read); });
}

bool LineRules::may_all(const WhoRef& who, std::uint8_t station, Act act) const {
    if (lacks(who, act)) return false;
    if (is_open() || is_trusted(who)) return true;
    const Ruling& ruling = *meet(who, station).ruling;
    return std::ranges::all_of(modbus::kTables, [&](modbus::Table table) {
        const Span all{table, 0, modbus::kTableItems};
        return !can_be(act, table) || ruling.decide(act, function_for(act, table), all).allowed;
    });
}

std::vector<std::string> LineRules::denying_names() const {
    std::vector<std::string> names;
    if (settings_ == nullptr) return names;
    for (const OwnRole& role : settings_->roles) names.push_back(role.name);
    if (is_open()) return names;
    for (const Rule& rule : settings_->rules) {
        if (!rule.allow) names.push_back(rule.name);
    }
    names.emplace_back(kDefaultRule);
    return names;
}

const LineRules::Meeting& LineRules::meet(const WhoRef& who, std::uint8_t station) const {
    if (meetings_.empty()) meetings_.resize(kAddresses);  // 14 KiB that a line without rules saves
    Meetings& known = meetings_[station];
    if (const auto found = known.find(who.get()); found != known.end()) return found->second;
    if (met_ >= kMeetings) {
        for (Meetings& all : meetings_) all.clear();
        rulings_.clear();
        met_ = 0;
    }
    ++met_;
    return known.emplace(who.get(), Meeting{who, ruling_for(who, station)}).first->second;
}

/// Clients whom the same rules match share what these decide.
std::shared_ptr<const Ruling> LineRules::ruling_for(const WhoRef& who, std::uint8_t station) const {
    std::vector<RuleAtStation> rules = rules_for(who, station);
    std::shared_ptr<const Ruling>& known = rulings_[rules];
    if (!known)
        known = std::make_shared<const Ruling>(std::move(rules), settings_->allow_by_default);
    return known;
}

std::vector<RuleAtStation> LineRules::rules_for(const WhoRef& who, std::uint8_t station) const {
    static const Who kNobody{};
    const Place place{line_, station};
    std::vector<RuleAtStation> applied;
    for (std::size_t i = 0; i < settings_->rules.size(); ++i) {
        const Rule& rule = settings_->rules[i];
        if (!is_about(rule, who ? *who : kNobody)) continue;
        if (!rule.stations.empty() && !holds(rule.stations, place)) continue;
        const std::vector<Span>* items = nullptr;
        if (rule.has_range()) {
            // A notation of another panel family names no item of this panel.
            const auto found = rule.items.find(place);
            items = found != rule.items.end() ? &found->second : &unlisted_items_[i];
        }
        applied.push_back({&rule, items});
    }
    return applied;
}

}  // namespace panelgate::access
