#include "ruling.hpp"

#include <algorithm>
#include <set>

namespace panelgate::access {

namespace {

bool is_named(const Rule& rule, std::uint8_t function) {
    return std::ranges::find(rule.functions, function) != rule.functions.end();
}

/// True if the rule speaks of this act by this function.
bool is_about(const Rule& rule, Act act, std::uint8_t function) {
    return rule.acts.has(act) && (rule.functions.empty() || is_named(rule, function));
}

}  // namespace

Ruling::Ruling(std::vector<RuleAtStation> rules, bool allow_by_default)
    : rules_(std::move(rules)), allow_by_default_(allow_by_default) {}

bool Ruling::allows(std::size_t rule) const {
    return rule < rules_.size() ? rules_[rule].rule->allow : allow_by_default_;
}

Ruling::Decision Ruling::decide(Act act, std::uint8_t function, const modbus::Span& items) const {
    const Pieces& pieces = pieces_of(act, function, items.table);
    const auto behind = std::ranges::upper_bound(pieces, items.first, {}, &Piece::first);
    auto end = behind;  // the piece before it holds the first item
    while (end != pieces.end() && end->first < items.end()) ++end;
    return decision_of({behind - 1, end});
}

Ruling::Decision Ruling::decide(Act act, std::uint8_t function) const {
    return decision_of(pieces_of(act, function, std::nullopt));
}

bool Ruling::allows_some(Act act, std::uint8_t function, modbus::Table table) const {
    return std::ranges::any_of(pieces_of(act, function, table), [&](const Piece& piece) {
        return piece.first < modbus::kTableItems && allows(piece.rule);
    });
}

Ruling::Decision Ruling::decision_of(std::span<const Piece> pieces) const {
    std::size_t denies = rules_.size() + 1;
    std::size_t decides = 0;
    for (const Piece& piece : pieces) {
        decides = std::max(decides, piece.rule);
        if (!allows(piece.rule)) denies = std::min(denies, piece.rule);
    }
    const bool allowed = denies > rules_.size();
    const std::size_t rule = allowed ? decides : denies;
    return {allowed, rule < rules_.size() ? rules_[rule].rule : nullptr};
}

const Ruling::Pieces& Ruling::pieces_of(Act act, std::uint8_t function,
                                        std::optional<modbus::Table> table) const {
    const std::uint32_t key = static_cast<std::uint32_t>(act) << 16U |
                              static_cast<std::uint32_t>(function) << 8U |
                              (table ? static_cast<std::uint32_t>(*table) : 0xFFU);
    const auto [known, is_new] = index_.try_emplace(key);
    if (!is_new) return known->second;
    // A rule about items says nothing of a function without items, unless it names it.
    const auto decides = [&](const RuleAtStation& applied) {
        const Rule& rule = *applied.rule;
        return is_about(rule, act, function) && (!rule.has_range() || is_named(rule, function));
    };
    const auto first = std::ranges::find_if(rules_, decides) - rules_.begin();
    known->second =
        table ? make_pieces(act, function, *table) : Pieces{{0, static_cast<std::size_t>(first)}};
    return known->second;
}

Ruling::Pieces Ruling::make_pieces(Act act, std::uint8_t function, modbus::Table table) const {
    struct Edge {
        std::uint32_t at = 0;
        std::size_t rule = 0;
        bool begins = false;
    };
    std::vector<Edge> edges;
    std::size_t rest = 0;  // decides what is in no range
    for (; rest < rules_.size(); ++rest) {
        const RuleAtStation& applied = rules_[rest];
        if (!is_about(*applied.rule, act, function)) continue;
        if (applied.items == nullptr) break;
        for (const modbus::Span& span : *applied.items) {
            if (span.table != table || span.count == 0) continue;
            edges.push_back({span.first, rest, true});
            edges.push_back({span.end(), rest, false});
        }
    }
    std::ranges::sort(edges, {}, &Edge::at);
    Pieces pieces{{0, rest}};
    std::multiset<std::size_t> open;  // rules whose range holds this item
    for (auto edge = edges.begin(); edge != edges.end();) {
        const std::uint32_t at = edge->at;
        for (; edge != edges.end() && edge->at == at; ++edge) {
            if (edge->begins)
                open.insert(edge->rule);
            else
                open.erase(open.find(edge->rule));
        }
        const std::size_t rule = open.empty() ? rest : *open.begin();
        if (pieces.back().first == at)
            pieces.back().rule = rule;
        else if (pieces.back().rule != rule)
            pieces.push_back({at, rule});
    }
    return pieces;
}

}  // namespace panelgate::access
