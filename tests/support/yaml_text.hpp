#pragma once

#include <string>

#include "panelgate/yaml/document.hpp"

namespace panelgate {

inline std::string yaml_quoted(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
    return quoted + '\'';
}

/// A tree as a text of one line that is read as the same tree; its texts have no line breaks.
inline std::string yaml_text(const yaml::Node& node) {
    std::string text;
    switch (node.kind) {
        case yaml::Node::Kind::null:
            return "null";
        case yaml::Node::Kind::scalar:
            return node.quoted || node.scalar.find_first_of("{}[],:#'\"&*") != std::string::npos
                       ? yaml_quoted(node.scalar)
                       : node.scalar;
        case yaml::Node::Kind::sequence:
            for (const yaml::Node& item : node.items)
                text += (text.empty() ? "" : ", ") + yaml_text(item);
            return '[' + text + ']';
        case yaml::Node::Kind::map:
            for (const yaml::Entry& entry : node.entries)
                text += (text.empty() ? "" : ", ") + entry.key + ": " + yaml_text(entry.value);
            return '{' + text + '}';
    }
    return text;
}

}  // namespace panelgate
