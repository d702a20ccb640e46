#include "panelgate/yaml/variables.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/base/text.hpp"

namespace panelgate::yaml {

namespace {

constexpr std::size_t kMost = std::size_t{1} << 20;  ///< total bytes of variables' values

bool is_variable_name(std::string_view text) {
    constexpr std::string_view kDigits = "0123456789";
    constexpr std::string_view kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_0123456789";
    return !text.empty() && kDigits.find(text[0]) == std::string_view::npos &&
           text.find_first_not_of(kLetters) == std::string_view::npos;
}

/// NAME or NAME:-default, without the braces.
struct Variable {
    std::string name;
    std::optional<std::string> fallback;
};

std::optional<Variable> parse_variable(std::string_view text) {
    const std::size_t minus = text.find(":-");
    Variable variable{std::string(text.substr(0, minus)), {}};
    if (minus != std::string_view::npos) variable.fallback = std::string(text.substr(minus + 2));
    if (!is_variable_name(variable.name)) return std::nullopt;
    return variable;
}

class Expansion {
  public:
    Expansion(const Environment& environment, Problems& problems)
        : environment_(environment), problems_(problems) {}

    void expand(Node& node) {
        if (node.kind == Node::Kind::scalar && node.scalar.find('$') != std::string::npos)
            expand_scalar(node);
        for (Node& item : node.items) expand(item);
        for (Entry& entry : node.entries) expand(entry.value);
    }

  private:
    void expand_scalar(Node& node) {
        named_.clear();
        node.scalar = expanded(node);
        node.variable = named_;
    }
    std::string expanded(const Node& node) {
        const std::string_view from = node.scalar;
        std::string to;
        std::size_t at = 0;
        while (at < from.size()) {
            const std::string_view rest = from.substr(at);
            if (rest.starts_with("$$")) {
                to += '$';
                at += 2;
            } else if (rest.starts_with("${")) {
                const std::size_t end = rest.find('}');
                to += value_of(node, rest.substr(0, end == rest.npos ? end : end + 1));
                at = end == rest.npos ? from.size() : at + end + 1;
            } else {
                if (rest[0] == '$' && (at == 0 || !is_variable_name(from.substr(at - 1, 1))))
                    refuse_unbraced(node, rest.substr(1));
                to += from[at++];
            }
        }
        return to;
    }

    /// Reports $NAME and $(NAME), as in shells and makefiles; a single letter is a currency.
    void refuse_unbraced(const Node& node, std::string_view behind) {
        const bool bracket = behind.starts_with('(');
        if (bracket) behind.remove_prefix(1);
        std::size_t end = 0;
        while (end < behind.size() && is_variable_name(behind.substr(0, end + 1))) ++end;
        if (end < 2 || (bracket && !behind.substr(end).starts_with(')'))) return;
        const std::string name(behind.substr(0, end));
        const std::string typed = bracket ? "$(" + name + ')' : '$' + name;
        problems_.add(node.mark, '\'' + typed + "' is no variable here; write ${" + name +
                                     "}, or $" + typed + " for the text itself");
    }

    /// `typed` includes dollar and braces. An invalid form is returned unchanged.
    std::string value_of(const Node& node, std::string_view typed) {
        const std::string text(typed);
        const bool closed = typed.ends_with('}');
        const auto variable =
            closed ? parse_variable(typed.substr(2, typed.size() - 3)) : std::nullopt;
        if (variable && variable->fallback && variable->fallback->find("${") != std::string::npos) {
            problems_.add(node.mark, "the default of " + variable->name +
                                         " holds a variable, which is not looked up; write a text");
            return text;
        }
        if (!variable) {
            problems_.add(node.mark, '\'' + text +
                                         "' must be ${NAME} or ${NAME:-default}, NAME of letters, "
                                         "digits and '_'; a dollar itself is $$");
            return text;
        }
        named_ = variable->name;
        auto value = environment_ ? environment_(variable->name) : std::nullopt;
        if (variable->fallback && value.value_or("").empty()) value = variable->fallback;
        if (!value) {
            const std::string& name = variable->name;
            problems_.add(node.mark, "the environment has no " + name + "; set it, or write ${" +
                                         name + ":-default}");
            return text;
        }
        if (!is_utf8(*value)) {
            problems_.add(node.mark,
                          "what the environment has as " + variable->name + " is not UTF-8");
            return text;
        }
        expanded_size_ += value->size();
        if (expanded_size_ <= kMost) return *value;
        if (expanded_size_ - value->size() <= kMost)
            problems_.add(node.mark,
                          "variables bring more than " + std::to_string(kMost) + " bytes");
        return text;
    }

    const Environment& environment_;
    Problems& problems_;
    std::size_t expanded_size_ = 0;
    std::string named_;  ///< the last variable of the current scalar
};

}  // namespace

void expand_variables(Node& tree, const Environment& environment, Problems& problems) {
    Expansion(environment, problems).expand(tree);
}

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
