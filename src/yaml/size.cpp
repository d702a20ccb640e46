#include "size.hpp"

#include <algorithm>

namespace panelgate::yaml {

Size size_of(const Node& node) {
    Size size;
    size.text = node.scalar.size();
    const auto add = [&size](const Node& child) {
        const Size inner = size_of(child);
        size.nodes += inner.nodes;
        size.text += inner.text;
        size.depth = std::max(size.depth, inner.depth);
    };
    for (const Node& item : node.items) add(item);
    for (const Entry& entry : node.entries) {
        size.text += entry.key.size();
        add(entry.value);
    }
    if (node.kind == Node::Kind::sequence || node.kind == Node::Kind::map) ++size.depth;
    return size;
}

}  // namespace panelgate::yaml
