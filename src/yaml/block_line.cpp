#include "block_line.hpp"

namespace panelgate::yaml {
namespace {

using Kind = Token::Kind;

bool can_be_key(Kind kind) {
    return kind == Kind::plain || kind == Kind::quoted || kind == Kind::alias || kind == Kind::odd;
}

/// The next token of the line that is no anchor or tag.
std::optional<std::size_t> content(const Scanned& text, std::size_t i, bool first) {
    for (; first ? i < text.tokens.size() : text.follows(i); ++i, first = false) {
        const Kind kind = text.tokens[i].kind;
        if (kind != Kind::anchor && kind != Kind::tag) return i;
    }
    return std::nullopt;
}

BlockLine block_line(const Scanned& text, std::size_t begin) {
    BlockLine line;
    std::size_t i = begin;
    while (text.tokens[i].kind == Kind::dash) {
        line.dashes.push_back(i++);
        if (!text.follows(i)) return line;
    }
    const auto word = content(text, i, i == begin);
    if (!word) return line;
    const bool colon = text.follows(*word + 1) && text.tokens[*word + 1].kind == Kind::colon;
    if (colon && can_be_key(text.tokens[*word].kind)) {
        line.key = word;
        line.text = content(text, *word + 2, false);
    } else {
        line.text = word;
    }
    return line;
}

}  // namespace

std::vector<BlockLine> block_lines(const Scanned& text) {
    std::vector<BlockLine> lines;
    for (std::size_t i = 0; i < text.tokens.size(); ++i) {
        const Token& token = text.tokens[i];
        if (token.first && token.depth == 0 && token.kind != Kind::document)
            lines.push_back(block_line(text, i));
    }
    return lines;
}

}  // namespace panelgate::yaml
