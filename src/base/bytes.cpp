#include "panelgate/base/bytes.hpp"

#include <algorithm>

namespace panelgate {

std::uint8_t Reader::u8() {
    const ByteView b = take(1);
    return b.empty() ? std::uint8_t{0} : b[0];
}

std::uint16_t Reader::u16() {
    const ByteView b = take(2);
    return b.empty() ? std::uint16_t{0} : static_cast<std::uint16_t>(b[0] << 8 | b[1]);
}

ByteView Reader::take(std::size_t n) {
    if (!ok_ || left() < n) {
        ok_ = false;
        return {};
    }
    const ByteView part = bytes_.subspan(at_, n);
    at_ += n;
    return part;
}

Writer& Writer::u8(unsigned value) {
    bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
}

Writer& Writer::u16(unsigned value) {
    bytes_.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
}

Writer& Writer::raw(ByteView bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
}

void append_up_to(std::size_t limit, Bytes& bytes, ByteView more) {
    const std::size_t room = limit - std::min(limit, bytes.size());
    more = more.first(std::min(room, more.size()));
    bytes.insert(bytes.end(), more.begin(), more.end());
}

std::string to_hex(ByteView bytes, std::string_view separator) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    text.reserve(bytes.size() * (2 + separator.size()));
    for (const std::uint8_t b : bytes) {
        if (!text.empty()) text += separator;
        text += kDigits[b >> 4];
        text += kDigits[b & 15];
    }
    return text;
}

namespace {

int nibble(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

}  // namespace

std::optional<Bytes> from_hex(std::string_view text) {
    Bytes bytes;
    std::size_t i = 0;
    while (i < text.size()) {
        if (text[i] == ' ') {
            ++i;
            continue;
        }
        const int high = nibble(text[i]);
        const int low = i + 1 < text.size() ? nibble(text[i + 1]) : -1;
        if (high < 0 || low < 0) return std::nullopt;
        bytes.push_back(static_cast<std::uint8_t>(high << 4 | low));
        i += 2;
    }
    return bytes;
}

}  // namespace panelgate
