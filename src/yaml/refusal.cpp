#include "refusal.hpp"

#include <array>

namespace panelgate::yaml {
namespace {

struct Words {
    std::string_view refusal;  ///< how it begins (yaml-cpp/exceptions.h)
    std::string_view ours;
};

constexpr std::string_view kIndentation =
    "the indentation is wrong here or above: keys of one map, and the '-' of one list, stand in "
    "one column";
constexpr std::string_view kBracket =
    "a bracket or a comma is missing before this: write {key: value, key: value} or [a, b]";
constexpr std::string_view kColon =
    "a key cannot stand here: write each 'key: value' on a line of its own, in the column of its "
    "neighbours";
constexpr std::string_view kName = "a name of letters and digits must follow & or *";
constexpr std::string_view kTag = "a tag (!...) has no meaning here; leave it out";
constexpr std::string_view kDirective = "a directive (%...) has no meaning here; leave it out";
constexpr std::string_view kHex =
    "what follows this backslash is no character; write \\xNN or \\uNNNN, or \\\\ for a backslash";

constexpr std::array<Words, 30> kWords{{
    {"end of map flow", kBracket},
    {"end of sequence flow", kBracket},
    {"illegal flow end", kBracket},
    {"end of map", kIndentation},
    {"end of sequence", kIndentation},
    {"illegal map", kColon},
    {"unexpected end", kIndentation},
    {"illegal block entry",
     "a '-' cannot stand here: write each item of a list on a line of its own, below a key without "
     "a value"},
    {"illegal tab", "a tab in the indentation; type blanks in its place"},
    {"unknown token", "this character cannot begin a text; put the text in quotes"},
    {"the referenced anchor", "'*' repeats a name that no '&' gives; put a text in quotes"},
    {"illegal EOF", "the file ends inside a text in quotes; close the quote"},
    {"illegal document indicator",
     "'---' or '...' inside a text in quotes; close the quote before it"},
    {"unknown escape", "this backslash means nothing in double quotes; write \\\\ for a backslash"},
    {"bad character found while scanning hex", kHex},
    {"invalid unicode", kHex},
    {"alias not found", kName},
    {"anchor not found", kName},
    {"illegal character found while scanning alias", kName},
    {"illegal character found while scanning anchor", kName},
    {"illegal character found while scanning tag", kTag},
    {"tag handle", kTag},
    {"end of verbatim tag", kTag},
    {"cannot assign multiple", "more than one & or ! before one value; leave one out"},
    {"aliases can't", "nothing may stand between * and what it repeats; leave it out"},
    {"cannot set zero", "0 cannot follow | or >; leave it out"},
    {"unexpected character in block", "only a comment may follow | or > on its line"},
    {"bad YAML version", kDirective},
    {"YAML ", kDirective},
    {"repeated ", kDirective},
}};

}  // namespace

std::string in_our_words(std::string_view refusal) {
    for (const Words& words : kWords) {
        if (refusal.starts_with(words.refusal)) return std::string(words.ours);
    }
    return "this is not YAML (" + std::string(refusal) + "); put texts in quotes";
}

}  // namespace panelgate::yaml
