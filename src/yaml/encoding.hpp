#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::yaml {

/// One fault and its place in a text.
struct Finding {
    std::size_t offset = 0;
    std::string message;
};
using Findings = std::vector<Finding>;

struct Decoded {
    std::string text;  ///< UTF-8 without a byte order mark, each line ended by LF or CR LF
    Findings bad;      ///< the first of each line, at most kMaxShown lines
};

/// Decodes UTF-8, or a wider Unicode encoding by its first bytes (YAML 1.2, 5.2). Invalid bytes and
/// control characters (5.1) become U+FFFD: yaml-cpp accepts any byte, and takes U+0004 for the end
/// of the file.
Decoded decode(std::string_view bytes);

/// Returns the character that begins at `at`, at most to the end of the text, which must be
/// decoded.
std::string_view character_at(std::string_view text, std::size_t at);
/// Returns its code point.
char32_t code_point(std::string_view character);
/// Returns the first `most` bytes, not cut inside a character.
std::string_view clip(std::string_view text, std::size_t most);
/// Returns "U+00A0"
std::string name_of(char32_t character);

}  // namespace panelgate::yaml
