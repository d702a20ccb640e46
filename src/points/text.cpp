#include "text.hpp"

#include <algorithm>
#include <cstddef>

#include "panelgate/base/utf8.hpp"

namespace panelgate::points {
namespace {

std::string to_utf8(std::string_view bytes) {
    std::string text;
    while (!bytes.empty()) {
        const std::size_t length = utf8_sequence(bytes);
        text += length == 0 ? std::string_view("\xEF\xBF\xBD") : bytes.substr(0, length);
        bytes.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return text;
}

}  // namespace

std::string text_of_words(const std::vector<std::uint16_t>& words, unsigned length) {
    std::string bytes;
    for (const std::uint16_t word : words) {
        bytes += static_cast<char>(word >> 8);
        bytes += static_cast<char>(word & 0xFF);
    }
    bytes.resize(std::min<std::size_t>({bytes.size(), length, bytes.find('\0')}));
    bytes.resize(bytes.find_last_not_of(' ') + 1);
    return to_utf8(bytes);
}

std::vector<std::uint16_t> text_to_words(std::string_view text, unsigned count) {
    std::vector<std::uint16_t> words(count);
    for (std::size_t i = 0; i < text.size(); ++i) {
        const unsigned byte = static_cast<unsigned char>(text[i]);
        words[i / 2] = static_cast<std::uint16_t>(words[i / 2] | (i % 2 == 0 ? byte << 8 : byte));
    }
    return words;
}

bool is_no_number(std::string text) {
    std::ranges::transform(text, text.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    if (text.starts_with('-') || text.starts_with('+')) text.erase(0, 1);
    return text == "nan" || text == "inf" || text == "infinity";
}

}  // namespace panelgate::points
