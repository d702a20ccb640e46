#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

namespace {

using Kind = Token::Kind;

/// A list or map that is open at this place.
struct Level {
    std::size_t column = 0;
    bool list = false;
    std::size_t first = 0;            ///< token of its first dash or key
    std::size_t last = 0;             ///< and of its last
    std::optional<std::size_t> text;  ///< of its last, on the same line
    bool waits = false;               ///< its last has no value yet
};

class Columns {
  public:
    Columns(const Scanned& text, Findings& findings) : text_(text), findings_(findings) {}

    /// Reads a line outside of brackets and block texts, `- - key: value`; false once a line is not
    /// in its column: those below may follow it.
    bool read(std::size_t token) {
        if (has_wrong_indent(text_, text_.tokens[token])) {
            if (!levels_.empty()) levels_.back().waits = true;  // its level is unknown
            return true;
        }
        const std::size_t before = findings_.size();
        std::size_t i = token;
        for (; kind(i) == Kind::dash; ++i) {
            enter(i, true, i == token);
            if (!text_.follows(i + 1) || findings_.size() > before)
                return findings_.size() == before;
        }
        const auto word = content(i, i == token);
        if (!word) return true;
        if (!text_.follows(*word + 1, Kind::colon)) {
            if (i == token) {
                text_alone(*word);
            } else {
                took(*word);
            }
            return true;
        }
        enter(*word, false, i == token);
        if (const auto value = content(*word + 2, false)) took(*value);
        return findings_.size() == before;
    }

  private:
    Kind kind(std::size_t token) const { return text_.tokens[token].kind; }
    std::size_t column(std::size_t token) const {
        return static_cast<std::size_t>(text_.source.mark(text_.tokens[token].begin).column) - 1;
    }
    std::string name(std::size_t token) const {
        return kind(token) == Kind::dash ? "this '-'" : quote(text_.text(token));
    }
    void tell(std::size_t token, std::string message) {
        findings_.push_back({text_.tokens[token].begin, std::move(message)});
    }
    std::string on_line(std::size_t token) const {
        return " on line " + std::to_string(text_.line(token));
    }

    /// Returns the next token of the line that is no anchor or tag.
    std::optional<std::size_t> content(std::size_t i, bool first) const {
        for (; first ? i < text_.tokens.size() : text_.follows(i); ++i, first = false)
            if (kind(i) != Kind::anchor && kind(i) != Kind::tag) return i;
        return std::nullopt;
    }
    void took(std::size_t value) {
        levels_.back().waits = false;
        levels_.back().text = value;
    }

    /// A line without key and dash: continues a text, or lacks a colon.
    void text_alone(std::size_t token) {
        const std::size_t at = column(token);
        while (levels_.size() > 1 && levels_.back().column > at) levels_.pop_back();
        auto finding = missing_colon(text_, token);
        if (levels_.empty()) {
            if (!finding) return;
            levels_.push_back({at, false, token, token, {}, false});
        } else if (levels_.back().column < at && !text_.text(token).starts_with("<<")) {
            levels_.back().waits = false;
            return;
        }
        if (finding)
            findings_.push_back(std::move(*finding));
        else
            tell(token, "a key and ': ' are missing before " + quote(text_.rest(token)) +
                            "; a text of several lines must be indented deeper than its key");
        levels_.back().waits = true;  // deeper lines belong to this one
    }

    /// A dash or a key; `begins` its line.
    void enter(std::size_t token, bool list, bool begins) {
        const Level item{column(token), list, token, token, {}, true};
        std::optional<Level> left;  // the outermost that ends here
        while (begins && !levels_.empty() && levels_.back().column > item.column) {
            left = levels_.back();
            levels_.pop_back();
        }
        if (levels_.empty()) {
            if (left) tell_shift(item, *left);
        } else if (begins && levels_.back().column == item.column) {
            if (go_on(item, left)) return;
        } else if (left) {
            const Level& level = levels_.back();
            const bool nearer = item.column - level.column < left->column - item.column;
            const bool alike = level.list == left->list;
            tell_shift(item, (alike ? nearer : level.list == item.list) ? level : *left);
        } else if (begins && !levels_.back().waits) {
            tell_below_value(item);
        }
        if (!levels_.empty()) levels_.back().waits = false;
        levels_.push_back(item);
    }

    /// In the column of a level; false if a level begins: a list may be in the column of its key.
    bool go_on(const Level& item, const std::optional<Level>& left) {
        const std::size_t size = levels_.size();
        if (levels_.back().list && !item.list && size > 1 &&
            levels_[size - 2].column == item.column)
            levels_.pop_back();
        Level& level = levels_.back();
        if (item.list && level.waits && !level.list) return false;
        if (item.list && !level.list)
            tell(item.first, "indentation: this '-' is in the column of " + name(level.last) +
                                 on_line(level.last) +
                                 ", which has a value; a list goes below a key without one");
        if (!item.list && level.list)
            tell(item.first, "a '- ' is missing before " + name(item.first) +
                                 " (a new item of the list)" +
                                 (left && !left->list ? ", or blanks, until it is below " +
                                                            name(left->first) + on_line(left->first)
                                                      : ""));
        level.last = item.first;
        level.text.reset();
        level.waits = true;
        return true;
    }

    void tell_below_value(const Level& item) {
        const Level& level = levels_.back();
        const bool alias = level.text && kind(*level.text) == Kind::alias && !item.list;
        auto finding = level.text && level.list ? missing_colon(text_, *level.text) : std::nullopt;
        if (alias) {
            tell(*level.text, "no key may be beside or below " + quote(text_.text(*level.text)) +
                                  "; write {<<: " + std::string(text_.text(*level.text)) + ", " +
                                  std::string(clip(text_.rest(item.first), 60)) + '}');
        } else if (finding) {
            findings_.push_back(std::move(*finding));
        } else if (level.list) {
            tell_shift(item, level);
        } else {
            const std::string by = blanks(item.column - level.column);
            tell(item.first, "indentation: " + name(item.first) + " is " + by + " deeper than " +
                                 name(level.last) + on_line(level.last) +
                                 ", which has a value already; take away " + by);
        }
    }

    static std::string blanks(std::size_t count) {
        return count == 1 ? "1 blank" : std::to_string(count) + " blanks";
    }
    void tell_shift(const Level& item, const Level& sibling) {
        const bool left = item.column < sibling.column;
        const std::string by =
            blanks(left ? sibling.column - item.column : item.column - sibling.column);
        const std::string like =
            kind(sibling.first) == Kind::dash ? "the '-'" : name(sibling.first);
        const bool wide = left && kind(sibling.first) != Kind::dash &&
                          text_.follows(sibling.first) && sibling.first > 0 &&
                          kind(sibling.first - 1) == Kind::dash &&
                          sibling.column - column(sibling.first - 1) > 2;
        tell(item.first, "indentation: " + name(item.first) + " is " + by +
                             (left ? " left of " : " right of ") + like + on_line(sibling.first) +
                             "; " + (left ? "add " : "take away ") + by +
                             (wide ? ", or take it away behind the '-' there" : ""));
    }

    const Scanned& text_;
    Findings& findings_;
    std::vector<Level> levels_;
};

}  // namespace

void find_columns(const Scanned& text, Findings& findings) {
    Columns columns(text, findings);
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const bool begins = token.first && token.depth == 0 && token.kind != Kind::document;
        if (begins && !columns.read(i)) return;
    }
}

}  // namespace panelgate::yaml
