#include "panelgate/yaml/merge_keys.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <utility>

namespace panelgate::yaml {
namespace {

void take_over(Node& map, std::set<std::string>& keys, Node from, Problems& problems) {
    if (from.kind != Node::Kind::map) {
        const bool is_name = from.kind == Node::Kind::scalar && !from.scalar.empty() &&
                             std::isalpha(static_cast<unsigned char>(from.scalar[0])) != 0;
        problems.add(from.mark,
                     "'<<' takes over a map of keys, such as <<: *name, or a list of such: "
                     "<<: [*one, *other]" +
                         (is_name ? "; write <<: *" + from.scalar : ""));
        return;
    }
    for (Entry& entry : from.entries) {
        if (keys.insert(entry.key).second) map.entries.push_back(std::move(entry));
    }
}

void resolve(Node& map, Problems& problems) {
    const auto merge = std::ranges::find(map.entries, "<<", &Entry::key);
    if (merge == map.entries.end()) return;
    Node from = std::move(merge->value);
    map.entries.erase(merge);
    std::set<std::string> keys;
    for (const Entry& entry : map.entries) keys.insert(entry.key);
    if (from.kind == Node::Kind::sequence) {
        for (Node& one : from.items) take_over(map, keys, std::move(one), problems);
    } else {
        take_over(map, keys, std::move(from), problems);
    }
}

}  // namespace

void resolve_merge_keys(Node& tree, Problems& problems) {
    for (Node& item : tree.items) resolve_merge_keys(item, problems);
    for (Entry& entry : tree.entries) resolve_merge_keys(entry.value, problems);
    resolve(tree, problems);
}

}  // namespace panelgate::yaml
