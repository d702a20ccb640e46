#include "panelgate/base/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <system_error>
#include <vector>

namespace panelgate {

namespace {

template <class Number>
std::string shortest(Number value) {
    if (!std::isfinite(value)) return {};
    if (value == 0) return "0";
    const Number size = std::abs(value);
    const bool plain = size >= Number(1e-4) && size < Number(1e16);
    char buffer[64];
    const auto format = plain ? std::chars_format::fixed : std::chars_format::scientific;
    const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value, format);
    return error == std::errc() ? std::string(buffer, end) : std::string();
}

}  // namespace

std::string number_text(double value) { return shortest(value); }
std::string number_text(float value) { return shortest(value); }

double as_printed(float value) {
    if (value == 0) return static_cast<double>(value);  // keeps its sign
    const std::string text = number_text(value);
    double printed = static_cast<double>(value);
    std::from_chars(text.data(), text.data() + text.size(), printed);
    return printed;
}

std::size_t utf8_sequence(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
    };
    const unsigned lead = byte(0);
    if (lead < 0x80) return 1;
    std::size_t length = 0;
    if (lead >= 0xC2 && lead <= 0xDF) length = 2;
    if (lead >= 0xE0 && lead <= 0xEF) length = 3;
    if (lead >= 0xF0 && lead <= 0xF4) length = 4;
    // Overlong forms, surrogates, and what lies above U+10FFFF.
    const unsigned low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const unsigned high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    if (length == 0 || byte(1) < low || byte(1) > high) return 0;
    for (std::size_t i = 2; i < length; ++i)
        if (byte(i) < 0x80 || byte(i) > 0xBF) return 0;
    return length;
}

bool is_utf8(std::string_view text) {
    while (!text.empty()) {
        const std::size_t length = utf8_sequence(text);
        if (length == 0) return false;
        text.remove_prefix(length);
    }
    return true;
}

std::size_t byte_order_mark(std::string_view text) {
    constexpr std::string_view kMark = "\xef\xbb\xbf";
    return text.starts_with(kMark) ? kMark.size() : 0;
}

std::string as_utf8(std::string_view bytes) {
    std::string text;
    text.reserve(bytes.size());
    while (!bytes.empty()) {
        const std::size_t length = utf8_sequence(bytes);
        text += length == 0 ? std::string_view("\uFFFD") : bytes.substr(0, length);
        bytes.remove_prefix(length == 0 ? 1 : length);
    }
    return text;
}

namespace {

/// Number of edits (insert, delete, replace, swap of neighbours) that turn a into b.
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1);
    std::vector<std::size_t> above(b.size() + 1);
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(above.begin(), above.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replace = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, replace});
            const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = above;
        above = row;
    }
    return above[b.size()];
}

/// Keeps letters and digits, in lower case: "Panasonic GT" is panasonicgt.
std::string plain(std::string_view text) {
    std::string all;
    for (const char c : text) {
        if (c >= 'A' && c <= 'Z') {
            all += static_cast<char>(c - 'A' + 'a');
        } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
            all += c;
        }
    }
    return all;
}

struct Synonym {
    std::string_view word;
    std::string_view meant;
};
/// Synonyms of other programs and industries.
constexpr std::array<Synonym, 115> kSynonyms{{{"baudrate", "baud"},
                                              {"speed", "baud"},
                                              {"bitrate", "baud"},
                                              {"bps", "baud"},
                                              {"bytesize", "data_bits"},
                                              {"bits", "data_bits"},
                                              {"n", "none"},
                                              {"no", "none"},
                                              {"e", "even"},
                                              {"o", "odd"},
                                              {"int16", "i16"},
                                              {"s16", "i16"},
                                              {"s32", "i32"},
                                              {"s64", "i64"},
                                              {"int", "i16"},
                                              {"sint16", "i16"},
                                              {"signed", "i16"},
                                              {"uint16", "u16"},
                                              {"uint", "u16"},
                                              {"word", "u16"},
                                              {"unsigned", "u16"},
                                              {"int32", "i32"},
                                              {"dint", "i32"},
                                              {"uint32", "u32"},
                                              {"dword", "u32"},
                                              {"int64", "i64"},
                                              {"uint64", "u64"},
                                              {"float", "f32"},
                                              {"float32", "f32"},
                                              {"real", "f32"},
                                              {"single", "f32"},
                                              {"double", "f64"},
                                              {"float64", "f64"},
                                              {"lreal", "f64"},
                                              {"boolean", "bool"},
                                              {"bit", "bool"},
                                              {"text", "string"},
                                              {"bcd", "bcd16"},
                                              {"warning", "warn"},
                                              {"err", "error"},
                                              {"fatal", "error"},
                                              {"critical", "error"},
                                              {"plain", "text"},
                                              {"ro", "read_only"},
                                              {"rw", "read_write"},
                                              {"admin", "operator"},
                                              {"guest", "viewer"},
                                              {"true", "on"},
                                              {"yes", "on"},
                                              {"false", "off"},
                                              {"no", "off"},
                                              {"off", "none"},
                                              {"swap", "CDAB"},
                                              {"slave", "id"},
                                              {"slaveid", "id"},
                                              {"unit", "id"},
                                              {"unitid", "id"},
                                              {"address", "id"},
                                              {"address", "at"},
                                              {"address", "listen"},
                                              {"register", "at"},
                                              {"register", "read"},
                                              {"bind", "listen"},
                                              {"port", "device"},
                                              {"port", "listen"},
                                              {"tty", "device"},
                                              {"model", "profile"},
                                              {"slaves", "stations"},
                                              {"devices", "stations"},
                                              {"modbus", "modbus_tcp"},
                                              {"host", "listen"},
                                              {"readonly", "access"},
                                              {"size", "limit"},
                                              {"size", "count"},
                                              {"interval", "every"},
                                              {"period", "every"},
                                              {"factor", "scale"},
                                              {"source", "from"},
                                              {"target", "to"},
                                              {"timeout", "response_timeout"},
                                              {"timeoutms", "response_timeout"},
                                              {"sensors", "points"},
                                              {"registers", "points"},
                                              {"tags", "points"},
                                              {"datatype", "type"},
                                              {"unitofmeasurement", "unit"},
                                              {"scaninterval", "every"},
                                              {"pollinterval", "every"},
                                              {"multiplier", "scale"},
                                              {"gain", "scale"},
                                              {"byteorder", "word_order"},
                                              {"endianness", "word_order"},
                                              {"endian", "word_order"},
                                              {"big", "ABCD"},
                                              {"bigendian", "ABCD"},
                                              {"little", "DCBA"},
                                              {"littleendian", "DCBA"},
                                              {"16bit", "u16"},
                                              {"32bit", "u32"},
                                              {"float16", "f16"},
                                              {"half", "f16"},
                                              {"uint48", "u48"},
                                              {"int48", "i48"},
                                              {"uint8h", "u8h"},
                                              {"uint8l", "u8l"},
                                              {"int8h", "i8h"},
                                              {"int8l", "i8l"},
                                              {"uint8", "u8l"},
                                              {"u8", "u8l"},
                                              {"byte", "u8l"},
                                              {"int8", "i8l"},
                                              {"i8", "i8l"},
                                              {"s8", "i8l"},
                                              {"0", "none"},
                                              {"writable", "access"}}};

/// Strips a byte order suffix: float32be, uint16le.
std::string_view without_order(std::string_view typed) {
    const bool ordered = typed.ends_with("be") || typed.ends_with("le");
    return typed.substr(0, typed.size() - (ordered ? 2 : 0));
}

std::string synonym(std::string_view typed, std::span<const std::string_view> candidates) {
    for (const Synonym& synonym : kSynonyms) {
        if (synonym.word != typed) continue;
        const bool known = std::ranges::find(candidates, synonym.meant) != candidates.end();
        if (known) return std::string(synonym.meant);
    }
    return "";
}

}  // namespace

std::string nearest(std::string_view typed, std::span<const std::string_view> candidates) {
    const std::string letters = plain(typed);
    for (const std::string_view candidate : candidates) {
        if (!letters.empty() && plain(candidate) == letters) return std::string(candidate);
    }
    for (const std::string_view candidate : candidates) {
        if (!typed.empty() && candidate == std::string(typed) + 's') return std::string(candidate);
    }
    if (std::string meant = synonym(letters, candidates); !meant.empty()) return meant;
    if (std::string meant = synonym(without_order(letters), candidates); !meant.empty())
        return meant;
    std::string_view best;
    std::size_t least = 3;
    for (const std::string_view candidate : candidates) {
        const std::size_t longer = std::max(typed.size(), candidate.size());
        if (longer - std::min(typed.size(), candidate.size()) >= least) continue;
        const std::size_t edits = distance(typed, candidate);
        if (edits < least && edits * 3 <= longer) {
            least = edits;
            best = candidate;
        }
    }
    return std::string(best);
}

std::string to_lower(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return lower;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank = " \t";
    const std::size_t begin = std::min(text.find_first_not_of(kBlank), text.size());
    return text.substr(begin, text.find_last_not_of(kBlank) + 1 - begin);
}

std::string printable(std::string_view text) {
    std::string made = as_utf8(text);
    std::ranges::replace_if(made, is_control, '?');
    return made;
}

}  // namespace panelgate
