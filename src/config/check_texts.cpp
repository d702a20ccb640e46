#include "check_texts.hpp"

#include <array>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::config {
namespace {

/// C0 but for the tab, DEL, C1 (in UTF-8: C2 80 to C2 9F), and the two separators that end a line
/// for a browser.
std::optional<unsigned> control_character(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
        if ((byte < 0x20 && byte != '\t') || byte == 0x7F) return byte;
        if (byte == 0xC2 && next < 0xA0) return next;
        if (text.substr(i).starts_with("\u2028")) return 0x2028;
        if (text.substr(i).starts_with("\u2029")) return 0x2029;
    }
    return std::nullopt;
}

/// The text of a block begins as a list or a map does.
bool is_yaml(std::string_view text) {
    const std::string_view first = text.substr(0, text.find('\n'));
    const std::size_t colon = first.find(':');
    const bool is_key =
        colon != first.npos && colon > 0 &&
        first.substr(0, colon).find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == first.npos &&
        (colon + 1 == first.size() || first[colon + 1] == ' ');
    return first.starts_with("- ") || is_key;
}

/// `variable`: whose value the text is, or none's.
void refuse(std::string_view text, yaml::Mark mark, const std::string& variable,
            yaml::Problems& problems) {
    const auto control = control_character(text);
    if (!control) return;
    const std::string in = variable.empty() ? " in a text" : " in the value of ${" + variable + '}';
    if (*control == '\n' && is_yaml(text)) {
        problems.add(mark,
                     "a text, by the '|' or '>' behind the key; remove that sign for what "
                     "stands below to be a list, or keys");
        return;
    }
    if (*control == '\n') {
        problems.add(mark, variable.empty() ? "a text of more than one line; write it on one line"
                                            : "a line break" + in + "; give the variable one line");
        return;
    }
    std::array<char, 16> name{};
    std::snprintf(name.data(), name.size(), "U+%04X", *control);
    problems.add(mark, "control character " + std::string(name.data()) + in + "; leave it out");
}

}  // namespace

void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems) {
    refuse(tree.scalar, tree.mark, tree.variable, problems);
    for (const yaml::Node& item : tree.items) refuse_control_characters(item, problems);
    for (const yaml::Entry& entry : tree.entries) {
        refuse(entry.key, entry.mark, {}, problems);
        refuse_control_characters(entry.value, problems);
    }
}

}  // namespace panelgate::config
