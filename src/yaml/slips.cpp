// Slips: mistakes that are seen in the letters of one line.

#include <array>
#include <cstddef>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "advice.hpp"

namespace panelgate::yaml {

namespace {

struct Slip {
    On on;
    const char* pattern;    ///< of the line behind its dashes and without a comment (ECMA 262)
    std::size_t cursor;     ///< the group where the mistake is
    std::string_view says;  ///< $1 to $3 are groups
};

/// The first row that fits is told.
constexpr auto kSlips = std::to_array<Slip>({
    {On::any, R"((?:<<<<<<<|\|{7}|=======|>>>>>>>)(?: .*)?)", 0,
     "two versions meet here (a merge conflict): keep one of them, and remove the lines of "
     "<<<<<<<, ======= and >>>>>>>"},
    {On::any, "(\xE2\x80[\x90-\x95\xA2]|\xE2\x88\x92|\xC2\xB7|\\*) .*", 1,
     "'$1' begins no item; type a '-' of the keyboard in its place"},
    {On::any,
     "(?:.*: +)?((?:\xE2\x80[\x98\x99\x9A\x9C\x9D\x9E]|\xC2[\xAB\xBB])(.+)"
     "(?:\xE2\x80[\x98\x99\x9A\x9C\x9D\x9E]|\xC2[\xAB\xBB]))(?::.*)?",
     1, "these are no quotes of YAML; write \"$2\""},
    {On::any, R"((?:[^"']*[:,{[-] +)?(\{\{) *([A-Za-z]\w*)?.*)", 1,
     "'{{' means nothing here; a variable is written ${$2}"},
    {On::any, R"(-([A-Za-z][\w-]*):?(?: .*)?)", 0, "a blank is missing after '-'; write '- $1:'"},
    {On::any, R"((?://|/\*|-- |<!--|; ).*)", 0, "a comment begins with '#'"},
    {On::refused, R"(-([{["'].*))", 0, "a blank is missing after '-'; write '- $1'"},
    {On::refused, R"(([A-Za-z][\w-]*:)([{["'].*))", 2,
     "a blank is missing after '$1'; write '$1 $2'"},
    {On::refused, R"((?:.*[:,{[] *)?(([%@`])[^}\]]*?)(?:[}\]].*|, .*)?)", 1,
     "a text that begins with '$2' must be in quotes; write \"$1\""},
    {On::refused, R"((?:.*: +)(\*)(:[0-9]+).*)", 1,
     "'*' is no address; write 0.0.0.0$2 for all addresses of this machine"},
    {On::refused, R"((?:.*[: [,])?(\*) *(?:[\],].*)?)", 1,
     "a text that begins with '*' must be in quotes; write \"*\""},
    {On::refused, R"((?:.*: +)?(\[[0-9A-Fa-f:.]*\]:[0-9]+).*)", 1,
     "an address in [ ] must be in quotes; write \"$1\""},
    {On::refused, R"((?:.*[{,] *)?[\w-]+: +([\w./:[\]-]*[.:\]][\w.-]*|localhost): +([0-9/]+)[ }]*)",
     1, "a blank after the ':' of an address; write $1:$2"},
    {On::refused, R"(.*(\$\{)\w*(?:[^\w:}].*)?)", 1,
     "a variable is written ${NAME}; a '}' is missing"},
    {On::refused,
     R"re([^"']*: +(?:'(?:[^']|'')*'(?!')|"(?:[^"\\]|\\.)*") *([^ ,:}\]][^,}\]]*).*)re", 1,
     "after the closing quote stands $1; remove it, or put all of the text in quotes of the other "
     "kind"},
    {On::refused, R"([\w-]+: +(- .*))", 1,
     "a list begins below its key; begin a new line before this '-'"},
    {On::refused, R"((?:.*[{,] *)[\w-]+: +([^ {}"'[\],][^{}"'[\],]*: [^{},]*[^{}, ]).*)", 1,
     "a text that holds ': ' must be in quotes; write \"$1\""},
    {On::refused, R"([\w-]+: +([\w-]+: [^{}]*\}))", 1, "a '{' is missing; write '{$1'"},
    {On::refused, R"([\w-]+: +((?:[^{}"'[\]]* )?([A-Za-z][\w-]*):(?: .*)?))", 1,
     "two keys on one line; begin a new line for '$2'; one text that holds ': ' must be in quotes: "
     "\"$1\""},
    {On::odd, "([A-Za-z][\\w-]*)(\xEF\xBC\x9A)\\s*(.*)", 2,
     "'$2' is no colon of the keyboard; write '$1: $3'"},
    {On::odd, R"(([A-Za-z][\w-]*|<<):(?!//)(.+))", 2,
     "a blank is missing after '$1:'; write '$1: $2'"},
    {On::odd, R"(([A-Za-z][\w-]*|<<)\s*(:=|=>|[=;])\s*(.*))", 2,
     "a key is followed by ':', not '$2'; write '$1: $3'"},
    {On::odd, R"(([A-Za-z][\w-]*|<<)(?=[\s*]|$)(\s*):?\s*(.*))", 2,
     "a ':' is missing after '$1'; write '$1: $3'"},
});

using Match = std::match_results<std::string_view::const_iterator>;

std::string_view group(const Match& match, std::size_t number) {
    if (number >= match.size() || !match[number].matched) return {};
    return {match[number].first, match[number].second};
}

/// Puts the groups into the sentence; in `write 'key: $1'` an empty group takes its blank along.
std::string told(const Slip& slip, const Match& match) {
    std::string text;
    for (std::size_t at = 0; at < slip.says.size(); ++at) {
        const char next = at + 1 < slip.says.size() ? slip.says[at + 1] : ' ';
        if (slip.says[at] != '$' || next < '1' || next > '3') {
            text += slip.says[at];
            continue;
        }
        ++at;
        const std::string_view part = group(match, static_cast<std::size_t>(next - '0'));
        if (!part.empty()) {
            text += part;
        } else if (text.ends_with(' ')) {
            text.pop_back();
        } else if (text.ends_with('{')) {
            text += "NAME";
        }
    }
    return text;
}

}  // namespace

std::optional<Finding> slip_of(std::string_view line, std::size_t at, On on) {
    static const std::vector<std::regex> kPatterns = [] {
        std::vector<std::regex> all;
        for (const Slip& slip : kSlips) all.emplace_back(slip.pattern, std::regex::optimize);
        return all;
    }();
    constexpr std::size_t kLongestLine = 200;  // of a typed line
    if (line.empty() || line.size() > kLongestLine) return std::nullopt;
    for (std::size_t row = 0; row < kSlips.size(); ++row) {
        Match match;
        if (kSlips[row].on != on ||
            !std::regex_match(line.begin(), line.end(), match, kPatterns[row]))
            continue;
        const auto cursor = match.position(kSlips[row].cursor);
        return Finding{at + static_cast<std::size_t>(cursor), told(kSlips[row], match)};
    }
    return std::nullopt;
}

}  // namespace panelgate::yaml
