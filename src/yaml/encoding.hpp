#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::yaml {

/// What is wrong at one place of a text.
struct Finding {
    std::size_t offset = 0;
    std::string message;
};
using Findings = std::vector<Finding>;

struct Decoded {
    std::string text;  ///< UTF-8 without a byte order mark, each line ended by LF or CR LF
    Findings bad;      ///< the first of each line, at most kMaxTold lines
};

/// UTF-8, or by the first bytes one of the wider encodings of Unicode (YAML 1.2, 5.2). What is not
/// of that encoding, and control characters (5.1), become U+FFFD: yaml-cpp takes any byte, and
/// U+0004 for the end of the file.
Decoded decode(std::string_view bytes);

/// The character that begins at `at`, at most to the end of the text. Not for text that was not
/// decoded.
std::string_view character_at(std::string_view text, std::size_t at);
/// Its code point.
char32_t code_point(std::string_view character);
/// The first `most` bytes, not ended inside a character.
std::string_view clip(std::string_view text, std::size_t most);
/// "U+00A0"
std::string name_of(char32_t character);

}  // namespace panelgate::yaml
