#include "lint.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <span>

#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {
namespace {

using Find = void (*)(const Scanned&, Findings&);

/// What is told first about a line is the nearest to its cause.
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
            if (all.size() < kMaxTold) all.push_back(std::move(finding));
        }
        lines.merge(told);
    }
    std::ranges::sort(all, {}, &Finding::offset);
    return all;
}

/// The signs of a patch disturb all that stands around them: they are told alone.
constexpr std::array<Find, 1> kPatches{find_patches};

}  // namespace

std::string_view Scanned::rest(std::size_t token) const {
    std::size_t last = token;
    while (follows(last + 1)) ++last;
    return source.text().substr(tokens[token].begin, tokens[last].end - tokens[token].begin);
}

Findings find_traps(const Scanned& text) {
    if (Findings patches = run(text, kPatches); !patches.empty()) return patches;
    static constexpr std::array<Find, 6> kFinds{find_odd_blanks,  find_odd_dashes,
                                                find_open_quotes, find_typeset_quotes,
                                                find_directives,  find_placeholders};
    return run(text, kFinds);
}

Findings find_causes(const Scanned& text) {
    if (Findings patches = run(text, kPatches); !patches.empty()) return patches;
    static constexpr std::array<Find, 10> kFinds{
        find_odd_blanks,   find_odd_dashes, find_open_quotes, find_typeset_quotes, find_directives,
        find_placeholders, find_quote_ends, find_brackets,    find_odd_starts,     find_columns};
    return run(text, kFinds);
}

}  // namespace panelgate::yaml
