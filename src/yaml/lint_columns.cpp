#include <cctype>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "block_line.hpp"
#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

bool is_word(std::string_view text) {
    if (text.empty()) return false;
    for (const char c : text) {
        const bool letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
        if (!letter && c != '_' && c != '-') return false;
    }
    return std::isalpha(static_cast<unsigned char>(text[0])) != 0;
}

/// What a line without a ': ' should have been, if it began with a key.
std::optional<Finding> missing_colon(const Scanned& text, std::size_t token) {
    const Token& line = text.tokens[token];
    const std::string_view word = text.text(line);
    if (line.kind != Kind::plain) return std::nullopt;
    if (word.starts_with("//") || word.starts_with("/*") || word.starts_with(';'))
        return Finding{line.begin, "a comment begins with '#'"};
    const std::size_t end = std::min(word.find_first_of(":= \t\xEF"), word.size());
    const std::string_view key = word.substr(0, end);
    const std::string_view rest = word.substr(end);
    if (!is_word(key)) return std::nullopt;
    constexpr std::string_view kWide = "\xEF\xBC\x9A";  // U+FF1A, as Asian keyboards type it
    const auto shown = [&](std::string_view value) {
        value.remove_prefix(std::min(value.find_first_not_of(" \t:="), value.size()));
        return "write '" + std::string(key) + (value.empty() ? ":" : ": ") +
               std::string(clip(value, 60)) + '\'';
    };
    if (rest.starts_with(kWide))
        return Finding{line.begin + end, "U+FF1A is no colon; " + shown(rest.substr(3))};
    if (rest.starts_with("://")) return std::nullopt;
    if (rest.starts_with(':'))
        return Finding{line.begin + end + 1, "a blank is missing after '" + std::string(key) +
                                                 ":'; " + shown(rest.substr(1))};
    const std::size_t sign = std::min(rest.find_first_not_of(" \t"), rest.size());
    if (rest.substr(sign).starts_with('='))
        return Finding{line.begin + end + sign,
                       "a key is followed by ':', not '='; " + shown(rest)};
    return Finding{line.begin + end,
                   "a ':' is missing after '" + std::string(key) + "'; " + shown(rest)};
}

/// A list or map that is open at this place.
struct Level {
    std::size_t column = 0;
    std::optional<std::size_t> meant;  ///< column, of what was told to be shifted
    bool list = false;
    bool waits = false;               ///< its last item or key has no value yet
    std::size_t first = 0;            ///< token of its first dash or key
    std::size_t last = 0;             ///< and of its last
    std::optional<std::size_t> text;  ///< of its last, on its line
};

class Columns {
  public:
    Columns(const Scanned& text, Findings& findings) : text_(text), findings_(findings) {}

    void read(const BlockLine& line) {
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
        if (is_oddly_indented(text_, text_.tokens[item.first])) {
            if (!levels_.empty()) levels_.back().waits = true;  // where it belongs, nobody knows
            return;
        }
        const bool glued_dash = !item.list && lacks_blank(*line.key);
        item.list = item.list || glued_dash;
        enter(item);
        for (std::size_t i = 1; i < line.dashes.size(); ++i) push(line.dashes[i], true);
        if (item.list && line.key) {
            levels_.back().waits = false;
            push(*line.key, false);
            if (glued_dash) levels_.back().column += 2;  // where the key should have stood
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
        if (!line.key || !line.text || text_.tokens[*line.text].kind != Kind::plain) return;
        const std::size_t behind = *line.text + 1;
        if (!text_.follows(behind) || text_.tokens[behind].kind != Kind::colon) return;
        const std::string all(clip(text_.rest(*line.text), 60));
        tell(*line.text, "a text that holds ': ' must stand in quotes; write \"" + all +
                             "\", or begin a new line for a second key");
    }

    /// Of a level that has just been left, or that is there, as "as 'name' on line 2".
    std::string like(const Level& level) const {
        const std::string what =
            text_.tokens[level.first].kind == Kind::dash ? "the '-'" : name(level.first);
        return what + " on line " + std::to_string(line(level.first));
    }

    /// A line without key and dash: a text goes on, or a colon was forgotten.
    void text_alone(std::size_t token) {
        const std::size_t column = text_.column(text_.tokens[token]);
        while (levels_.size() > 1 && levels_.back().column > column) levels_.pop_back();
        if (levels_.empty()) {
            if (auto finding = missing_colon(text_, token)) findings_.push_back(*finding);
            return;
        }
        Level& level = levels_.back();
        if (level.column < column) {
            level.waits = false;
            return;
        }
        if (auto finding = missing_colon(text_, token)) {
            findings_.push_back(*finding);
        } else {
            tell(token, "a key and ': ' are missing before " + quote(text_.rest(token)) +
                            "; a text of several lines must stand deeper than its key");
        }
        level.waits = true;  // whatever follows deeper is of this line
    }

    void enter(Level item) {
        item.last = item.first;
        go_where_it_was_meant(item);
        std::optional<Level> left;  // the outermost that ends here
        while (!levels_.empty() && levels_.back().column > item.column) {
            left = levels_.back();
            levels_.pop_back();
        }
        if (levels_.empty()) {
            if (left) tell_shift(item, *left);
            if (shift_ != 0) item.meant = item.column + shift_;
            levels_.push_back(item);
        } else if (levels_.back().column == item.column) {
            go_on(item, left);
        } else {
            deeper(item, left);
        }
    }

    /// What follows a line that was shifted may stand where that should have.
    void go_where_it_was_meant(const Level& item) {
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
            levels_.pop_back();  // a list may stand in the column of its key
            level = &levels_.back();
        }
        if (level->list == item.list) {
            level->last = item.first;
        } else if (item.list && level->waits) {
            levels_.push_back(item);
        } else if (item.list) {
            tell(item.first, "indentation: this '-' stands in the column of " + name(level->last) +
                                 " on line " + std::to_string(line(level->last)) +
                                 ", which has a value; a list stands below a key without one");
        } else {
            const bool deeper = left && !left->list;
            tell(item.first,
                 "a '- ' is missing before " + name(item.first) + " (a new item of the list)" +
                     (deeper ? ", or blanks, until it stands below " + like(*left) : ""));
            if (deeper) levels_.push_back(*left);
        }
    }

    /// Between two levels, or below a value.
    void deeper(Level item, const std::optional<Level>& left) {
        const Level level = levels_.back();
        if (left) {
            const bool nearer = item.column - level.column < left->column - item.column;
            const bool both = level.list == left->list;
            tell_shift(item, (both ? nearer : level.list == item.list) ? level : *left);
        } else if (!level.waits) {
            tell_below_value(item, level);
        }
        if (shift_ != 0) item.meant = item.column + shift_;
        if (item.meant == level.column && level.list == item.list) levels_.pop_back();
        levels_.push_back(item);
    }

    void tell_below_value(const Level& item, const Level& level) {
        if (level.text && text_.tokens[level.last].kind == Kind::dash) {
            if (auto finding = missing_colon(text_, *level.text)) {
                findings_.push_back(*finding);
                return;
            }
        }
        if (level.list) return tell_shift(item, level);
        const std::size_t by = item.column - level.column;
        shift_ = level.column - item.column;
        tell(item.first, "indentation: " + name(item.first) + " stands " + blanks(by) +
                             " deeper than " + name(level.last) + " on line " +
                             std::to_string(line(level.last)) +
                             ", which has a value already; take away " + blanks(by));
    }

    static std::string blanks(std::size_t count) {
        return count == 1 ? "1 blank" : std::to_string(count) + " blanks";
    }
    void tell_shift(const Level& item, const Level& sibling) {
        const bool left = item.column < sibling.column;
        shift_ = sibling.column - item.column;
        const std::size_t by = left ? sibling.column - item.column : item.column - sibling.column;
        tell(item.first, "indentation: " + name(item.first) + " stands " + blanks(by) +
                             (left ? " left of " : " right of ") + like(sibling) + "; " +
                             (left ? "add " : "take away ") + blanks(by));
    }

    const Scanned& text_;
    Findings& findings_;
    std::vector<Level> levels_;
    /// Of the line in work, modulo 2^64: what was told to be added, for all that stands on it.
    std::size_t shift_ = 0;
};

}  // namespace

void find_columns(const Scanned& text, Findings& findings) {
    Columns columns(text, findings);
    for (const BlockLine& line : block_lines(text)) columns.read(line);
}

}  // namespace panelgate::yaml
