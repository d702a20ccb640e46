#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "hints.hpp"
#include "lint.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

/// A line outside of brackets and block texts, as a user sees it: `- - key: value`.
struct BlockLine {
    std::vector<std::size_t> dashes;  ///< tokens
    std::optional<std::size_t> key;   ///< token before its colon
    std::optional<std::size_t> text;  ///< token: the value, or text without a key
    bool has_value() const { return text.has_value(); }
};

std::vector<BlockLine> block_lines(const Scanned& text);

namespace {

using Kind = Token::Kind;

bool can_be_key(Kind kind) {
    return kind == Kind::plain || kind == Kind::quoted || kind == Kind::alias || kind == Kind::odd;
}

/// Returns the next token of the line that is no anchor or tag.
std::optional<std::size_t> content(const Scanned& text, std::size_t i, bool first) {
    for (; first ? i < text.tokens.size() : text.follows(i); ++i, first = false) {
        const Kind kind = text.tokens[i].kind;
        if (kind != Kind::anchor && kind != Kind::tag) return i;
    }
    return std::nullopt;
}

BlockLine block_line(const Scanned& text, std::size_t begin) {
    BlockLine line;
    std::size_t i = begin;
    while (text.tokens[i].kind == Kind::dash) {
        line.dashes.push_back(i++);
        if (!text.follows(i)) return line;
    }
    const auto word = content(text, i, i == begin);
    if (!word) return line;
    const bool colon = text.follows(*word + 1) && text.tokens[*word + 1].kind == Kind::colon;
    if (colon && can_be_key(text.tokens[*word].kind)) {
        line.key = word;
        line.text = content(text, *word + 2, false);
    } else {
        line.text = word;
    }
    return line;
}

}  // namespace

std::vector<BlockLine> block_lines(const Scanned& text) {
    std::vector<BlockLine> lines;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (token.first && token.depth == 0 && token.kind != Kind::document)
            lines.push_back(block_line(text, i));
    }
    return lines;
}

namespace {

/// A list or map that is open at this place.
struct Level {
    std::size_t column = 0;
    std::optional<std::size_t> meant;  ///< intended column, if a shift was reported
    bool list = false;
    bool waits = false;               ///< its last item or key has no value yet
    std::size_t first = 0;            ///< token of its first dash or key
    std::size_t last = 0;             ///< and of its last
    std::optional<std::size_t> text;  ///< of its last, on the same line
};

class Columns {
  public:
    Columns(const Scanned& text, Findings& findings) : text_(text), findings_(findings) {}

    /// `behind`: the following lines.
    void read(const BlockLine& line, std::span<const BlockLine> behind) {
        behind_ = behind;
        two_keys(line);
        shift_ = 0;
        Level item;
        item.list = !line.dashes.empty();
        if (!item.list && !line.key) {
            if (line.text) text_alone(*line.text);
            return;
        }
        item.first = item.list ? line.dashes.front() : *line.key;
        item.column = text_.column(text_.tokens[item.first]);
        if (has_wrong_indent(text_, text_.tokens[item.first])) {
            if (!levels_.empty()) levels_.back().waits = true;  // its level is unknown
            return;
        }
        const bool glued_dash = !item.list && lacks_blank(*line.key);
        item.list = item.list || glued_dash;
        enter(item);
        for (std::size_t i = 1; i < line.dashes.size(); ++i) push(line.dashes[i], true);
        if (item.list && line.key) {
            levels_.back().waits = false;
            push(*line.key, false);
            if (glued_dash) levels_.back().column += 2;  // where the key should be
        }
        Level& last = levels_.back();
        last.waits = !line.has_value();
        last.text = line.text;
    }

  private:
    void push(std::size_t token, bool list) {
        if (!levels_.empty()) levels_.back().waits = false;
        Level level;
        level.column = text_.column(text_.tokens[token]);
        if (shift_ != 0) level.meant = level.column + shift_;
        level.list = list;
        level.first = level.last = token;
        levels_.push_back(level);
    }
    int line(std::size_t token) const { return text_.line(text_.tokens[token]); }
    std::string name(std::size_t token) const {
        return text_.tokens[token].kind == Kind::dash ? "this '-'"
                                                      : quote(text_.text(text_.tokens[token]));
    }
    void tell(std::size_t token, std::string message) {
        findings_.push_back({text_.tokens[token].begin, std::move(message)});
    }

    /// `-id: 5`
    bool lacks_blank(std::size_t key) {
        const std::string_view word = text_.text(text_.tokens[key]);
        if (!word.starts_with('-') || !is_word(word.substr(1))) return false;
        tell(key, "a blank is missing after '-'; write '- " +
                      std::string(clip(word.substr(1), 60)) + ":'");
        return true;
    }

    /// `serial:{baud: 9600}`
    bool glued(std::size_t key) {
        const Token& token = text_.tokens[key];
        const std::string_view word = text_.text(token);
        const std::size_t colon = word.find(':');
        if (token.kind != Kind::plain || !is_word(word.substr(0, colon)) || colon == word.npos)
            return false;
        findings_.push_back({token.begin + colon + 1,
                             "a blank is missing after " + quote(word.substr(0, colon + 1))});
        return true;
    }

    /// `name: press profile: x`, `unit: deg: C`
    void two_keys(const BlockLine& line) {
        if (line.key && glued(*line.key)) return;
        if (line.key && line.text && text_.tokens[*line.text].kind == Kind::dash)
            return tell(*line.text,
                        "a list begins below its key; begin a new line before this '-'");
        if (!line.key || !line.text || text_.tokens[*line.text].kind != Kind::plain) return;
        const std::size_t behind = *line.text + 1;
        if (!text_.follows(behind) || text_.tokens[behind].kind != Kind::colon) return;
        tell(*line.text, second_colon(text_, *line.key, *line.text));
    }

    /// Returns "'name' on line 2" for a level that ended or is open.
    std::string like(const Level& level) const {
        const std::string what =
            text_.tokens[level.first].kind == Kind::dash ? "the '-'" : name(level.first);
        return what + " on line " + std::to_string(line(level.first));
    }

    /// A line without key and dash: continues a text, or lacks a colon.
    void text_alone(std::size_t token) {
        const std::size_t column = text_.column(text_.tokens[token]);
        while (levels_.size() > 1 && levels_.back().column > column) levels_.pop_back();
        if (levels_.empty()) {
            auto finding = missing_colon(text_, token);
            if (!finding) return;
            findings_.push_back(*finding);
            push(token, false);
            levels_.back().waits = true;  // the next lines belong to this key
            return;
        }
        Level& level = levels_.back();
        if (level.column < column && text_.text(text_.tokens[token]).starts_with("<<")) {
            if (auto finding = missing_colon(text_, token)) findings_.push_back(*finding);
            return;
        }
        if (level.column < column) {
            level.waits = false;
            return;
        }
        if (auto finding = missing_colon(text_, token)) {
            findings_.push_back(*finding);
        } else {
            tell(token, "a key and ': ' are missing before " + quote(text_.rest(token)) +
                            "; a text of several lines must be indented deeper than its key");
        }
        level.waits = true;  // deeper lines belong to this one
    }

    void enter(Level item) {
        item.last = item.first;
        use_intended_column(item);
        std::optional<Level> left;  // the outermost that ends here
        while (!levels_.empty() && levels_.back().column > item.column) {
            left = levels_.back();
            levels_.pop_back();
        }
        if (levels_.empty()) {
            if (left) report_shift(item, *left);
            if (shift_ != 0) item.meant = item.column + shift_;
            levels_.push_back(item);
        } else if (levels_.back().column == item.column) {
            go_on(item, left);
        } else {
            deeper(item, left);
        }
    }

    /// Lines after a shifted one may be in its intended column.
    void use_intended_column(const Level& item) {
        for (std::size_t i = levels_.size(); i-- > 0;) {
            if (levels_[i].meant != item.column || levels_[i].list != item.list) continue;
            levels_.resize(i + 1);
            levels_[i].column = item.column;
            levels_[i].meant.reset();
            return;
        }
    }

    /// In the column of a level.
    void go_on(const Level& item, const std::optional<Level>& left) {
        Level* level = &levels_.back();
        if (level->list && !item.list && levels_.size() > 1 &&
            levels_[levels_.size() - 2].column == item.column) {
            levels_.pop_back();  // a list may be in the column of its key
            level = &levels_.back();
        }
        if (level->list == item.list) {
            level->last = item.first;
        } else if (item.list && level->waits) {
            levels_.push_back(item);
        } else if (item.list) {
            tell(item.first, "indentation: this '-' is in the column of " + name(level->last) +
                                 " on line " + std::to_string(line(level->last)) +
                                 ", which has a value; a list goes below a key without one");
        } else {
            const bool deeper = left && !left->list;
            tell(item.first, "a '- ' is missing before " + name(item.first) +
                                 " (a new item of the list)" +
                                 (deeper ? ", or blanks, until it is below " + like(*left) : ""));
            if (deeper) levels_.push_back(*left);
        }
    }

    /// Between two levels, or below a value.
    void deeper(Level item, const std::optional<Level>& left) {
        const Level level = levels_.back();
        if (left && is_dash_moved(item, level, *left)) {
            report_dash(level, *left, item);
        } else if (left) {
            const bool nearer = item.column - level.column < left->column - item.column;
            const bool both = level.list == left->list;
            report_shift(item, (both ? nearer : level.list == item.list) ? level : *left);
        } else if (!level.waits) {
            report_below_value(item, level);
        }
        if (shift_ != 0) item.meant = item.column + shift_;
        if (item.meant == level.column && level.list == item.list) levels_.pop_back();
        levels_.push_back(item);
    }

    /// `serial: *a`, and a key of its own below.
    bool below_alias(const Level& item, const Level& level) {
        if (!level.text || text_.tokens[*level.text].kind != Kind::alias || item.list) return false;
        tell(*level.text,
             alias_and_more(text_.text(text_.tokens[*level.text]), text_.rest(item.first)));
        return true;
    }

    void report_below_value(const Level& item, const Level& level) {
        if (below_alias(item, level)) return;
        if (level.text && text_.tokens[level.last].kind == Kind::dash) {
            if (auto finding = missing_colon(text_, *level.text)) {
                findings_.push_back(*finding);
                return;
            }
        }
        if (level.list) return report_shift(item, level);
        const Level* list = levels_.size() > 1 ? &levels_[levels_.size() - 2] : nullptr;
        if (list != nullptr && is_dash_moved(item, *list, level)) {
            report_dash(*list, level, item);
            levels_.pop_back();
            return;
        }
        const std::size_t by = item.column - level.column;
        shift_ = level.column - item.column;
        tell(item.first, "indentation: " + name(item.first) + " is " + blanks(by) +
                             " deeper than " + name(level.last) + " on line " +
                             std::to_string(line(level.last)) +
                             ", which has a value already; take away " + blanks(by));
    }

    std::optional<std::size_t> column_of(const BlockLine& line) const {
        const auto first = line.dashes.empty() ? line.key : std::optional(line.dashes.front());
        if (!first) return std::nullopt;
        return text_.column(text_.tokens[*first]);
    }
    bool list_follows(std::size_t column) const {
        constexpr std::size_t kFar = 100;  // lines
        for (const BlockLine& line : behind_.first(std::min(kFar, behind_.size()))) {
            const auto begin = column_of(line);
            if (begin && *begin + 1 < column) return false;
            if (begin == column && !line.dashes.empty()) return true;
        }
        return false;
    }
    /// True if the first item's dash and key are one column off this key, and the next line has
    /// this key's column (or this column is even and the next line has not the first key's). The
    /// list has no other dash in its column.
    bool is_dash_moved(const Level& item, const Level& list, const Level& map) const {
        const std::size_t by =
            std::max(item.column, map.column) - std::min(item.column, map.column);
        const bool first = list.list && list.first == list.last && !map.list &&
                           map.first == map.last && line(list.first) == line(map.first);
        if (by != 1 || item.list || !first || list_follows(list.column)) return false;
        const auto next = behind_.empty() ? std::nullopt : column_of(behind_.front());
        return next == item.column || (item.column % 2 == 0 && next != map.column);
    }
    void report_dash(const Level& list, const Level& map, const Level& item) {
        const bool left = map.column < item.column;
        const bool wide = !left && map.column - list.column > 2;
        tell(list.first,
             wide ? "indentation: more than 1 blank after this '-'; take away 1, so that " +
                        name(map.first) + " is above " + name(item.first)
                  : std::string("indentation: this '-' is 1 blank too far ") +
                        (left ? "left" : "right") + "; " + (left ? "add" : "take away") +
                        " 1 blank, so that " + name(map.first) + " is above " + name(item.first));
    }

    static std::string blanks(std::size_t count) {
        return count == 1 ? "1 blank" : std::to_string(count) + " blanks";
    }
    void report_shift(const Level& item, const Level& sibling) {
        const bool left = item.column < sibling.column;
        shift_ = sibling.column - item.column;
        const std::size_t by = left ? sibling.column - item.column : item.column - sibling.column;
        tell(item.first, "indentation: " + name(item.first) + " is " + blanks(by) +
                             (left ? " left of " : " right of ") + like(sibling) + "; " +
                             (left ? "add " : "take away ") + blanks(by));
    }

    const Scanned& text_;
    Findings& findings_;
    std::vector<Level> levels_;
    /// Reported correction of the current line, modulo 2^64, for all its levels.
    std::size_t shift_ = 0;
    std::span<const BlockLine> behind_;
};

}  // namespace

void find_columns(const Scanned& text, Findings& findings) {
    Columns columns(text, findings);
    const std::vector<BlockLine> lines = block_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i)
        columns.read(lines[i], std::span(lines).subspan(i + 1));
}

}  // namespace panelgate::yaml
