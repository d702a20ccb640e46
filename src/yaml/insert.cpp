#include "panelgate/yaml/insert.hpp"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "encoding.hpp"
#include "source.hpp"

namespace panelgate::yaml {

namespace {

using Kind = Node::Kind;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// How the items of a list are typed.
struct Style {
    int indent = 2;  ///< columns from the list's key to the '-'
    int gap = 1;     ///< blanks between '-' and the item
    bool braces = false;
    std::string pad;  ///< between the brackets and what is in them
};

std::string blanks(int count) { return std::string(static_cast<std::size_t>(count), ' '); }

std::string in_brackets(const Node& node, const std::string& pad) {
    std::string inside;
    const auto add = [&](const std::string& one) { inside += (inside.empty() ? "" : ", ") + one; };
    switch (node.kind) {
        case Kind::null:
            return "null";
        case Kind::scalar:
            return node.quoted ? written(node.scalar) : node.scalar;
        case Kind::sequence:
            for (const Node& item : node.items) add(in_brackets(item, pad));
            return '[' + inside + ']';
        case Kind::map:
            for (const Entry& entry : node.entries)
                add(written(entry.key) + ": " + in_brackets(entry.value, pad));
            return '{' + pad + inside + pad + '}';
    }
    return inside;
}

/// The item of a block list whose '-' is in this column (from 1); ends with `eol`.
std::string in_block(const Node& item, int dash, const Style& style, const std::string& eol) {
    const std::string begin = blanks(dash - 1) + '-' + blanks(style.gap);
    if (style.braces || item.entries.empty()) return begin + in_brackets(item, style.pad) + eol;
    std::string text;
    for (const Entry& entry : item.entries)
        text += (text.empty() ? begin : blanks(dash + style.gap)) + written(entry.key) + ": " +
                in_brackets(entry.value, style.pad) + eol;
    return text;
}

/// The end of a text in quotes that begins at `at`.
std::size_t end_of_quotes(std::string_view text, std::size_t at) {
    const char quote = text[at];
    for (++at; at < text.size(); ++at) {
        const bool escapes = text[at] == '\\' && quote == '"';
        const bool doubled = quote == '\'' && text.substr(at).starts_with("''");
        if (text[at] == quote && !doubled) return at;
        if (escapes || doubled) ++at;
    }
    return text.npos;
}

/// The bracket that closes the bracket at `open`. Variables are masked in the text.
std::size_t closing(std::string_view text, std::size_t open) {
    constexpr std::string_view kBlanks = " \t\r\n";
    int depth = 0;
    char before = ' ';
    for (std::size_t at = open; at < text.size(); before = text[at], ++at) {
        const char c = text[at];
        const bool behind_blank = kBlanks.find(before) != kBlanks.npos;
        if (c == '#' && behind_blank) at = std::min(text.find('\n', at), text.size() - 1);
        if ((c == '"' || c == '\'') &&
            (behind_blank || std::string_view("[{,:").find(before) != std::string_view::npos))
            at = std::min(end_of_quotes(text, at), text.size() - 1);
        if (c == '[' || c == '{') ++depth;
        if ((c == ']' || c == '}') && --depth == 0) return at;
    }
    return text.npos;
}

bool is_same(const Node& a, const Node& b) {
    return a.kind == b.kind && a.scalar == b.scalar &&
           std::ranges::equal(a.items, b.items, is_same) &&
           std::ranges::equal(a.entries, b.entries, [](const Entry& one, const Entry& other) {
               return one.key == other.key && is_same(one.value, other.value);
           });
}

/// Finds the place in a text that is YAML.
class Editor {
  public:
    Editor(std::string text, Node& root, Problems& problems)
        : source_(std::move(text)),
          masked_(mask_variables(source_.text())),
          root_(root),
          problems_(problems) {}

    /// Also adds the item to the tree.
    std::optional<Insertion> insert(std::string_view into, const Node& item) {
        Node* node = &root_;
        while (true) {
            const std::size_t end = std::min(into.find('/'), into.size());
            const std::string name(into.substr(0, end));
            into.remove_prefix(std::min(end + 1, into.size()));
            if (first(*node) == '*') return refuse("is repeated by an alias", name, *node);
            Node* below = step(*node, name);
            if (below == nullptr && into.empty() && node->kind == Kind::map)
                return begin_list(*node, name, item);
            if (below == nullptr) return refuse("is not there", name, *node);
            node = below;
            if (into.empty()) return append(*node, name, item);
        }
    }

  private:
    std::optional<Insertion> refuse(const std::string& why, const std::string& name,
                                    const Node& node) {
        problems_.add(node.mark, quote(name) + ' ' + why +
                                     ", so nothing can be put into it; type "
                                     "what you mean into the file");
        return std::nullopt;
    }

    std::size_t offset(Mark mark) const {
        std::size_t at = mark.line == 1 ? 0 : source_.end_of(mark.line - 1) + 1;
        for (int column = 1; column < mark.column && at < source_.text().size(); ++column)
            at += character_at(source_.text(), at).size();
        return at;
    }
    /// Where a value begins behind its anchor.
    std::size_t begin(const Node& node) const {
        const std::string_view text = source_.text();
        std::size_t at = offset(node.mark);
        if (at < text.size() && text[at] == '&') at = text.find_first_of(" \t\r\n", at);
        return std::min(text.find_first_not_of(" \t\r\n", at), text.size());
    }
    char first(const Node& node) const {
        const std::size_t at = begin(node);
        return at < source_.text().size() ? source_.text()[at] : '\n';
    }
    bool is_in_brackets(const Node& node) const { return first(node) == '[' || first(node) == '{'; }

    Node* step(Node& node, const std::string& name) {
        for (std::size_t i = 0; i < node.entries.size(); ++i) {
            if (node.entries[i].key != name) continue;
            if (i + 1 < node.entries.size()) behind_ = node.entries[i + 1].mark.line;
            column_ = node.entries[i].mark.column;
            return &node.entries[i].value;
        }
        for (std::size_t i = 0; i < node.items.size(); ++i) {
            const Node* own = node.items[i].find("name");
            if (own == nullptr || own->scalar != name) continue;
            if (i + 1 < node.items.size() && first(node) == '-')
                behind_ = dash(node, node.items[i + 1]).line;
            return &node.items[i];
        }
        return nullptr;
    }

    /// The '-' of an item of a block list, whose mark has the first one's column.
    Mark dash(const Node& list, const Node& item) const {
        Mark at = source_.mark(begin(list));
        const auto column = static_cast<std::size_t>(at.column) - 1;
        const auto has_dash = [&](int line) {
            return source_.line(line)
                .substr(std::min(column, source_.line(line).size()))
                .starts_with('-');
        };
        for (at.line = item.mark.line; at.line > 1 && !has_dash(at.line);) --at.line;
        return at;
    }

    /// Blank lines and comments belong to what comes behind, but not comments that are indented
    /// deeper than `column`.
    bool belongs_behind(int line, int column) const {
        const std::string_view text = source_.line(line);
        const std::size_t at = text.find_first_not_of(" \t");
        if (at == text.npos || text.starts_with("...")) return true;
        return text[at] == '#' && static_cast<int>(at) < column;
    }

    /// Puts lines behind what is indented deeper than `column` (from 1).
    Insertion below(const std::function<std::string(const std::string& eol)>& lines,
                    int column) const {
        int behind = behind_.value_or(source_.mark(source_.text().size()).line + 1);
        while (behind > 1 && belongs_behind(behind - 1, column)) --behind;
        const std::size_t end = source_.end_of(behind - 1);
        const std::string_view text = source_.text();
        const std::size_t some_end = std::min(text.find('\n'), text.size());
        const std::string eol = some_end > 0 && text[some_end - 1] == '\r' ? "\r\n" : "\n";
        if (end < text.size()) return {end + 1, lines(eol)};
        std::string last = eol + lines(eol);
        last.resize(last.size() - eol.size());
        return {end, std::move(last)};
    }

    Style style_of(const Node& list, int key) const {
        Style style;
        const auto maps =
            std::ranges::find(list.items.rbegin(), list.items.rend(), Kind::map, &Node::kind);
        const Mark at = dash(list, list.items.back());
        style.indent = at.column - key;
        const Node& last = maps == list.items.rend() ? list.items.back() : *maps;
        style.braces = first(last) == '{';
        if (style.braces && source_.text().substr(begin(last)).starts_with("{ ")) style.pad = " ";
        const std::string_view line = source_.line(at.line);
        const std::size_t behind = line.find_first_not_of(' ', static_cast<std::size_t>(at.column));
        if (behind != line.npos) style.gap = static_cast<int>(behind) - at.column;
        return style;
    }

    /// As lists of this name are typed elsewhere in the file.
    std::optional<Style> style_of(const Node& node, const std::string& name) const {
        for (const Entry& entry : node.entries) {
            const Node& list = entry.value;
            if (entry.key == name && !list.items.empty() && first(list) == '-')
                return style_of(list, entry.mark.column);
            if (auto found = style_of(list, name)) return found;
        }
        for (const Node& item : node.items)
            if (auto found = style_of(item, name)) return found;
        return std::nullopt;
    }

    std::optional<Insertion> append(Node& list, const std::string& name, const Node& item) {
        if (first(list) == '*') return refuse("is repeated by an alias", name, list);
        const bool begins = list.kind == Kind::null;
        if (!begins && list.kind != Kind::sequence) return refuse("is no list", name, list);
        if (!begins && is_in_brackets(list)) return into_brackets(list, item);
        const Style style =
            begins ? style_of(root_, name).value_or(Style()) : style_of(list, column_);
        const bool apart = list.items.size() > 1 && !begins &&
                           source_.line(dash(list, list.items.back()).line - 1).empty();
        list.kind = Kind::sequence;
        list.items.push_back(item);
        return below(
            [&](const std::string& eol) {
                return (apart ? eol : "") + in_block(item, column_ + style.indent, style, eol);
            },
            column_);
    }

    std::optional<Insertion> begin_list(Node& map, const std::string& name, const Node& item) {
        if (map.find("<<") != nullptr) return refuse("may come from an alias", name, map);
        Node list;
        list.kind = Kind::sequence;
        list.items.push_back(item);
        map.entries.push_back({name, {}, list});
        if (is_in_brackets(map)) {
            const bool alone = map.entries.size() == 1;
            return before_bracket(
                map, (alone ? "" : ", ") + written(name) + ": " + in_brackets(list, ""));
        }
        const int column = map.entries.front().mark.column;
        const Style style = style_of(root_, name).value_or(Style());
        return below(
            [&](const std::string& eol) {
                return blanks(column - 1) + written(name) + ':' + eol +
                       in_block(item, column + style.indent, style, eol);
            },
            column - 1);
    }

    /// Puts text behind all that is in the brackets of a list or map.
    std::optional<Insertion> before_bracket(const Node& node, std::string text) const {
        const std::size_t end = closing(masked_, begin(node));
        if (end == masked_.npos) return std::nullopt;
        const std::size_t last = masked_.find_last_not_of(" \t\r\n", end - 1);
        if (masked_[last] == ',') text.erase(0, text.find_first_not_of(','));
        return Insertion{last + 1, std::move(text)};
    }

    std::optional<Insertion> into_brackets(Node& list, const Node& item) {
        std::string lead;
        std::string pad;
        if (!list.items.empty()) {
            const std::size_t at = begin(list.items.back());
            const std::size_t end = source_.text().rfind('\n', at);
            const std::size_t line = end == source_.text().npos ? 0 : end + 1;
            const bool own_line = source_.text().find_first_not_of(' ', line) == at;
            lead = own_line && line > 0 ? "," + std::string(source_.text().substr(end, at - end))
                                        : std::string(", ");
            if (source_.text().substr(at).starts_with("{ ")) pad = " ";
        }
        list.items.push_back(item);
        return before_bracket(list, lead + in_brackets(item, pad));
    }

    Source source_;
    std::string masked_;
    Node& root_;
    Problems& problems_;
    std::optional<int> behind_;  ///< the line of what comes behind the place; none: the end
    int column_ = 0;             ///< of the key whose value the place is in
};

}  // namespace

std::optional<Insertion> insert(std::string_view text, std::string_view into, const Node& item,
                                Problems& problems) {
    Node root = parse(text, problems);
    if (!problems.empty()) return std::nullopt;
    const std::size_t mark = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
    Decoded decoded = decode(text);
    if (decoded.text.size() + mark != text.size()) {
        problems.add({}, "the file is not in UTF-8; save it so");
        return std::nullopt;
    }
    auto made = Editor(std::move(decoded.text), root, problems).insert(into, item);
    if (!made) return made;
    made->at += mark;
    const std::string longer = std::string(text).insert(made->at, made->text);
    Problems faults(problems.file());
    if (!is_same(parse(longer, faults), root) || !faults.empty()) {
        problems.add({},
                     "nothing can be put in here without a change of something else, such as what "
                     "an alias repeats; type what you mean into the file");
        return std::nullopt;
    }
    const std::size_t item_at = longer.find_first_of("-{", made->at);
    made->line =
        1 + static_cast<int>(std::count(
                longer.begin(), longer.begin() + static_cast<std::ptrdiff_t>(item_at), '\n'));
    return made;
}

}  // namespace panelgate::yaml
