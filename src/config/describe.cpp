#include "panelgate/config/describe.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "panelgate/config/setting.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

/// Adds the rows of a map. What a change of the map needs, one of its keys needs.
void add_rows(const Table& table, const KeyShape& map, bool inherits, Described& all) {
    const std::string above = map.path.empty() ? "" : map.path + '/';
    int order = 0;
    for (const Row& row : table.rows()) {
        KeyShape shape = row.shape;
        shape.path = above + shape.path;
        shape.order = ++order;
        if (inherits) shape.initial.clear();
        if (shape.change.empty()) shape.change = map.change;
        all.places.emplace(shape.path, all.keys.size());
        all.keys.push_back(shape);
        if (row.below) add_rows(row.below(), shape, row.inherits, all);
    }
    for (const Condition& condition : table.conditions()) {
        all.rules.push_back(condition.rule);
        all.rules.back().map = map.path;
    }
}

Described describe_rows() {
    Described all;
    add_rows(root_keys(), {}, false, all);
    return all;
}

}  // namespace

const Described& describe() {
    static const Described kDescribed = describe_rows();
    return kDescribed;
}

const KeyShape* Described::find(std::string_view path) const {
    const auto place = places.find(path);
    return place == places.end() ? nullptr : &keys[place->second];
}

const KeyShape* Described::of(const Setting& setting) const {
    const std::string& map = setting.map->keys;
    const std::string path = (map.empty() ? "" : map + '/') + std::string(setting.key());
    const KeyShape* key = find(path);
    return key == nullptr ? find(map) : key;
}

std::string Described::condition_of(std::string_view key) const {
    for (const KeyRule& rule : rules) {
        if (rule.needs || rule.map + '/' + rule.key != key) continue;
        const auto is_allowed = [&](const std::string& word) {
            return std::ranges::find(rule.words, word) != rule.words.end();
        };
        std::vector<std::string> others;
        if (const KeyShape* other = find(rule.map + '/' + rule.other)) others = other->words;
        std::erase_if(others, is_allowed);
        const bool shorter = rule.absent_will_do && others.size() < rule.words.size();
        std::string words;
        for (const std::string& word : shorter ? others : rule.words)
            words += (words.empty() ? "" : " or ") + word;
        return (shorter ? "not with " : "only with ") + rule.other + ": " + words;
    }
    return "";
}

}  // namespace panelgate::config
