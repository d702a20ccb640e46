#include <set>
#include <string>
#include <string_view>

#include "encoding.hpp"
#include "lint.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

bool is_port(std::string_view text) {
    return text.size() > 1 && text[0] == ':' &&
           text.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

void find_alias(const Token& token, std::string_view name, const std::set<std::string_view>& known,
                Findings& findings) {
    if (known.contains(name)) return;
    if (is_port(name)) {
        findings.push_back({token.begin, "'*' is no address; write 0.0.0.0" + std::string(name) +
                                             " for all addresses of this machine"});
    } else if (name.empty()) {
        findings.push_back(
            {token.begin, "a text that begins with '*' must stand in quotes; write \"*\""});
    } else {
        const std::string text = '*' + std::string(name);
        findings.push_back({token.begin, quote(text) + " repeats what '&" +
                                             std::string(clip(name, 60)) +
                                             "' names, and no such name stands before it; a text "
                                             "that begins with '*' must stand in quotes"});
    }
}

void find_odd(const Scanned& text, std::size_t i, Findings& findings) {
    const Token& token = text.tokens[i];
    const std::string_view word = text.text(token);
    if (word == ",") {
        findings.push_back({token.begin, "a ',' separates nothing here; remove it"});
        return;
    }
    findings.push_back({token.begin, "a text that begins with '" + std::string(1, word.front()) +
                                         "' must stand in quotes; write \"" +
                                         std::string(clip(word, 60)) + '"'});
}

}  // namespace

void find_odd_starts(const Scanned& text, Findings& findings) {
    std::set<std::string_view> anchors;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        const std::string_view word = text.text(token);
        if (token.kind == Kind::anchor) anchors.insert(word.substr(1));
        if (token.kind == Kind::alias) find_alias(token, word.substr(1), anchors, findings);
        if (token.kind == Kind::odd) find_odd(text, i, findings);
    }
}

}  // namespace panelgate::yaml
