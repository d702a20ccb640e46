#include "panelgate/yaml/description.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {
namespace {

std::string joined(const std::string& path, std::string_view key) {
    return path.empty() ? std::string(key) : path + '/' + std::string(key);
}

}  // namespace

const std::string* Description::path_of(const Node& map) const {
    const auto found = paths_.find(&map);
    return found == paths_.end() ? nullptr : &found->second;
}

KeyShape* Description::shape(const Node& map, std::string_view key) {
    const std::string* path = path_of(map);
    if (path == nullptr) return nullptr;
    const std::string whole = joined(*path, key);
    const auto found = std::ranges::find(keys_, whole, &KeyShape::path);
    if (found != keys_.end()) return &*found;
    keys_.emplace_back().path = whole;
    return &keys_.back();
}

void Description::tell(const Node& map, std::string_view key, KeyShape shape) {
    KeyShape* known = this->shape(map, key);
    if (known == nullptr) return;
    known->required = known->required || shape.required;
    for (std::string& word : shape.words) {
        if (std::ranges::find(known->words, word) == known->words.end())
            known->words.push_back(std::move(word));
    }
    if (shape.kind == KeyShape::Kind::text) return;  // which any scalar is
    known->kind = shape.kind;
    known->min = shape.min;
    known->max = shape.max;
    known->shortest = shape.shortest;
    known->longest = shape.longest;
}

void Description::tell_rule(const Node& map, KeyRule rule) {
    const std::string* path = path_of(map);
    if (path == nullptr) return;
    rule.map = *path;
    rules_.push_back(std::move(rule));
}

void Description::tell_below(const Node& map, std::string_view key, const Node& value) {
    const std::string* path = path_of(map);
    if (path == nullptr) return;
    const std::string below = joined(*path, key);
    paths_[&value] = below;
    for (const Node& item : value.items) paths_[&item] = below;
}

}  // namespace panelgate::yaml
