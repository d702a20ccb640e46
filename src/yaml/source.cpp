#include "source.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "encoding.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

/// Characters that may end a plain value, and the bytes that mask them: F5 and above begin no
/// character (RFC 3629, 3).
constexpr std::string_view kMeaning = "{}[],:# ";
constexpr std::string_view kMasks = "\xF5\xF6\xF7\xF8\xF9\xFA\xFB\xFC";
static_assert(kMeaning.size() == kMasks.size());

void exchange(char& c, std::string_view from, std::string_view to) {
    const std::size_t at = from.find(c);
    if (at != std::string_view::npos) c = to[at];
}

}  // namespace

std::string mask_variables(std::string_view text) {
    std::string masked(text);
    std::size_t at = masked.find("${");
    while (at != std::string::npos) {
        // After a quote or a line end the brace belongs to something else.
        const std::size_t end = masked.find_first_of("}\"'\r\n", at);
        if (end == std::string::npos) break;
        if (masked[end] == '}') {
            for (std::size_t i = at + 1; i <= end; ++i) exchange(masked[i], kMeaning, kMasks);
        }
        at = masked.find("${", end);  // any `${` before it has the same end
    }
    return masked;
}

std::string unmask_variables(std::string text) {
    std::ranges::for_each(text, [](char& c) { exchange(c, kMasks, kMeaning); });
    return text;
}

namespace {

constexpr std::size_t kStride = 64;

bool is_inside(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

std::size_t count_inside(std::string_view text) {
    return static_cast<std::size_t>(std::ranges::count_if(text, is_inside));
}

/// True if it takes two columns of a terminal (Unicode, UAX 11).
bool is_wide(char32_t c) {
    return (c >= 0x1100 && c < 0x1160) || (c >= 0x2E80 && c < 0xA4D0) ||
           (c >= 0xAC00 && c < 0xD7A4) || (c >= 0xF900 && c < 0xFB00) ||
           (c >= 0xFF01 && c < 0xFF61) || (c >= 0x20000 && c < 0x40000);
}

/// Returns blanks of the width of what precedes the caret.
std::string blanks_for(std::string_view before) {
    std::string blanks;
    for (std::size_t at = 0; at < before.size();) {
        const std::string_view character = character_at(before, at);
        blanks += character == "\t" ? "\t" : is_wide(code_point(character)) ? "  " : " ";
        at += character.size();
    }
    return blanks;
}

std::size_t offset_of_column(std::string_view line, int column) {
    std::size_t at = 0;
    for (int c = 1; c < column && at < line.size(); ++c) at += character_at(line, at).size();
    return at;
}

}  // namespace

Source::Source(std::string all) : text_(std::move(all)), lines_{0} {
    for (std::size_t at = text_.find('\n'); at != std::string::npos; at = text_.find('\n', at + 1))
        lines_.push_back(at + 1);
    std::size_t inside = 0;
    for (std::size_t at = 0; at < text_.size(); at += kStride) {
        inside_.push_back(inside);
        inside += count_inside(text().substr(at, kStride));
    }
    inside_.push_back(inside);
}

std::size_t Source::characters(std::size_t from, std::size_t to) const {
    if (inside_.back() == 0) return to - from;  // ASCII alone
    const auto inside_before = [this](std::size_t at) {
        const std::size_t stride = at / kStride;
        return inside_[stride] + count_inside(text().substr(stride * kStride, at % kStride));
    };
    return to - from - (inside_before(to) - inside_before(from));
}

Mark Source::mark(std::size_t offset) const {
    const std::size_t at = std::min(offset, text_.size());
    const auto next = std::upper_bound(lines_.begin(), lines_.end(), at);
    return {static_cast<int>(next - lines_.begin()),
            static_cast<int>(characters(*std::prev(next), at)) + 1};
}

Mark Source::mark(int line, int column) const {
    if (line < 0 || static_cast<std::size_t>(line) >= lines_.size()) return mark(text_.size());
    const std::size_t begin = lines_[static_cast<std::size_t>(line)];
    const std::size_t at = begin + static_cast<std::size_t>(column);
    if (at > text_.size()) return mark(at);
    return {line + 1, static_cast<int>(characters(begin, at)) + 1};
}

std::string_view Source::line(int number) const {
    if (number < 1 || static_cast<std::size_t>(number) > lines_.size()) return {};
    const std::size_t from = lines_[static_cast<std::size_t>(number) - 1];
    std::string_view line = text().substr(from, text_.find('\n', from) - from);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

char Source::byte(int line, int column) const {
    if (line < 0 || static_cast<std::size_t>(line) >= lines_.size()) return '\n';
    const std::size_t at =
        lines_[static_cast<std::size_t>(line)] + static_cast<std::size_t>(column);
    return at < text_.size() ? text_[at] : '\n';
}

std::string Source::excerpt(Mark mark) const {
    constexpr std::size_t kBefore = 70;
    constexpr std::size_t kShown = 100;
    std::string_view shown = line(mark.line);
    std::size_t caret = offset_of_column(shown, mark.column);
    std::size_t cut = caret > kBefore ? caret - kBefore : 0;
    while (cut < caret && is_inside(shown[cut])) ++cut;
    const std::string left = cut > 0 ? "..." : "";
    shown.remove_prefix(cut);
    caret -= cut;
    std::size_t end = std::min(kShown, shown.size());
    while (end < shown.size() && is_inside(shown[end])) ++end;
    const std::string right = end < shown.size() ? "..." : "";
    return "  " + left + std::string(shown.substr(0, end)) + right + "\n  " +
           blanks_for(left + std::string(shown.substr(0, caret))) + "^\n";
}

namespace {

using Kind = Token::Kind;
using State = Token::State;

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_bracket(char c) { return c == ',' || c == '[' || c == ']' || c == '{' || c == '}'; }
bool is_space(char c) { return is_blank(c) || c == '\n' || c == '\r'; }

/// A value has at most a dash, a key, a colon and a comma.
constexpr std::size_t kMaxTokens = 8 * kMaxNodes;

class Scanner {
  public:
    explicit Scanner(std::string_view text) : text_(text) {}

    std::vector<Token> scan() {
        while (tokens_.size() < kMaxTokens) {
            skip();
            if (at_ >= text_.size()) break;
            begin_ = at_;
            if (first_ && !open_.empty() && ends_brackets()) forget_brackets();
            step();
            first_ = false;
        }
        forget_brackets();
        return std::move(tokens_);
    }

  private:
    char peek(std::size_t ahead = 0) const {
        return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\n';
    }
    bool blank(std::size_t ahead) const { return is_space(peek(ahead)); }
    std::size_t line_end(std::size_t from) const {
        return std::min(text_.find('\n', from), text_.size());
    }

    /// Skips blanks, line ends, comments and directives.
    void skip() {
        for (; at_ < text_.size(); ++at_) {
            const char c = text_[at_];
            const bool comment =
                c == '#' || (c == '%' && first_ && tokens_.empty() && at_ == line_);
            if (comment) at_ = line_end(at_);
            if (at_ >= text_.size()) return;
            if (text_[at_] == '\n') {
                first_ = true;
                line_ = at_ + 1;
                key_ = at_ + 1;
            } else if (text_[at_] != '\r' && !is_blank(text_[at_])) {
                return;
            }
        }
    }

    void add(Kind kind, std::size_t end, State state = State::fine) {
        tokens_.push_back({kind, state, first_, open_.size(), begin_, end});
        at_ = std::max(end, at_ + 1);
    }

    void step() {
        const bool inside = !open_.empty();
        const char c = peek();
        const bool marker = at_ == line_ && blank(3) &&
                            (text_.substr(at_, 3) == "---" || text_.substr(at_, 3) == "...");
        if (marker) return add(Kind::document, at_ + 3);
        if (c == '-' && blank(1)) return add_parent(Kind::dash, 1);
        if (const std::size_t dash = wrong_dash()) return add_parent(Kind::dash, dash);
        if (c == ':' && (blank(1) || (inside && (is_bracket(peek(1)) || follows_quote()))))
            return add(Kind::colon, at_ + 1);
        if (text_.substr(at_).starts_with("{{")) return add(Kind::odd, placeholder_end());
        if (c == '[' || c == '{') return open();
        if (c == ']' || c == '}') return close(c);
        if (c == ',' && inside) return add(Kind::comma, at_ + 1);
        if (c == '"' || c == '\'') return quoted(c);
        if ((c == '|' || c == '>') && !inside) return block();
        word(c);
    }

    void word(char c) {
        if (c == '*') return add(Kind::alias, name_end());
        if (c == '&') return add(Kind::anchor, name_end());
        if (c == '!') return add(Kind::tag, name_end());
        const std::size_t end = plain_end();
        if (c == '%' || c == '@' || c == '`' || c == ',') return add(Kind::odd, end);
        if (first_ || tokens_.empty() || tokens_.back().kind == Kind::dash) key_ = begin_;
        add(Kind::plain, end);
    }

    void add_parent(Kind kind, std::size_t length) {
        key_ = at_;
        add(kind, at_ + length, text_[at_] == '-' ? State::fine : State::stray);
    }

    /// Returns the length of a list mark that YAML does not know, such as a longer dash or a dot; 0
    /// if none.
    std::size_t wrong_dash() const {
        static constexpr std::array<std::string_view, 9> kDashes{
            "*", "\u2010", "\u2011", "\u2012", "\u2013", "\u2014", "\u2022", "\u2212", "\u00B7"};
        const bool begins = first_ || tokens_.empty() || tokens_.back().kind == Kind::dash;
        if (!open_.empty() || !begins) return 0;
        for (const std::string_view dash : kDashes) {
            if (text_.substr(at_).starts_with(dash) && blank(dash.size())) return dash.size();
        }
        return 0;
    }

    bool follows_quote() const {
        return !tokens_.empty() && tokens_.back().kind == Kind::quoted && tokens_.back().end == at_;
    }

    /// {{ name }}, as other programs have it
    std::size_t placeholder_end() const {
        const std::size_t line = line_end(at_);
        const std::size_t end = text_.substr(0, line).find("}}", at_);
        return end == std::string_view::npos ? at_ + 2 : end + 2;
    }

    std::size_t name_end() const {
        const std::string_view end = open_.empty() ? " \t\r\n" : " \t\r\n,[]{}";
        return std::min(text_.find_first_of(end, at_), text_.size());
    }

    /// Ends at ": ", " #", a bracket or comma inside brackets, or the end of the line; without
    /// trailing blanks.
    std::size_t plain_end() const {
        std::size_t end = at_;
        for (std::size_t i = at_; i < text_.size(); ++i) {
            const char c = text_[i];
            const char next = i + 1 < text_.size() ? text_[i + 1] : '\n';
            const bool spaced = is_space(next);
            const bool inside = !open_.empty();
            if (c == '\n' || c == '\r') break;
            if (c == ':' && (spaced || (inside && is_bracket(next)))) break;
            if (inside && is_bracket(c) && i > at_) break;
            if (is_blank(c)) {
                if (next == '#') break;
                continue;
            }
            end = i + 1;
        }
        return end;
    }

    void open() {
        if (open_.empty()) outermost_ = key_ - line_;
        add(Kind::open, at_ + 1);
        open_.push_back(tokens_.size() - 1);
    }

    void close(char c) {
        const char opening = c == ']' ? '[' : '{';
        const auto match = std::find_if(open_.rbegin(), open_.rend(), [&](std::size_t token) {
            return text_[tokens_[token].begin] == opening;
        });
        if (match == open_.rend()) return add(Kind::close, at_ + 1, State::stray);
        while (text_[tokens_[open_.back()].begin] != opening) {
            tokens_[open_.back()].state = State::unclosed;
            open_.pop_back();
        }
        add(Kind::close, at_ + 1);
        open_.pop_back();
    }

    /// True for a line that cannot be inside the brackets: an item, or a key no deeper than the
    /// line that opened them.
    bool ends_brackets() const {
        if (peek() == '-' && blank(1)) return true;
        const std::size_t indent = at_ - line_;
        if (indent > outermost_) return false;
        const std::size_t end = text_.find_first_of(":\n,[]{}\"'", at_);
        return end != std::string_view::npos && end > at_ && text_[end] == ':' &&
               (end + 1 >= text_.size() || text_[end + 1] == ' ' || text_[end + 1] == '\n' ||
                text_[end + 1] == '\r');
    }

    void forget_brackets() {
        for (const std::size_t token : open_) tokens_[token].state = State::unclosed;
        open_.clear();
    }

    void quoted(char quote) {
        if (first_ || tokens_.back().kind == Kind::dash) key_ = begin_;
        const std::size_t end = quote_end(quote);
        if (end == std::string_view::npos || leaves_its_key(end) || opens_next_text(end))
            return add(Kind::quoted, forgotten_end(), State::unclosed);
        add(Kind::quoted, end);
        const std::size_t last = text_.substr(begin_, end - begin_).rfind('\n');
        if (last != std::string_view::npos) line_ = key_ = begin_ + last + 1;
    }
    std::size_t quote_end(char quote) const {
        for (std::size_t i = at_ + 1; i < text_.size(); ++i) {
            if (quote == '"' && text_[i] == '\\') {
                ++i;
            } else if (text_[i] == quote) {
                if (quote == '"' || i + 1 >= text_.size() || text_[i + 1] != quote) return i + 1;
                ++i;
            }
        }
        return std::string_view::npos;
    }
    /// True if a line of the text is not deeper than its key (YAML 1.2, 7.4): then its quote was
    /// forgotten, and this one opens the next text.
    bool leaves_its_key(std::size_t end) const {
        const std::string_view text = text_.substr(0, end);
        const std::size_t parent = key_ - line_;
        std::size_t begin = text.find('\n', at_);
        while (begin < end) {
            const std::size_t content = text.find_first_not_of(" \t\r", ++begin);
            const bool closes = content + 1 >= end;  // a closing quote alone may be in any column
            if (!closes && text[content] != '\n' && content - begin <= parent) return true;
            begin = text.find('\n', begin);
        }
        return false;
    }

    /// True if the quote opens the next text: text follows it, and this text cannot end there as it
    /// has a line end, or ends with a separator.
    bool opens_next_text(std::size_t end) const {
        if (end >= text_.size() || is_space(text_[end])) return false;
        if (std::string_view(",:]}").find(text_[end]) != std::string_view::npos) return false;
        const std::string_view inside = text_.substr(at_ + 1, end - at_ - 2);
        const std::size_t last = inside.find_last_not_of(" \t\r\n");
        return inside.find('\n') != std::string_view::npos ||
               (last != std::string_view::npos &&
                std::string_view(",:[{").find(inside[last]) != std::string_view::npos);
    }
    /// Returns where a user would have closed the quote: after the key, the item in brackets, or at
    /// the end of the line.
    std::size_t forgotten_end() const {
        const bool is_value = !first_ && tokens_.back().kind == Kind::colon;
        std::size_t end = at_ + 1;
        for (std::size_t i = end; i < text_.size() && text_[i] != '\n'; ++i) {
            const char c = text_[i];
            const char next = i + 1 < text_.size() ? text_[i + 1] : '\n';
            const bool item = !open_.empty() && (c == ',' || c == ']' || c == '}');
            const bool key = !is_value && c == ':' && is_space(next);
            if (item || key || (c == '#' && is_blank(text_[i - 1]))) break;
            if (!is_space(c)) end = i + 1;
        }
        return end;
    }

    /// Takes all lines deeper than the key, or the dash, that they belong to.
    void block() {
        const std::size_t parent = key_ - line_;
        std::size_t end = line_end(at_);
        while (end < text_.size()) {
            const std::size_t content = text_.find_first_not_of(" \r", end + 1);
            const bool empty = content < text_.size() && text_[content] == '\n';
            if (!empty && (content >= text_.size() || content - (end + 1) <= parent)) break;
            end = line_end(end + 1);
        }
        add(Kind::block, end);
    }

    std::string_view text_;
    std::vector<Token> tokens_;
    std::vector<std::size_t> open_;  ///< tokens
    std::size_t outermost_ = 0;      ///< column of the first one's key or dash
    std::size_t at_ = 0;
    std::size_t begin_ = 0;  ///< of the current token
    std::size_t line_ = 0;   ///< start of its line
    std::size_t key_ = 0;    ///< the last key or dash in block style on that line
    bool first_ = true;
};

}  // namespace

std::vector<Token> scan(std::string_view text) { return Scanner(text).scan(); }

std::size_t line_begin(std::string_view text, std::size_t offset) {
    const std::size_t before = offset == 0 ? std::string_view::npos : text.rfind('\n', offset - 1);
    return before == std::string_view::npos ? 0 : before + 1;
}

}  // namespace panelgate::yaml
