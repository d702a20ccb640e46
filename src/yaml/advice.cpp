#include "advice.hpp"

#include <algorithm>
#include <map>
#include <regex>
#include <tuple>
#include <utility>

#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

constexpr std::size_t kWindow = 200;  // lines before a parser's error in which its cause is sought

constexpr std::size_t kShownTail = 30;  // letters of a text that is quoted

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::size_t behind_blanks(std::string_view text, std::size_t at) {
    while (at < text.size() && is_blank(text[at])) ++at;
    return at;
}

// Columns

/// A line outside of brackets: `- - key: value`.
struct Row {
    std::size_t begin = 0;  ///< offsets: of the line, of its first dash or word,
    std::size_t at = 0;
    std::size_t word = 0;  ///< of its key or text, and behind all
    std::size_t end = 0;
    std::vector<std::size_t> columns{};  ///< of its dashes, then of its word, if there is one
    std::size_t dashes = 0;
    bool key = false;
    bool value = false;       ///< of the key, on this line
    bool bracket = false;     ///< the word is a list or map in brackets
    std::string_view name{};  ///< of the key

    bool has_word() const { return word < end; }
};

/// Where the key's colon is; npos: the text begins with no key.
std::size_t colon_of(std::string_view rest) {
    const char first = rest[0];
    if (first == '[' || first == '{') return rest.npos;
    const std::size_t bracket = rest.find_first_of("{[");
    if (first == '"' || first == '\'') {
        const std::size_t close = rest.find(first, 1);
        const std::size_t colon = close == rest.npos ? close : behind_blanks(rest, close + 1);
        return colon < rest.size() && rest[colon] == ':' ? colon : rest.npos;
    }
    std::size_t colon = rest.find(':');
    while (colon != rest.npos && colon + 1 < rest.size() && !is_blank(rest[colon + 1]))
        colon = rest.find(':', colon + 1);
    return colon < bracket ? colon : rest.npos;
}

Row row_of(std::string_view text, const TextLine& line) {
    Row row{line.begin, line.at, line.at, line.end};
    while (row.word < row.end && text[row.word] == '-' &&
           (row.word + 1 >= row.end || is_blank(text[row.word + 1]))) {
        row.columns.push_back(row.word - row.begin);
        row.word = std::min(behind_blanks(text, row.word + 1), row.end);
    }
    row.dashes = row.columns.size();
    if (!row.has_word()) return row;
    row.columns.push_back(row.word - row.begin);
    const std::string_view rest = text.substr(row.word, row.end - row.word);
    const std::size_t colon = colon_of(rest);
    row.bracket = rest[0] == '{' || rest[0] == '[';
    if (colon == rest.npos) return row;
    row.key = true;
    row.name = rest.substr(0, colon);
    const std::size_t value = behind_blanks(rest, colon + 1);
    const bool names = value < rest.size() && (rest[value] == '&' || rest[value] == '!');
    row.value = value < rest.size() && !(names && rest.find(' ', value) == rest.npos);
    return row;
}

/// A list or map that is open at a row.
struct Level {
    std::size_t column = 0;
    bool list = false;
    std::size_t row = 0;  ///< of its first dash or key
    bool waits = true;    ///< its last dash or key has no value yet
};
using Levels = std::vector<Level>;

/// Opens or goes on with a list or map. Returns false if the row cannot follow those before.
bool enter(Levels& levels, std::size_t column, bool list, std::size_t row, bool begins) {
    while (!levels.empty() && levels.back().column > column) levels.pop_back();
    if (!levels.empty() && levels.back().column == column && levels.back().list && !list)
        levels.pop_back();
    if (!levels.empty() && levels.back().column == column && levels.back().list == list) {
        levels.back().waits = true;
        return true;
    }
    const bool fits = levels.empty()
                          ? row == 0 || !begins
                          : levels.back().waits && (list || levels.back().column < column);
    if (!fits) return false;
    if (!levels.empty()) levels.back().waits = false;
    levels.push_back({column, list, row});
    return true;
}

bool read_row(Levels& levels, const Row& row, std::size_t number) {
    for (std::size_t i = 0; i < row.columns.size(); ++i) {
        const std::size_t column = row.columns[i];
        const bool list = i < row.dashes;
        if (!list && !row.key) {
            // A text: the value of a dash or key above, or its next line.
            if (levels.empty() || (i == 0 && column <= levels.back().column)) return false;
            if (row.bracket && !levels.back().waits) return false;
            levels.back().waits = false;
            return true;
        }
        if (!enter(levels, column, list, number, i == 0)) return false;
        if (!list) levels.back().waits = !row.value;
    }
    return true;
}

/// What a user may have meant: `count` rows from `row` on are moved, or the row has a dash more or
/// less.
struct Edit {
    std::size_t row = 0;
    std::size_t count = 1;
    std::ptrdiff_t by = 0;   ///< columns
    int dashes = 0;          ///< +1, -1
    std::size_t beside = 0;  ///< the row whose column is meant
    bool likely = false;     ///< other rows show that the dash is wrong
    std::size_t next = 0;    ///< the first row that cannot follow then

    Row applied(Row row_before) const {
        std::vector<std::size_t>& columns = row_before.columns;
        for (std::size_t& column : columns) column += static_cast<std::size_t>(by);
        if (dashes < 0) {  // the word takes the place of the last dash
            columns.pop_back();
            --row_before.dashes;
        } else if (dashes > 0) {
            columns.push_back(columns.back() + 2);
            ++row_before.dashes;
        }
        return row_before;
    }
};

class Columns {
  public:
    Columns(std::string_view text, std::vector<Row> rows,
            std::span<const std::string_view> sections)
        : text_(text), rows_(std::move(rows)), sections_(sections) {}

    /// Returns the first line that cannot follow the lines above, with the probable intention.
    std::optional<Finding> find() {
        Levels levels;
        for (; wrong_ < rows_.size(); ++wrong_) {
            Levels next = levels;
            if (!read_row(next, rows_[wrong_], wrong_)) break;
            if (history_.size() == kBack) history_.erase(history_.begin());
            history_.push_back(std::exchange(levels, std::move(next)));
        }
        if (wrong_ == rows_.size()) return std::nullopt;
        history_.push_back(levels);
        const std::optional<Edit> best = best_of(edits(levels));
        if (!best) return std::nullopt;
        return Finding{rows_[best->row].at, told(*best)};
    }

  private:
    static constexpr std::size_t kBack = 40;    ///< rows before the wrong one that may be meant
    static constexpr std::size_t kAhead = 100;  ///< rows behind it that must fit

    std::string shown(std::size_t row) const {
        return rows_[row].dashes > 0 ? "the '-'" : quote(rows_[row].name);
    }
    std::string line(std::size_t row) const {
        const auto end = text_.begin() + static_cast<std::ptrdiff_t>(rows_[row].begin);
        return std::to_string(std::count(text_.begin(), end, '\n') + 1);
    }
    /// Rows from this one on that begin in one column.
    std::size_t rows_beside(std::size_t first) const {
        std::size_t end = first + 1;
        while (end < rows_.size() && rows_[end].columns.front() == rows_[first].columns.front())
            ++end;
        return end - first;
    }

    std::vector<Edit> edits(const Levels& levels) const {
        std::vector<Edit> all;
        for (const Level& level : levels) add_edits(all, level);
        if (wrong_ > 0) add_edits_above(all, levels);
        return all;
    }
    /// Moves rows from `from` on, which begin at `at`, to the column `to`.
    void add_move(std::vector<Edit>& all, std::size_t from, std::size_t at, std::size_t to,
                  std::size_t beside) const {
        const auto by = static_cast<std::ptrdiff_t>(to) - static_cast<std::ptrdiff_t>(at);
        if (by == 0) return;
        const bool section = to == 0 && rows_[from].dashes == 0 &&
                             std::ranges::find(sections_, rows_[from].name) != sections_.end();
        all.push_back({from, 1, by, 0, beside, section});
        const std::size_t count = from == wrong_ ? rows_beside(from) : 1;
        if (count > 1) all.push_back({from, count, by, 0, beside});
    }
    /// What the wrong row may mean in an open list or map.
    void add_edits(std::vector<Edit>& all, const Level& level) const {
        const Row& row = rows_[wrong_];
        const std::size_t column = row.columns.front();
        const bool dash = row.dashes > 0;
        const bool again = rows_[level.row].name == row.name;
        if (level.list == dash) add_move(all, wrong_, column, level.column, level.row);
        if (level.list && level.column == column && !dash) {
            all.push_back({wrong_, 1, 0, 1, level.row, again});
            if (row.key && !again) all.push_back({level.row, 1, 0, -1, wrong_, row.value});
        }
        if (level.list && row.bracket && column == level.column + 2)
            all.push_back({wrong_, 1, -2, 1, level.row, true});
        if (level.list && dash && level.column > column) move_rows(all, level, column);
        if (level.list || !dash) return;
        if (row.key && !row.value && level.column == column)
            all.push_back({wrong_, 1, 0, -1, level.row, !again});
        if (level.column == column + 2) all.push_back({level.row, 1, -2, 1, wrong_});
    }
    /// What the row above, or the first row, may mean.
    void add_edits_above(std::vector<Edit>& all, const Levels& levels) const {
        const Row& row = rows_[wrong_];
        const Row& above = rows_[wrong_ - 1];
        const std::size_t column = row.columns.front();
        const bool dash = row.dashes > 0;
        if (!dash) add_move(all, wrong_ - 1, above.columns.back(), column, wrong_);
        if (!dash && !levels.front().list && column < levels.front().column)
            add_move(all, levels.front().row, levels.front().column, column, wrong_);
        if (dash && above.dashes == 0 && !above.key && above.columns.front() >= column)
            all.push_back({wrong_ - 1, 1, above.columns.front() > column ? -2 : 0, 1, wrong_});
        const bool beside = wrong_ + 1 < rows_.size() && rows_[wrong_ + 1].dashes == 0 &&
                            rows_[wrong_ + 1].columns.front() == column;
        const bool item = std::ranges::any_of(levels, [&](const Level& level) {
            return level.list && rows_[level.row].name == row.name;
        });
        if (dash && beside && !item) all.push_back({wrong_, 1, 0, -1, wrong_ + 1, true});
    }

    /// The first item of a list is moved to the column of the wrong row.
    void move_rows(std::vector<Edit>& all, const Level& list, std::size_t column) const {
        const auto by =
            static_cast<std::ptrdiff_t>(column) - static_cast<std::ptrdiff_t>(list.column);
        all.push_back({list.row, wrong_ - list.row, by, 0, wrong_});
    }

    /// The first row that cannot follow after this edit; at most kAhead behind the wrong one.
    std::size_t next_wrong(const Edit& edit) const {
        const std::size_t back = wrong_ - edit.row;
        if (edit.row > 0 && back >= history_.size()) return 0;
        Levels levels;
        if (edit.row > 0) levels = history_[history_.size() - 1 - back];
        const std::size_t end = std::min(rows_.size(), wrong_ + kAhead);
        for (std::size_t i = edit.row; i < end; ++i) {
            const bool edited = i < edit.row + edit.count;
            if (!read_row(levels, edited ? edit.applied(rows_[i]) : rows_[i], i)) return i;
        }
        return end;
    }

    std::optional<Edit> best_of(std::vector<Edit> all) const {
        for (Edit& edit : all) edit.next = next_wrong(edit);
        const auto rank = [&](const Edit& edit) {
            const std::ptrdiff_t size = edit.dashes == 0 ? std::abs(edit.by) : 2;
            // A key that opens a map is rather one of an outer map than of the map before.
            const bool outer =
                edit.by < 0 && !rows_[edit.row].value &&
                edit.by + static_cast<std::ptrdiff_t>(rows_[edit.row].columns.front()) > 0;
            return std::tuple(edit.next, edit.likely, -static_cast<std::ptrdiff_t>(edit.count),
                              -size, edit.dashes == 0, edit.row, outer, edit.by > 0);
        };
        const auto best = std::ranges::max_element(all, {}, rank);
        if (best == all.end() || best->next <= wrong_) return std::nullopt;
        return *best;
    }

    std::string told(const Edit& edit) const {
        const Row& row = rows_[edit.row];
        const std::string_view word = text_.substr(row.word, row.end - row.word);
        if (edit.dashes > 0)
            return "a '- ' is missing before " + quote(row.key ? row.name : word) +
                   (edit.by < 0 ? "; type it in place of the 2 blanks there"
                                : " (a new item of the list)");
        if (edit.dashes < 0)
            return "one '-' too many: " + quote(rows_[edit.beside].name) + " on line " +
                   line(edit.beside) + ", in the same map, has none; remove it";
        const std::string blanks =
            std::to_string(std::abs(edit.by)) + (std::abs(edit.by) == 1 ? " blank" : " blanks");
        const bool dash = row.dashes > 0 && rows_[edit.beside].dashes > 0;
        const bool left = edit.by > 0;
        const std::string other = dash ? "the '-'" : quote(rows_[edit.beside].name);
        return "indentation: " + (dash ? "this '-'" : quote(row.key ? row.name : word)) + " is " +
               blanks + (left ? " left of " : " right of ") + other + " on line " +
               line(edit.beside) + (left ? "; add " : "; take away ") + blanks;
    }

    std::string_view text_;
    std::vector<Row> rows_;
    std::span<const std::string_view> sections_;
    std::size_t wrong_ = 0;
    std::vector<Levels> history_;  ///< before the rows up to the wrong one
};

using Match = std::match_results<std::string_view::const_iterator>;

/// A comma that is missing inside of brackets: before a key of a line, or of the line below.
std::optional<Finding> comma_in(std::string_view text, const TextLine& line,
                                const TextLine* above) {
    static const std::regex kMissing(
        R"re(.*?[{,] *("[^"]*"|[A-Za-z0-9][\w-]*) *: *([^ ,:{}[\]]+|"[^"]*"|\[[^\]]*\]) +((["]?)([A-Za-z0-9][\w-]*)\4: .*))re");
    const std::string_view rest =
        text.substr(line.at, std::min<std::size_t>(line.end - line.at, kWindow));
    if (rest.empty()) return std::nullopt;
    const bool inside = above != nullptr && line.depth > 0 && rest[0] != ']' && rest[0] != '}';
    if (inside && std::string_view(",{[:").find(text[above->end - 1]) == rest.npos)
        return Finding{above->end, "a ',' is missing at the end of this line"};
    Match match;
    if (!std::regex_match(rest.begin(), rest.end(), match, kMissing)) return std::nullopt;
    return Finding{line.at + static_cast<std::size_t>(match.position(3)),
                   "a ',' is missing before " + quote(match[5].str())};
}

/// A text behind the bracket that ends a line's value. Lines with quotes are left alone.
std::optional<Finding> behind_bracket(std::string_view text, const TextLine& line) {
    const std::string_view rest = text.substr(line.at, line.end - line.at);
    if (line.depth > 0 || rest.find_first_of("\"'") != rest.npos) return std::nullopt;
    int depth = 0;
    for (std::size_t at = 0; at < rest.size(); ++at) {
        if (rest[at] == '{' || rest[at] == '[') ++depth;
        if ((rest[at] != '}' && rest[at] != ']') || --depth != 0) continue;
        const std::size_t next = rest.find_first_not_of(" \t", at + 1);
        if (next == rest.npos || rest[next] == ':') return std::nullopt;
        return Finding{line.at + next, quote(rest.substr(next, kShownTail)) +
                                           " is after the closing " + rest[at] + "; remove it"};
    }
    return std::nullopt;
}

// Characters that look like a blank, or are invisible, but are no blank to YAML

bool is_wrong_blank(char32_t c) {
    return c == 0xA0 || c == 0x3000 || c == 0xFEFF || c == 0x202F || (c >= 0x2000 && c <= 0x200F);
}

/// The first of a line where a blank has a meaning: at both ends, and beside a colon or a dash.
std::optional<Finding> wrong_blank(std::string_view text, const TextLine& line) {
    const std::size_t value = text.substr(line.at, line.end - line.at).find(": ");
    for (std::size_t at = line.at; at < line.end;) {
        const std::string_view character = character_at(text, at);
        const char32_t c = code_point(character);
        const std::size_t behind = at + character.size();
        const char before = at > line.at ? text[at - 1] : ' ';
        const bool divides =
            (value == text.npos || at <= line.at + value) && (before == ':' || before == '-');
        if (is_wrong_blank(c) && (before == ' ' || divides || behind >= line.end))
            return Finding{at, name_of(c) +
                                   (c == 0xA0 ? " (a no-break space)" : " (an unusual blank)") +
                                   " is here; type an ordinary blank in its place"};
        at = behind;
    }
    return std::nullopt;
}

std::optional<Finding> tab_in(std::string_view text, const TextLine& line) {
    const std::size_t tab = text.substr(0, line.end).find('\t', line.begin);
    if (line.depth == 0 && tab < line.at)
        return Finding{tab, "a tab in the indentation; type blanks in its place"};
    const bool dash = line.depth == 0 && text[line.at] == '-' && tab == line.at + 1;
    if (dash && text.substr(tab, line.end - tab).find(':') != text.npos)
        return Finding{tab, "a tab after '-'; type a blank in its place"};
    return std::nullopt;
}

/// The first finding of each line, a few, in the order of the text.
Findings sorted(std::string_view text, const Findings& all) {
    std::map<std::size_t, Finding> lines;
    for (const Finding& finding : all)
        lines.emplace(text.substr(0, finding.offset).rfind('\n') + 1, finding);
    Findings shown;
    for (auto& [line, finding] : lines)
        if (shown.size() < kMaxShown) shown.push_back(std::move(finding));
    return shown;
}

void take(Findings& findings, std::optional<Finding> finding) {
    if (finding && findings.size() < 2 * kMaxShown) findings.push_back(std::move(*finding));
}

std::optional<Finding> slip_in(std::string_view text, const Row& row, On on) {
    return slip_of(text.substr(row.word, row.end - row.word), row.word, on);
}

bool is_marker(std::string_view text, const TextLine& line) {
    return text.substr(line.at, 3) == "---" || text.substr(line.at, 3) == "...";
}

/// True for a line that is neither a key nor an item, among keys.
bool is_odd(const std::vector<Row>& rows, std::size_t i) {
    const Row& row = rows[i];
    if (row.key || !row.has_word()) return false;
    const std::size_t column = row.columns.back();
    const bool above = row.dashes == 0 && (i == 0 || column <= rows[i - 1].columns.back());
    const bool below = i + 1 < rows.size() && rows[i + 1].key && rows[i + 1].dashes == 0 &&
                       rows[i + 1].columns.front() == column;
    return above || below;
}

}  // namespace

Findings find_traps(std::string_view text, const Lines& lines) {
    Findings findings = lines.quotes;
    for (const TextLine& line : lines.all) {
        take(findings, tab_in(text, line));
        take(findings, wrong_blank(text, line));
        const bool may_slip =
            text.substr(line.at, line.end - line.at).find_first_of("{\xE2\xC2<|=>/-;*") !=
            text.npos;
        if (may_slip && !is_marker(text, line))
            take(findings, slip_in(text, row_of(text, line), On::any));
    }
    return sorted(text, findings);
}

Findings find_causes(std::string_view text, const Lines& lines, std::size_t error,
                     std::span<const std::string_view> sections) {
    Findings findings = find_traps(text, lines);
    std::vector<Row> rows;
    const TextLine* above = nullptr;
    const auto last = std::ranges::upper_bound(lines.all, error, {}, &TextLine::begin);
    const auto from = last - std::min<std::ptrdiff_t>(kWindow, last - lines.all.begin());
    std::size_t seen = 0;  // rows before the window
    for (auto line = lines.all.begin(); line != lines.all.end(); above = &*line, ++line) {
        if (is_marker(text, *line)) continue;
        const Row row = row_of(text, *line);
        if (line >= from && line <= last) {
            if (lines.brackets.empty()) take(findings, comma_in(text, *line, above));
            take(findings, slip_in(text, row, On::refused));
            take(findings, behind_bracket(text, *line));
        }
        if (line->depth > 0) continue;
        rows.push_back(row);
        if (line < from) seen = rows.size();
    }
    for (std::size_t i = seen; i < rows.size() && i < seen + 2 * kWindow; ++i)
        if (is_odd(rows, i)) take(findings, slip_in(text, rows[i], On::odd));
    if (lines.quotes.empty())
        findings.insert(findings.end(), lines.brackets.begin(), lines.brackets.end());
    if (!findings.empty()) return sorted(text, findings);
    take(findings, Columns(text, std::move(rows), sections).find());
    return findings;
}

std::string without_blank_tabs(std::string bytes) {
    for (std::size_t begin = 0; begin < bytes.size();) {
        const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
        const std::size_t at = std::min(bytes.find_first_not_of(" \t\r", begin), end);
        if (at == end || bytes[at] == '#')
            std::replace(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                         bytes.begin() + static_cast<std::ptrdiff_t>(at), '\t', ' ');
        begin = end + 1;
    }
    return bytes;
}

}  // namespace panelgate::yaml
