#include "lint.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

std::string_view Scanned::rest(std::size_t token) const {
    constexpr std::size_t kShown = 160;
    std::string_view line = clip(source.text().substr(tokens[token].begin), kShown);
    line = line.substr(0, line.find_first_of("\r\n"));
    line = line.substr(0, std::min(line.find(" #"), line.find("\t#")));
    return line.substr(0, line.find_last_not_of(" \t") + 1);
}

namespace {

using Kind = Token::Kind;
using State = Token::State;

/// Where a row of kSlips is tried, and on what.
enum class On : std::uint8_t {
    any,       ///< a token, also of a text that the parser takes
    token,     ///< a token of a refused text
    line,      ///< the line from such a token on
    begin,     ///< the same, of the first token of a line
    alone,     ///< the same, where the line has no ': '
    two_keys,  ///< the same, from a key on whose value is an item, or has a ': '
};

/// A mistake that is seen in the letters of one line.
struct Slip {
    On on;
    Kind kind;
    std::string_view holds;  ///< one of these characters is in the token; "": any
    const char* pattern;     ///< of all that it is tried on (ECMA 262)
    std::size_t cursor;      ///< the group where it is; 0: the token
    std::string_view says;   ///< $1 to $4 are groups, $u is the name of the first character
};

constexpr std::string_view kTwoKeys =
    "two keys on one line; begin a deeper line for '$3', or write $1: {$2}; one text that holds "
    "': ' must be in quotes: \"$2\"";

constexpr std::string_view kAddress = "a blank after the ':' of an address; write $1:$2";

/// The first that fits is told.
constexpr auto kSlips = std::to_array<Slip>({
    {On::any, Kind::dash, "", R"([^-].*)", 0,
     "$u begins no item; type a '-' of the keyboard in its place"},
    {On::any, Kind::plain, "\xE2\xC2",
     "(?:\xE2\x80[\x98\x99\x9A\x9C\x9D\x9E]|\xC2[\xAB\xBB])(.+)"
     "(?:\xE2\x80[\x98\x99\x9A\x9C\x9D\x9E]|\xC2[\xAB\xBB])",
     0, "$u is no quote of YAML; write \"$1\""},
    // not 3/4" and 6', nor an apostrophe at the end of several words
    {On::any, Kind::plain, "\"'", R"((?!(?:.* )?[0-9.,/]*["']$)(?!.* .*s'$)([^"']+)(["'])(?::.*)?)",
     0, "the quote $2 after '$1' is not opened; write $2$1$2"},
    {On::begin, Kind::plain, "/-<;", R"((?://|/\*|-- |<!--|;).*)", 0, "a comment begins with '#'"},
    {On::begin, Kind::tag, "", R"(!include.*)", 0,
     "'!include' has no meaning here: the configuration is one file; put what the other one holds "
     "in place of this line"},
    {On::begin, Kind::plain, "-", R"(-([A-Za-z][\w-]*):?(?: .*)?)", 0,
     "a blank is missing after '-'; write '- $1:'"},
    {On::begin, Kind::plain, "+", R"(\+ .*)", 0, "a '+' begins no key; remove it"},
    {On::token, Kind::plain, "?", R"(\?)", 0, "a '?' is no value; write what is meant"},
    {On::line, Kind::plain, "(", R"(\(([A-Za-z][\w-]*: [^)]*).*)", 0,
     "'(' begins no map; write {$1}"},
    {On::line, Kind::plain, ":", R"(([A-Za-z][\w-]*:)([{["'].*))", 2,
     "a blank is missing after '$1'; write '$1 $2'"},
    {On::line, Kind::plain, "=", R"(([A-Za-z][\w-]*) *(=) *([{[].*))", 2,
     "a key is followed by ':', not '='; write '$1: $3'"},
    {On::line, Kind::plain, ".:]l",
     R"(([\w./:[\]-]*[.:\]][\w.-]*|localhost): +([0-9/]+)(?:[,}\]].*)?)", 0, kAddress},
    {On::two_keys, Kind::plain, "", R"([^ ]+ +([\w./:[\]-]*[.:\]][\w.-]*|localhost): +([0-9/]+))",
     1, kAddress},
    {On::two_keys, Kind::plain, "", R"(\S+: +(tcp): *(?://)?(\S+))", 1,
     "an address begins with tcp:// and has no blank; write tcp://$2"},
    {On::two_keys, Kind::plain, "", R"((\S+?): +([A-Za-z][\w-]*: [^{}]*\}))", 2,
     "a '{' is missing; write '$1: {$2'"},
    {On::two_keys, Kind::plain, "", R"([^ ]+ +(- .*))", 1,
     "a list begins below its key; begin a new line before this '-'"},
    {On::two_keys, Kind::plain, "", R"((\S+?): +(?!\()(([A-Za-z][\w-]*):(?: .*)?))", 2, kTwoKeys},
    {On::two_keys, Kind::plain, "", R"(\S+?: +(?!\()(.* ([A-Za-z][\w-]*):(?: .*)?))", 1,
     "two keys on one line; begin a new line for '$2'; one text that holds ': ' must be in quotes: "
     "\"$1\""},
    {On::alone, Kind::plain, "\xEF", "([A-Za-z][\\w-]*)(\xEF\xBC\x9A)\\s*(.*)", 2,
     "U+FF1A is no colon; write '$1: $3'"},
    {On::alone, Kind::plain, "", R"(([A-Za-z][\w-]*|<<):(?!//)(.+))", 2,
     "a blank is missing after '$1:'; write '$1: $2'"},
    {On::alone, Kind::plain, "", R"(([A-Za-z][\w-]*|<<)\s*(:=|=>|[=;])\s*(.*))", 2,
     "a key is followed by ':', not '$2'; write '$1: $3'"},
    {On::alone, Kind::plain, "", R"(([A-Za-z][\w-]*|<<)(?=[\s*]|$)(\s*):?\s*(.*))", 2,
     "a ':' is missing after '$1'; write '$1: $3'"},
    {On::line, Kind::alias, "", R"(\*(:[0-9]+)(?:[ ,}\]].*)?)", 0,
     "'*' is no address; write 0.0.0.0$1 for all addresses of this machine"},
    {On::line, Kind::alias, "", R"(\*(?:[ ,}\]].*)?)", 0,
     "a text that begins with '*' must be in quotes; write \"*\""},
    {On::line, Kind::alias, "", R"((\*\S+) +\{([^}]*).*)", 0,
     "no key may be beside or below '$1'; write {<<: $1, $2}"},
    {On::token, Kind::odd, "", R"((([%@`]).*))", 0,
     "a text that begins with '$2' must be in quotes; write \"$1\""},
    {On::any, Kind::odd, "{", R"(\{\{ *([A-Za-z]\w*)?.*)", 0,
     "'{{' means nothing here; a variable is written ${$1}"},
    {On::line, Kind::open, "", R"([^$]*(\$\{)\w*(?:[^\w:}].*)?)", 1,
     "a variable is written ${NAME}; a '}' is missing"},
    {On::line, Kind::open, "", R"((\[[0-9A-Fa-f:.]*\]:[0-9]+)(?:[ ,}\]].*)?)", 0,
     "an address in [ ] must be in quotes; write \"$1\""},
    {On::token, Kind::quoted, "\\",
     R"("(?:[^\\]|\\[0abtnvfre "/\\N_LPxuU])*(\\[^0abtnvfre "/\\N_LPxuU]).*)", 1,
     "'$1' means nothing in double quotes; write \\\\ for a backslash, or use single quotes"},
    {On::line, Kind::quoted, "",
     R"re((?:'(?:[^']|'')*'(?!')|"(?:[^"\\]|\\.)*") *([^ ,:}\]][^,}\]]*).*)re", 1,
     "after the closing quote stands $1; remove it, or put all of the text in quotes of the other "
     "kind"},
});

using Match = std::match_results<std::string_view::const_iterator>;

std::string_view group(const Match& match, std::size_t number) {
    return match[number].matched ? std::string_view(match[number].first, match[number].second)
                                 : std::string_view();
}

/// Puts the groups into the sentence; in `write 'key: $1'` an empty one takes its blank along.
std::string told(const Slip& slip, const Match& match) {
    std::string text;
    for (std::size_t at = 0; at < slip.says.size(); ++at) {
        const char next = at + 1 < slip.says.size() ? slip.says[at + 1] : ' ';
        if (slip.says[at] != '$' || (next != 'u' && (next < '1' || next > '4'))) {
            text += slip.says[at];
            continue;
        }
        ++at;
        const std::string_view all = group(match, 0);
        const std::string_view part =
            next == 'u' ? all : group(match, static_cast<std::size_t>(next - '0'));
        if (next == 'u') {
            text += all[0] == '*' ? "'*'" : name_of(code_point(character_at(all, 0)));
        } else if (!part.empty()) {
            text += part;
        } else if (text.ends_with(' ')) {
            text.pop_back();
        } else if (text.ends_with('{')) {
            text += "NAME";
        }
    }
    return text;
}

/// Returns the finding if the row fits the token, or the line from there on.
std::optional<Finding> tried(const Scanned& text, std::size_t token, std::size_t row) {
    static const std::vector<std::regex> kPatterns = [] {
        std::vector<std::regex> all;
        for (const Slip& slip : kSlips) all.emplace_back(slip.pattern);
        return all;
    }();
    constexpr std::size_t kLongest = 200;
    const Slip& slip = kSlips[row];
    const bool is_token = slip.on == On::any || slip.on == On::token;
    const std::string_view word = text.text(token);
    if (!slip.holds.empty() && word.find_first_of(slip.holds) == word.npos) return std::nullopt;
    const std::string_view on = is_token ? word : text.rest(token);
    Match match;
    if (on.size() > kLongest || !std::regex_match(on.begin(), on.end(), match, kPatterns[row]))
        return std::nullopt;
    const auto cursor = match[slip.cursor].matched ? match.position(slip.cursor) : 0;
    return Finding{text.tokens[token].begin + static_cast<std::size_t>(cursor), told(slip, match)};
}

/// The rows of a kind of token, in their order.
const std::vector<std::size_t>& rows_of(Kind kind) {
    constexpr auto kKinds = static_cast<std::size_t>(Kind::document) + 1;
    static const std::array<std::vector<std::size_t>, kKinds> kRows = [] {
        std::array<std::vector<std::size_t>, kKinds> all;
        for (std::size_t row = 0; row < kSlips.size(); ++row)
            all.at(static_cast<std::size_t>(kSlips[row].kind)).push_back(row);
        return all;
    }();
    return kRows.at(static_cast<std::size_t>(kind));
}

/// True for a key whose value is an item, or is followed by another ': '.
bool has_two_keys(const Scanned& text, std::size_t key) {
    const bool begins = text.tokens[key].first || text.tokens[key - 1].kind == Kind::dash;
    if (!begins || text.tokens[key].depth > 0 || !text.follows(key + 1, Kind::colon)) return false;
    return text.follows(key + 2, Kind::dash) ||
           (text.follows(key + 2, Kind::plain) && text.follows(key + 3, Kind::colon));
}

/// Looks for all rows but those of lines without a colon.
void find_slips(const Scanned& text, bool refused, Findings& findings) {
    constexpr std::size_t kTyped = 100;  // tokens of a line; longer ones are made by programs
    std::size_t on_line = 0;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        on_line = token.first ? 0 : on_line + 1;
        const std::string_view word = text.text(i);
        const bool is_open_quote = token.kind == Kind::quoted && token.state == State::unclosed;
        if (word.empty() || is_open_quote) continue;
        const bool behind_quote =
            text.follows(i) && i > 0 && text.tokens[i - 1].kind == Kind::quoted;
        const bool tries_all = refused && on_line < kTyped;
        const bool twice = tries_all && token.kind == Kind::plain && has_two_keys(text, i);
        const auto may_be_on = [&](On on) {
            if (on == On::any) return !behind_quote;
            if (on == On::begin) return tries_all && token.first;
            if (on == On::two_keys) return twice;
            return tries_all && on != On::alone;
        };
        for (const std::size_t row : rows_of(token.kind)) {
            if (!may_be_on(kSlips[row].on)) continue;
            if (auto finding = tried(text, i, row)) {
                findings.push_back(std::move(*finding));
                break;
            }
        }
    }
}

}  // namespace

std::optional<Finding> missing_colon(const Scanned& text, std::size_t token) {
    for (const std::size_t row : rows_of(text.tokens[token].kind)) {
        if (kSlips[row].on != On::alone) continue;
        if (auto finding = tried(text, token, row)) return finding;
    }
    return std::nullopt;
}

namespace {

/// True for characters that look like a blank, or are invisible, but are no blank to YAML.
bool is_wrong_blank(char32_t c) {
    return c == 0xA0 || c == 0x3000 || c == 0xFEFF || c == 0x202F || (c >= 0x2000 && c <= 0x200B);
}

/// True for characters without width, whose origin users cannot see.
bool is_invisible(char32_t c) {
    return c == 0x200B || c == 0x200E || c == 0x200F || c == 0x2060 || c == 0xFEFF ||
           (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069);
}

/// Finds the first invisible character, or odd blank where a blank is significant: at the ends of a
/// word, or, unless the word is a value, after its first colon or dash. Inside a text it is an
/// ordinary character.
std::size_t find_wrong(std::string_view word, bool is_value) {
    bool meaning = true;
    std::size_t ending = word.npos;
    for (std::size_t at = 0; at < word.size();) {
        const std::string_view character = character_at(word, at);
        const char32_t c = code_point(character);
        const bool odd = is_wrong_blank(c);
        if (is_invisible(c) || (odd && meaning)) return at;
        if (!odd) ending = word.npos;
        if (odd && ending == word.npos) ending = at;
        meaning = !is_value && (character == ":" || (character == "-" && at == 0));
        at += character.size();
    }
    return ending;
}

std::string wrong_blank(std::string_view word, std::size_t at) {
    const char32_t c = code_point(character_at(word, at));
    const bool divides = at > 0 && (word[at - 1] == ':' || (word[at - 1] == '-' && at == 1));
    if (is_invisible(c) && !divides) return name_of(c) + " (which is invisible) is here; remove it";
    return name_of(c) + (c == 0xA0 ? " (a no-break space)" : " (an unusual blank)") +
           " is here; type an ordinary blank in its place";
}

std::size_t tab_before(const Scanned& text, const Token& first) {
    const std::size_t begin = line_begin(text.source.text(), first.begin);
    const std::size_t tab = text.source.text().substr(begin, first.begin - begin).find('\t');
    return tab == std::string_view::npos ? tab : begin + tab;
}

void find_wrong_blanks(const Scanned& text, Findings& findings) {
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const std::size_t tab =
            token.first && token.depth == 0 ? tab_before(text, token) : std::string_view::npos;
        if (tab != std::string_view::npos)
            findings.push_back({tab, "a tab in the indentation; type blanks in its place"});
        const bool has_key =
            token.kind == Kind::dash && text.follows(i + 1) && text.follows(i + 2, Kind::colon);
        if (has_key && text.source.text().substr(token.end).starts_with('\t'))
            findings.push_back({token.end, "a tab after '-'; type a blank in its place"});
        if (token.kind != Kind::plain) continue;
        // After a real colon another one is part of the text.
        const bool is_value = text.follows(i) && text.tokens[i - 1].kind == Kind::colon;
        const std::size_t at = find_wrong(text.text(i), is_value);
        if (at != std::string_view::npos)
            findings.push_back({token.begin + at, wrong_blank(text.text(i), at)});
    }
}

void find_open_quotes(const Scanned& text, Findings& findings) {
    constexpr std::size_t kLongest = 60;  // of a text that is shown whole
    for (const Token& token : text.tokens) {
        if (token.kind != Kind::quoted || token.state != State::unclosed) continue;
        const std::string word(text.text(token));
        const std::string mark = word.substr(0, 1);
        const bool is_short = word.size() > 1 && word.size() <= kLongest;
        findings.push_back(
            {token.begin, "the quote " + mark + " opened here is not closed; " +
                              (is_short ? "write " + word + mark : "a " + mark + " is missing")});
    }
}

void find_directives(const Scanned& text, Findings& findings) {
    if (text.tokens.empty() || text.tokens.front().kind == Kind::document) return;
    const std::string_view head = text.source.text().substr(0, text.tokens.front().begin);
    const std::size_t sign = head.starts_with('%') ? 0 : head.find("\n%");
    if (sign == head.npos) return;
    findings.push_back({sign + (sign == 0 ? 0 : 1),
                        "a '---' is missing below this directive; write it, or remove this line"});
}

/// Lines that a version control leaves where two changes meet.
Findings find_conflicts(const Source& source) {
    constexpr std::array<std::string_view, 4> kMarks{"<<<<<<< ", "||||||| ", "=======", ">>>>>>> "};
    Findings found;
    std::size_t begin = 0;
    for (std::string_view text = source.text(); begin < text.size() && found.size() < kMaxShown;
         begin = std::min(text.find('\n', begin), text.size() - 1) + 1) {
        const auto is_here = [&](std::string_view mark) {
            return text.substr(begin).starts_with(mark);
        };
        if (std::ranges::any_of(kMarks, is_here))
            found.push_back({begin,
                             "two versions meet here (a merge conflict): keep one of them, and "
                             "remove the lines of <<<<<<<, ======= and >>>>>>>"});
    }
    return found;
}

void find_letters(const Scanned& text, Findings& findings) { find_slips(text, true, findings); }
void find_accepted(const Scanned& text, Findings& findings) { find_slips(text, false, findings); }

using Find = void (*)(const Scanned&, Findings&);

/// Runs `finds` in order of precedence; the first finding on a line is the nearest to its cause.
Findings run(const Scanned& text, std::span<const Find> finds) {
    Findings all;
    std::set<int> lines;
    for (const Find find : finds) {
        Findings some;
        find(text, some);
        std::set<int> told;
        for (Finding& finding : some) {
            const int line = text.source.mark(finding.offset).line;
            if (lines.contains(line) || !told.insert(line).second) continue;
            if (all.size() < kMaxShown) all.push_back(std::move(finding));
        }
        lines.merge(told);
    }
    std::ranges::sort(all, {}, &Finding::offset);
    return all;
}

}  // namespace

Findings find_traps(const Scanned& text) {
    static constexpr std::array<Find, 4> kFinds{find_wrong_blanks, find_open_quotes, find_accepted,
                                                find_directives};
    return run(text, kFinds);
}

Findings find_causes(const Scanned& text) {
    static constexpr std::array<Find, 6> kFinds{find_wrong_blanks, find_open_quotes, find_letters,
                                                find_directives,   find_brackets,    find_columns};
    Findings conflicts = find_conflicts(text.source);
    return conflicts.empty() ? run(text, kFinds) : conflicts;
}

bool has_wrong_indent(const Scanned& text, const Token& first) {
    const std::string_view word = text.text(first);
    const bool has_sign =
        first.kind == Kind::plain && (word.starts_with('+') || word.starts_with('-'));
    return has_sign || tab_before(text, first) != std::string_view::npos ||
           is_wrong_blank(code_point(character_at(text.text(first), 0)));
}

std::string without_blank_tabs(const Scanned& text, std::string bytes) {
    const auto is_text = [&](std::size_t offset) {  // inside quotes or a block of lines
        const auto behind = std::ranges::upper_bound(text.tokens, offset, {}, &Token::begin);
        return behind != text.tokens.begin() && std::prev(behind)->end > offset;
    };
    for (std::size_t begin = 0; begin < bytes.size();) {
        const std::size_t content = std::min(bytes.find_first_not_of(" \t", begin), bytes.size());
        const bool idle = content == bytes.size() || bytes[content] == '#' ||
                          bytes[content] == '\n' || bytes[content] == '\r';
        if (idle && !is_text(begin))
            std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                      bytes.begin() + static_cast<std::ptrdiff_t>(content), ' ');
        begin = std::min(bytes.find('\n', content), bytes.size() - 1) + 1;
    }
    return bytes;
}

}  // namespace panelgate::yaml
