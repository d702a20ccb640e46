// Reads a text line by line, also where it is no YAML.

#include <algorithm>
#include <utility>

#include "advice.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

constexpr auto kNone = std::string_view::npos;
constexpr std::size_t kLongest = 60;        // bytes of a text that is quoted in advice
constexpr std::string_view kEnds = ",:]}";  // behind a closing quote

bool is_gap(char c) { return c == ' ' || c == '\t'; }
bool is_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
}

class LineReader {
  public:
    LineReader(std::string_view text, Lines& lines) : text_(text), lines_(lines) {}

    void read() {
        for (std::size_t begin = 0; begin < text_.size();) {
            const std::size_t end = std::min(text_.find('\n', begin), text_.size());
            read_line(begin, end);
            begin = end + 1;
        }
        if (quote_ != kNone) forget_quote();
        forget_brackets();
    }

  private:
    char byte(std::size_t at) const { return at < text_.size() ? text_[at] : '\n'; }
    bool ends_word(std::size_t at) const {
        return is_gap(byte(at)) || byte(at) == '\n' || byte(at) == '\r';
    }
    bool is_dash(std::size_t at) const { return byte(at) == '-' && ends_word(at + 1); }

    void read_line(std::size_t begin, std::size_t end) {
        std::size_t at = text_.find_first_not_of(" \t\r", begin);
        const bool directive = lines_.all.empty() && text_.substr(begin).starts_with('%');
        if (at >= end || directive) return;
        const std::size_t indent = at - begin;
        if (block_ && indent > *block_) return;
        block_.reset();
        if (quote_ != kNone) {
            if (indent <= parent_ && text_[at] != text_[quote_]) {
                forget_quote();
            } else {
                at = close_quote(begin, end);
                if (at == kNone) return;
            }
        }
        if (!open_.empty() && ends_brackets(at, indent)) forget_brackets();
        lines_.all.push_back({begin, at, at, open_.size()});
        if (open_.empty()) parent_ = column_of_key(begin, at);
        lines_.all.back().end = read_words(begin, at, end);
        if (lines_.all.back().end == at) lines_.all.pop_back();  // a comment alone
    }

    /// Column of the key of this line, or of its last dash.
    std::size_t column_of_key(std::size_t begin, std::size_t at) const {
        std::size_t key = at;
        while (is_dash(key)) {
            const std::size_t next = text_.find_first_not_of(" \t", key + 1);
            if (next == kNone || byte(next) == '\n' || byte(next) == '\r') break;
            key = next;
        }
        return key - begin;
    }

    /// Reads on to the end of the line or to a comment. Returns where the text ends.
    std::size_t read_words(std::size_t begin, std::size_t from, std::size_t end) {
        std::size_t last = from;
        for (std::size_t i = from; i < end; ++i) {
            const char c = text_[i];
            if (is_gap(c) || c == '\r') continue;
            const char before = i > begin ? text_[i - 1] : ' ';
            if (c == '#' && is_gap(before)) {
                comment_ = i;
                break;
            }
            last = i + 1;
            const bool starts = i == from || is_gap(before) || before == '[' || before == '{' ||
                                before == ',' || before == '(' || before == ':';
            if (!starts && (c == '"' || c == '\'') && is_not_opened(i)) {
                add(lines_.quotes, not_opened(i));
            } else if (starts && (c == '"' || c == '\'')) {
                quote_ = i;
                const std::size_t behind = close_quote(i + 1, end);
                if (behind == kNone) return end;
                i = behind - 1;
                last = behind;
            } else if (starts && (c == '[' || c == '{')) {
                open_bracket(i);
            } else if ((c == ']' || c == '}') &&
                       (!open_.empty() || starts || before == ']' || before == '}')) {
                close_bracket(i);
            } else if (starts && open_.empty() && (c == '|' || c == '>') && is_block(i, end)) {
                block_ = parent_;
                return end;
            }
        }
        return last;
    }

    /// Where the text begins that this closing quote ends; at most kLongest before the quote.
    std::size_t word_before(std::size_t quote) const {
        const std::size_t from = quote - std::min(quote, kLongest);
        const std::string_view before = text_.substr(from, quote - from);
        const std::size_t gap = before.find_last_of(" \t\n,{[");
        const std::size_t word = gap == kNone ? 0 : gap + 1;
        const bool is_key = before.substr(word).find_first_of("\"'") == 0;  // "key":value"
        return from + (is_key ? before.rfind(':') + 1 : word);
    }
    /// True for `name"`, and not for 3/4", 6', it's" and the operators' key.
    bool is_not_opened(std::size_t quote) const {
        const std::size_t word = word_before(quote);
        const bool ends = ends_word(quote + 1) || kEnds.find(byte(quote + 1)) != kNone;
        const bool begins = is_name(byte(word)) || byte(word) == '/';
        const bool is_number = byte(word) >= '0' && byte(word) <= '9';
        const bool has_quote = text_.substr(word, quote - word).find_first_of("\"'") != kNone;
        const std::size_t before = word > 1 ? text_.find_last_not_of(" \t", word - 1) : kNone;
        const bool one_word =
            before == kNone || std::string_view(":-,{[\n").find(byte(before)) != kNone;
        return ends && begins && !is_number && !has_quote && one_word;
    }
    Finding not_opened(std::size_t quote) const {
        const std::size_t begin = word_before(quote);
        const std::string word(text_.substr(begin, quote - begin));
        const std::string mark(1, text_[quote]);
        return {begin, "the quote " + mark + " after '" + word + "' is not opened; write " + mark +
                           word + mark};
    }

    bool is_block(std::size_t at, std::size_t end) const {
        const std::size_t next = text_.find_first_not_of("+-0123456789", at + 1);
        const std::size_t rest = text_.find_first_not_of(" \t\r", next);
        return rest >= end || text_[rest] == '#';
    }

    /// Returns the offset behind the closing quote, or kNone where the line has none. A quote with
    /// a word behind itself opens the next text: the quote before was forgotten.
    std::size_t close_quote(std::size_t from, std::size_t end) {
        const char quote = text_[quote_];
        for (std::size_t i = from; i < end; ++i) {
            if (quote == '"' && text_[i] == '\\') {
                ++i;
            } else if (text_[i] == quote && quote == '\'' && byte(i + 1) == quote) {
                ++i;
            } else if (text_[i] == quote) {
                const bool ends = ends_word(i + 1) || kEnds.find(byte(i + 1)) != kNone;
                const bool opens = !ends && !is_name(byte(i - 1));
                if (!opens) {
                    quote_ = kNone;
                    return i + 1;
                }
                forget_quote();
                quote_ = i;
            }
        }
        return kNone;
    }

    /// The text probably ended where its line or its value does.
    void forget_quote() {
        std::string_view word = text_.substr(quote_, kLongest + 1);
        word = word.substr(0, word.find('\n'));
        std::size_t last = std::min(word.find(": "), word.find(" #"));
        if (!open_.empty()) last = std::min(last, word.find_first_of(",]}"));
        if (word.ends_with(':')) last = std::min(last, word.size() - 1);
        word = word.substr(0, last);
        word = word.substr(0, word.find_last_not_of(" \t\r,") + 1);
        const std::string mark(word.substr(0, 1));
        const bool is_short = word.size() > 1 && word.size() <= kLongest;
        add(lines_.quotes, {quote_, "the quote " + mark + " opened here is not closed; " +
                                        (is_short ? "write " + std::string(word) + mark
                                                  : "a " + mark + " is missing")});
        quote_ = kNone;
    }

    static void add(Findings& findings, Finding finding) {
        if (findings.size() < kMaxShown) findings.push_back(std::move(finding));
    }

    void open_bracket(std::size_t at) {
        if (open_.size() >= kMaxDepth && !lines_.too_deep) lines_.too_deep = at;
        if (open_.empty()) {
            comment_ = kNone;
            outermost_ = parent_;
        }
        open_.push_back(at);
    }

    void close_bracket(std::size_t at) {
        const char other = text_[at] == ']' ? '[' : '{';
        const std::string shown{'\'', text_[at], '\''};
        if (open_.empty()) {
            add(lines_.brackets,
                {at, shown + " closes nothing; remove it, or open it with '" + other + '\''});
            return;
        }
        const auto match = std::find_if(open_.rbegin(), open_.rend(),
                                        [&](std::size_t i) { return text_[i] == other; });
        if (match == open_.rend()) {
            const char opened = text_[open_.back()];
            add(lines_.brackets,
                {at, shown + " closes nothing; the '" + opened + "' before it ends with '" +
                         (opened == '[' ? ']' : '}') + "': type that in its place"});
        }
        while (match != open_.rend() && text_[open_.back()] != other) {
            add_unclosed(open_.back());
            open_.pop_back();
        }
        open_.pop_back();
    }

    /// True for a line that cannot be inside the brackets: an item, or a key no deeper than the
    /// line that opened them.
    bool ends_brackets(std::size_t at, std::size_t indent) const {
        if (is_dash(at)) return true;
        if (indent > outermost_ || byte(at) == ']' || byte(at) == '}') return false;
        std::size_t end = at;
        while (is_name(byte(end))) ++end;
        return end > at && byte(end) == ':' && ends_word(end + 1);
    }

    void forget_brackets() {
        for (const std::size_t at : open_) add_unclosed(at);
        open_.clear();
    }

    void add_unclosed(std::size_t at) {
        const bool list = text_[at] == '[';
        const std::string end = list ? "']'" : "'}'";
        const std::size_t line_end = std::min(text_.find('\n', comment_), text_.size());
        if (comment_ != kNone && text_.substr(0, line_end).find(end[1], comment_) != kNone) {
            add(lines_.brackets,
                {comment_, "this '#' begins a comment, which hides the " + end +
                               " after it; put a text that begins with '#' in quotes, or a comment "
                               "after the " +
                               end});
        } else {
            add(lines_.brackets, {at, std::string(list ? "'['" : "'{'") + " is never closed; a " +
                                          end + " is missing after it"});
        }
    }

    std::string_view text_;
    Lines& lines_;
    std::vector<std::size_t> open_;     ///< offsets of brackets
    std::size_t quote_ = kNone;         ///< offset of the open quote
    std::size_t comment_ = kNone;       ///< the last comment inside of brackets
    std::size_t parent_ = 0;            ///< column of the key that the current text belongs to
    std::size_t outermost_ = 0;         ///< the same of the outermost bracket
    std::optional<std::size_t> block_;  ///< the same of a block text
};

}  // namespace

Lines::Lines(std::string_view masked) { LineReader(masked, *this).read(); }

}  // namespace panelgate::yaml
