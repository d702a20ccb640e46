#include "encoding.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>

#include "panelgate/base/text.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

constexpr char32_t kReplacement = 0xFFFD;
constexpr char32_t kMark = 0xFEFF;

std::uint8_t byte_at(std::string_view text, std::size_t at) {
    return static_cast<std::uint8_t>(text[at]);
}

void append(std::string& text, char32_t c) {
    const auto put = [&text](char32_t bits) { text += static_cast<char>(bits & 0xFF); };
    const auto follow = [&put](char32_t bits) { put(0x80 | (bits & 0x3F)); };
    if (c < 0x80) {
        put(c);
    } else if (c < 0x800) {
        put(0xC0 | (c >> 6));
        follow(c);
    } else if (c < 0x10000) {
        put(0xE0 | (c >> 12));
        follow(c >> 6);
        follow(c);
    } else {
        put(0xF0 | (c >> 18));
        follow(c >> 12);
        follow(c >> 6);
        follow(c);
    }
}

bool is_surrogate(char32_t c) { return c >= 0xD800 && c < 0xE000; }

bool is_control(char32_t c) {
    if (c == '\t' || c == '\n' || c == '\r' || c == 0x85) return false;
    return c < 0x20 || (c >= 0x7F && c < 0xA0) || (c & 0xFFFE) == 0xFFFE;
}

/// One character and its length in bytes; no character if the bytes are invalid.
struct Step {
    std::optional<char32_t> character;
    std::size_t bytes = 1;
};

Step step_utf8(std::string_view bytes) {
    const std::size_t length = utf8_sequence(bytes);
    if (length == 0) return {};
    return {code_point(bytes.substr(0, length)), length};
}

/// One unit of 2 or 4 bytes.
char32_t unit(std::string_view bytes, std::size_t width, bool big) {
    char32_t value = 0;
    for (std::size_t i = 0; i < width; ++i)
        value = (value << 8) | byte_at(bytes, big ? i : width - 1 - i);
    return value;
}

Step step_wide(std::string_view bytes, std::size_t width, bool big) {
    if (bytes.size() < width) return {std::nullopt, bytes.size()};
    const char32_t first = unit(bytes, width, big);
    if (width == 4) return {first > 0x10FFFF || is_surrogate(first) ? Step{}.character : first, 4};
    if (!is_surrogate(first)) return {first, 2};
    if (first >= 0xDC00 || bytes.size() < 4) return {std::nullopt, 2};
    const char32_t second = unit(bytes.substr(2), 2, big);
    if (second < 0xDC00 || second >= 0xE000) return {std::nullopt, 2};
    return {0x10000 + ((first - 0xD800) << 10) + (second - 0xDC00), 4};
}

struct Encoding {
    std::size_t width = 1;
    bool big = false;
};

/// Detects it by a byte order mark, or by where the zeros of an ASCII character are.
Encoding encoding_of(std::string_view bytes) {
    const auto begins = [bytes](std::string_view with) { return bytes.starts_with(with); };
    const auto zero = [bytes](std::size_t at) { return bytes.size() > at && bytes[at] == '\0'; };
    using namespace std::string_view_literals;
    if (begins("\0\0\xFE\xFF"sv) || (zero(0) && zero(1) && zero(2))) return {4, true};
    if (begins("\xFF\xFE\0\0"sv) || (zero(1) && zero(2) && zero(3))) return {4, false};
    if (begins("\xFE\xFF"sv) || zero(0)) return {2, true};
    if (begins("\xFF\xFE"sv) || zero(1)) return {2, false};
    return {1, false};
}

std::string why_bad(const Step& step, std::string_view bytes, const Encoding& encoding) {
    if (step.character)
        return "control character " + name_of(*step.character) + " in the text; remove it";
    std::array<char, 8> hex{};
    std::snprintf(hex.data(), hex.size(), "0x%02X", static_cast<unsigned>(byte_at(bytes, 0)));
    const std::string what = encoding.width == 1 ? "UTF-8" : "a character of this file's encoding";
    return "byte " + std::string(hex.data()) + " is not " + what + "; save the file as UTF-8";
}

/// A CR alone also ends a line (YAML 1.2, 5.4).
void end_lines(std::string& text) {
    for (std::size_t at = text.find('\r'); at != text.npos; at = text.find('\r', at + 1)) {
        if (at + 1 == text.size() || text[at + 1] != '\n') text[at] = '\n';
    }
}

}  // namespace

Decoded decode(std::string_view bytes) {
    const Encoding encoding = encoding_of(bytes);
    Decoded decoded;
    decoded.text.reserve(bytes.size());
    bool told = false;  // on this line
    for (bool first = true; !bytes.empty(); first = false) {
        const Step step =
            encoding.width == 1 ? step_utf8(bytes) : step_wide(bytes, encoding.width, encoding.big);
        const char32_t c = step.character.value_or(kReplacement);
        const bool bad = !step.character || is_control(c);
        if (bad && !told && decoded.bad.size() < kMaxShown) {
            decoded.bad.push_back({decoded.text.size(), why_bad(step, bytes, encoding)});
            told = true;
        }
        if (c == '\n') told = false;
        if (!first || c != kMark) append(decoded.text, bad ? kReplacement : c);
        bytes.remove_prefix(step.bytes);
    }
    end_lines(decoded.text);
    return decoded;
}

std::string_view character_at(std::string_view text, std::size_t at) {
    return text.substr(at, std::max<std::size_t>(1, utf8_sequence(text.substr(at))));
}

char32_t code_point(std::string_view character) {
    const std::uint8_t lead = byte_at(character, 0);
    if (character.size() == 1) return lead;
    char32_t c = lead & (0xFFU >> (character.size() + 1));
    for (std::size_t i = 1; i < character.size(); ++i)
        c = (c << 6) | (byte_at(character, i) & 0x3FU);
    return c;
}

std::string_view clip(std::string_view text, std::size_t most) {
    std::size_t end = std::min(most, text.size());
    while (end < text.size() && end > 0 && (byte_at(text, end) & 0xC0) == 0x80) --end;
    return text.substr(0, end);
}

std::string name_of(char32_t character) {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "U+%04X", static_cast<unsigned>(character));
    return text.data();
}

}  // namespace panelgate::yaml
