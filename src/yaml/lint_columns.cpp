#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

using Kind = Token::Kind;

/// A line outside of brackets and block texts: `- - key: value`.
struct Row {
    std::size_t token = 0;            ///< its first
    std::vector<std::size_t> dashes;  ///< their columns
    std::optional<std::size_t> word;  ///< token of its key or text
    std::size_t column = 0;           ///< of that
    bool key = false;
    std::optional<std::size_t> value;  ///< token of the key's value on this line
    bool odd = false;                  ///< nobody knows its column
    bool brackets = false;             ///< its text is in brackets: it continues no other
    std::string_view name;             ///< its key, or the first in its brackets

    std::size_t at() const { return dashes.empty() ? column : dashes.front(); }
    void shift(std::ptrdiff_t by) {
        for (std::size_t& dash : dashes) dash += static_cast<std::size_t>(by);
        column += static_cast<std::size_t>(by);
    }
};

/// A list or map that is open at this place.
struct Level {
    std::size_t column = 0;
    bool list = false;
    std::size_t first = 0;       ///< row of its first dash or key
    std::size_t last = 0;        ///< and of its last
    std::string_view name = {};  ///< its first key, or that of its first item
    bool waits = true;           ///< its last has no value yet
};

/// What is open after some rows.
struct Reader {
    std::vector<Level> levels;
    std::ptrdiff_t flaws = 0;  ///< empty keys, repeated ones, items that begin with another key

    void pop() {
        flaws += levels.back().waits ? 1 : 0;
        levels.pop_back();
    }
    /// Returns false if the row cannot follow those before.
    bool read(const Row& row, std::size_t number) {
        if (row.odd) {
            if (levels.empty() || levels.back().waits) return true;
            levels.back().waits = true;
            --flaws;
            return true;
        }
        bool begins = true;
        for (const std::size_t dash : row.dashes) {
            // One text is like another.
            const std::string_view first = row.key || row.brackets ? row.name : " ";
            if (!enter({dash, true, number, number, first}, begins)) return false;
            begins = false;
        }
        if (!row.word) return true;
        if (row.key) {
            if (!enter({row.column, false, number, number, row.name}, begins)) return false;
        } else if (begins && !may_be_text(row)) {
            return false;
        }
        if (row.value || !row.key) levels.back().waits = false;
        return true;
    }
    bool may_be_text(const Row& row) const {
        if (levels.empty() || levels.back().column >= row.column) return false;
        return row.brackets ? levels.back().waits : !row.name.starts_with("<<");
    }
    /// A dash or a key; `begins` its line.
    bool enter(const Level& item, bool begins) {
        const std::size_t before = levels.size();
        while (begins && !levels.empty() && levels.back().column > item.column) pop();
        if (begins && !levels.empty() && levels.back().column == item.column) {
            const std::size_t size = levels.size();
            if (levels.back().list && !item.list && size > 1 &&
                levels[size - 2].column == item.column)
                pop();  // a list may be in the column of its key
            Level& level = levels.back();
            const bool below = item.list && !level.list && level.waits;
            if (!below && level.list != item.list) return false;
            if (!below) {
                const bool alike = item.name == level.name || level.name.empty();
                flaws += (level.waits ? 1 : 0) + (alike == item.list ? 0 : 1);
                level.last = item.first;
                level.waits = true;
                return true;
            }
        } else if (begins && (levels.size() < before || (before > 0 && !levels.back().waits))) {
            return false;
        }
        if (!levels.empty()) levels.back().waits = false;
        levels.push_back(item);
        return true;
    }
};

/// What one line may lack or have too much, to be undone.
struct Edit {
    enum class What : std::uint8_t { colon, dash_off, shift, dash_on, key };
    What what = What::colon;
    std::size_t row = 0;
    std::ptrdiff_t by = 0;  ///< columns; of a colon: 0 if nothing follows it
    bool deeper = false;    ///< with the lines below that are not left of it
};

/// An edit after which `right` is the first row that is wrong.
struct Cause {
    Edit edit;
    Reader before;  ///< the row
    std::size_t right = 0;
    std::ptrdiff_t flaws = 0;

    /// The least is the most likely: all else right, few flaws, then the nearest.
    auto order() const {
        const auto near = [](std::size_t number) { return ~number; };
        const std::ptrdiff_t typed = edit.what == Edit::What::shift ? std::abs(edit.by) : 2;
        return std::tuple(near(right), flaws, edit.what != Edit::What::colon, edit.deeper,
                          near(edit.row), edit.what == Edit::What::key, typed, edit.what,
                          std::abs(edit.by), edit.by < 0);
    }
};

/// Finds the line with the fault where one cannot follow those before it.
class Columns {
  public:
    Columns(const Scanned& text, Findings& findings) : text_(text), findings_(findings) {
        for (std::size_t i = 0; i < text.tokens.size(); ++i) {
            const Token& token = text.tokens[i];
            if (token.first && token.depth == 0 && token.kind != Kind::document)
                rows_.push_back(row_of(i));
        }
    }

    /// Goes on behind a missing colon only: what is below another fault may follow it.
    void find() {
        Reader reader;
        for (std::size_t row = 0; row < rows_.size() && findings_.size() < kMaxShown;) {
            before_ = reader;
            if (reader.read(rows_[row], row)) {
                ++row;
                continue;
            }
            if (tell_alias(row)) return;
            const auto cause = cause_of(row);
            if (!cause && !before_.levels.empty()) return;
            if (cause) {
                tell(*cause);
                const auto what = cause->edit.what;
                if (what != Edit::What::colon && what != Edit::What::key) return;
                row = cause->edit.row;
                undo(rows_[row], cause->edit);
                reader = cause->before;
            } else {
                rows_[row].odd = true;  // a title
            }
        }
    }

  private:
    Kind kind(std::size_t token) const { return text_.tokens[token].kind; }
    std::size_t column(std::size_t token) const {
        return static_cast<std::size_t>(text_.source.mark(text_.tokens[token].begin).column) - 1;
    }
    void tell(std::size_t token, std::string message) {
        findings_.push_back({text_.tokens[token].begin, std::move(message)});
    }
    std::string on_line(std::size_t row) const {
        return " on line " + std::to_string(text_.line(rows_[row].token));
    }
    std::string word(std::size_t row) const {
        const std::size_t token = rows_[row].word.value_or(rows_[row].token);
        return quote(kind(token) == Kind::plain ? text_.text(token) : text_.rest(token));
    }
    std::string name(std::size_t row) const {
        return rows_[row].dashes.empty() ? word(row) : "this '-'";
    }
    static std::string blanks(std::ptrdiff_t count) {
        return std::abs(count) == 1 ? "1 blank" : std::to_string(std::abs(count)) + " blanks";
    }

    Row row_of(std::size_t token) const {
        Row row;
        row.token = token;
        row.odd = has_wrong_indent(text_, text_.tokens[token]);
        std::size_t i = token;
        for (bool first = true; i < text_.tokens.size(); ++i, first = false) {
            if (!first && !text_.follows(i)) return row;
            if (kind(i) == Kind::dash)
                row.dashes.push_back(column(i));
            else if (kind(i) != Kind::anchor && kind(i) != Kind::tag)
                break;
        }
        if (i == text_.tokens.size()) return row;
        row.word = i;
        row.column = column(i);
        row.key = text_.follows(i + 1, Kind::colon);
        row.name = text_.text(i);
        row.brackets = kind(i) == Kind::open;
        if (row.brackets) row.name = i + 1 < text_.tokens.size() ? text_.text(i + 1) : "";
        if (!row.key) return row;
        i += 2;
        while (text_.follows(i) && (kind(i) == Kind::anchor || kind(i) == Kind::tag)) ++i;
        if (text_.follows(i)) row.value = i;
        return row;
    }

    /// `key: *alias` with keys below.
    bool tell_alias(std::size_t row) {
        const Row* above = before_.levels.empty() ? nullptr : &rows_[before_.levels.back().last];
        const bool below = above != nullptr && above->value && kind(*above->value) == Kind::alias &&
                           rows_[row].key && rows_[row].dashes.empty() &&
                           rows_[row].column > before_.levels.back().column;
        if (!below) return false;
        const std::string alias(text_.text(*above->value));
        tell(*above->value, "no key may be beside or below " + quote(alias) +
                                "; write {<<: " + alias + ", " +
                                std::string(clip(text_.rest(rows_[row].token), 60)) + '}');
        return true;
    }

    static void undo(Row& row, const Edit& edit) {
        using enum Edit::What;
        if (edit.what == key) row.odd = true;
        if (edit.what == colon) {
            row.key = true;
            if (edit.by > 0) row.value = row.word;
        } else if (edit.what == dash_off) {
            row.column = row.dashes.back();
            row.dashes.pop_back();
        } else {
            row.shift(edit.by);
        }
        if (edit.what != dash_on) return;
        row.dashes.push_back(row.column);
        row.column += 2;
    }

    /// Returns the mistake because of which row `fault` cannot follow those before it.
    std::optional<Cause> cause_of(std::size_t fault) const {
        constexpr std::size_t kBack = 24;
        std::set<std::size_t> rows;
        for (std::size_t row = fault - std::min(fault, kBack); row <= fault; ++row)
            rows.insert(row);
        for (const Level& level : before_.levels) rows.insert({level.first, level.last});
        std::optional<Cause> best;
        Reader reader;
        for (std::size_t row = 0; row <= fault; reader.read(rows_[row], row), ++row) {
            if (!rows.contains(row)) continue;
            for (const Edit& edit : edits_of(row, reader, fault)) {
                auto cause = tried(edit, reader, fault);
                if (cause && (!best || cause->order() < best->order())) best = std::move(cause);
            }
        }
        return best;
    }

    std::vector<Edit> edits_of(std::size_t row, const Reader& before, std::size_t fault) const {
        using enum Edit::What;
        const Row& own = rows_[row];
        std::vector<Edit> all;
        if (own.odd || !own.word) return all;
        const bool item = !own.dashes.empty();
        if (!own.key) {
            const auto finding = missing_colon(text_, *own.word);
            const bool ends = finding && finding->message.ends_with(":'");
            if (finding && !(ends && item)) all.push_back({colon, row, ends ? 0 : 1});
            if (!finding && !item && !before.levels.empty()) all.push_back({key, row});
        }
        if (before.levels.empty() && !own.key) return all;  // a title
        if (item) all.push_back({dash_off, row});
        const auto at = static_cast<std::ptrdiff_t>(own.at());
        if (!item && may_be_item(row, before)) {
            all.push_back({dash_on, row});
            if (at >= 2) all.push_back({dash_on, row, -2});
        }
        if (!own.key && !item && kind(*own.word) != Kind::open) return all;
        for (const std::ptrdiff_t by : shifts(row, before, fault)) {
            all.push_back({shift, row, by});
            if (row + 1 < rows_.size() && rows_[row + 1].at() >= own.at())
                all.push_back({shift, row, by, true});
        }
        return all;
    }

    /// A text is an item only among texts.
    bool may_be_item(std::size_t row, const Reader& before) const {
        if (rows_[row].key || kind(*rows_[row].word) == Kind::open) return true;
        return std::ranges::any_of(before.levels, [&](const Level& level) {
            return level.list && level.column == rows_[row].column && !rows_[level.first].key;
        });
    }

    /// Returns how far the row is from the columns around it.
    std::set<std::ptrdiff_t> shifts(std::size_t row, const Reader& before,
                                    std::size_t fault) const {
        constexpr std::size_t kDeep = 8;
        std::set<std::size_t> columns{rows_[fault].at()};
        const std::size_t depth = before.levels.size();
        for (std::size_t i = depth - std::min(depth, kDeep); i < depth; ++i)
            columns.insert({before.levels[i].column, before.levels[i].column + 2});
        if (depth > 0) columns.insert(before.levels.front().column);
        for (std::size_t i = row - std::min<std::size_t>(row, 1); i < rows_.size() && i < row + 2;
             ++i)
            if (i != row) columns.insert({rows_[i].at(), rows_[i].column});
        std::set<std::ptrdiff_t> all;
        for (const std::size_t to : columns) {
            for (const std::size_t from : {rows_[row].at(), rows_[row].column}) {
                const auto by = static_cast<std::ptrdiff_t>(to) - static_cast<std::ptrdiff_t>(from);
                if (by != 0 && static_cast<std::ptrdiff_t>(rows_[row].at()) + by >= 0)
                    all.insert(by);
            }
        }
        return all;
    }

    std::optional<Cause> tried(const Edit& edit, const Reader& before, std::size_t fault) const {
        constexpr std::size_t kAhead = 200;  // rows
        Reader reader = before;
        const std::size_t end = std::min(rows_.size(), fault + kAhead);
        std::size_t row = edit.row;
        for (bool edited = true; row < end; ++row) {
            const Row* read = &rows_[row];
            Row undone;
            edited =
                row == edit.row || (edited && edit.deeper && read->at() >= rows_[edit.row].at());
            if (edited) {
                undone = *read;
                undo(undone, edit);
                read = &undone;
            }
            if (!reader.read(*read, row)) break;
        }
        if (row <= fault) return std::nullopt;
        while (row == rows_.size() && !reader.levels.empty()) reader.pop();
        return Cause{edit, before, row, reader.flaws};
    }

    /// Returns a row that is where the edited one should be, below it or open before it.
    std::optional<std::size_t> neighbour(const Cause& cause, bool below) const {
        Row own = rows_[cause.edit.row];
        undo(own, cause.edit);
        const auto& levels = cause.before.levels;
        const auto level = std::ranges::find_if(levels, [&](const Level& open) {
            return open.column == own.at() && open.list != own.dashes.empty();
        });
        if (!below && level != levels.end()) return level->first;
        for (std::size_t row = cause.edit.row + 1; row < cause.right; ++row)
            if (rows_[row].at() == own.at() && rows_[row].dashes.empty() == own.dashes.empty())
                return row;
        return std::nullopt;
    }

    void tell(const Cause& cause) {
        const Edit& edit = cause.edit;
        const Row& row = rows_[edit.row];
        switch (edit.what) {
            case Edit::What::colon:
                findings_.push_back(*missing_colon(text_, *row.word));
                return;
            case Edit::What::key:
                tell(row.token, "a key and ': ' are missing before " + word(edit.row) +
                                    "; a text of several lines must be indented deeper than its "
                                    "key");
                return;
            case Edit::What::dash_on:
                tell(row.token, "a '- ' is missing before " + word(edit.row) +
                                    (edit.by == 0 ? " (a new item of the list)"
                                                  : "; type it in place of the 2 blanks there"));
                return;
            case Edit::What::dash_off: {
                const auto near = neighbour(cause, true);
                tell(*row.word - 1,
                     "one '-' too many" +
                         (near ? ": " + word(*near) + on_line(*near) + ", in the same map, has none"
                               : "") +
                         "; remove it");
                return;
            }
            case Edit::What::shift:
                tell_shift(cause);
        }
    }

    void tell_shift(const Cause& cause) {
        const Edit& edit = cause.edit;
        const bool left = edit.by > 0;
        const auto near = neighbour(cause, false);
        const bool list = near && !rows_[edit.row].dashes.empty();
        const std::string like = !near  ? " of the column of its neighbours"
                                 : list ? " of the '-'" + on_line(*near)
                                        : " of " + word(*near) + on_line(*near);
        tell(rows_[edit.row].token, "indentation: " + name(edit.row) + " is " + blanks(edit.by) +
                                        (left ? " left" : " right") + like +
                                        (left ? "; add " : "; take away ") + blanks(edit.by));
    }

    const Scanned& text_;
    Findings& findings_;
    std::vector<Row> rows_;
    Reader before_;  ///< the row that is read
};

}  // namespace

void find_columns(const Scanned& text, Findings& findings) { Columns(text, findings).find(); }

}  // namespace panelgate::yaml
