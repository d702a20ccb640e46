#include "panelgate/audit/record.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cstdlib>

#include "panelgate/base/text.hpp"

namespace panelgate::audit {

std::string_view label(Kind kind) {
    switch (kind) {
        case Kind::start:
            return "start";
        case Kind::end:
            return "end";
        case Kind::write:
            return "write";
        case Kind::refusal:
            return "refusal";
        case Kind::repeats:
            return "repeats";
        case Kind::login:
            return "login";
        case Kind::reload:
            return "reload";
        case Kind::discovery:
            return "discovery";
        case Kind::simulator:
            return "simulator";
        case Kind::token:
            return "token";
        case Kind::file:
            return "file";
        case Kind::lost:
            return "lost";
    }
    std::abort();
}

std::vector<std::string> kind_labels() {
    std::vector<std::string> labels;
    for (int kind = 0; kind <= static_cast<int>(Kind::lost); ++kind)
        labels.emplace_back(label(static_cast<Kind>(kind)));
    return labels;
}

namespace {

constexpr std::string_view kHex = "0123456789abcdef";

bool is_plain(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 && byte < 0x7f && c != '"' && c != '\\';
}

void append_number(std::string& out, std::uint64_t value) {
    std::array<char, 20> digits{};
    const auto [end, wrong] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    out.append(digits.data(), end);
}

/// `width` digits with leading zeros.
void append_digits(std::string& out, std::uint64_t value, std::size_t width) {
    std::array<char, 20> digits{};
    for (std::size_t i = width; i-- > 0; value /= 10)
        digits[i] = static_cast<char>('0' + value % 10);
    out.append(digits.data(), width);
}

void append_escaped(std::string& out, char c) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
        out += '\\';
        out += c;
    } else {
        out += "\\u00";
        out += kHex[byte >> 4U];
        out += kHex[byte & 0x0fU];
    }
}

}  // namespace

void append_json_text(std::string& out, std::string_view text) {
    while (!text.empty()) {
        std::size_t plain = 0;
        while (plain < text.size() && is_plain(text[plain])) ++plain;
        out += text.substr(0, plain);
        text.remove_prefix(plain);
        if (text.empty()) return;
        const std::size_t length = utf8_sequence(text);
        if (length > 1) {
            out += text.substr(0, length);
        } else if (length == 1) {
            append_escaped(out, text.front());
        } else {
            out += "\xEF\xBF\xBD";
        }
        text.remove_prefix(length == 0 ? 1 : length);
    }
}

void append_json(std::string& out, std::string_view text) {
    out += '"';
    append_json_text(out, text);
    out += '"';
}

std::string member(std::string_view key, std::string_view value) {
    std::string text = ",\"" + std::string(key) + "\":";
    append_json(text, value);
    return text;
}

Composer& Composer::begin(WallTime time, Kind kind) {
    body_.clear();
    body_ += "\"time\":\"";
    append_time(time);
    body_ += "\",\"kind\":\"";
    body_ += label(kind);
    body_ += '"';
    return *this;
}

void Composer::key(std::string_view key) {
    body_ += ",\"";
    body_ += key;
    body_ += "\":";
}

Composer& Composer::text(std::string_view name, std::string_view value) {
    if (value.empty()) return *this;
    key(name);
    append_json(body_, value);
    return *this;
}

Composer& Composer::word(std::string_view name, std::string_view value) {
    key(name);
    body_ += '"';
    body_ += value;
    body_ += '"';
    return *this;
}

Composer& Composer::number(std::string_view name, std::uint64_t value) {
    key(name);
    append_number(body_, value);
    return *this;
}

Composer& Composer::flag(std::string_view name, bool value) {
    key(name);
    body_ += value ? "true" : "false";
    return *this;
}

Composer& Composer::time(std::string_view name, WallTime value) {
    key(name);
    body_ += '"';
    append_time(value);
    body_ += '"';
    return *this;
}

Composer& Composer::hex(std::string_view name, ByteView bytes) {
    key(name);
    body_ += '"';
    for (const std::uint8_t byte : bytes) {
        body_ += kHex[byte >> 4U];
        body_ += kHex[byte & 0x0fU];
    }
    body_ += '"';
    return *this;
}

Composer& Composer::numbers(std::string_view name, std::span<const std::uint16_t> values) {
    key(name);
    body_ += '[';
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i > 0) body_ += ',';
        append_number(body_, values[i]);
    }
    body_ += ']';
    return *this;
}

Composer& Composer::texts(std::string_view name, std::span<const std::string> values) {
    key(name);
    body_ += '[';
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i > 0) body_ += ',';
        append_json(body_, values[i]);
    }
    body_ += ']';
    return *this;
}

Composer& Composer::members(std::string_view composed) {
    body_ += composed;
    return *this;
}

/// The text of a second is made once: most records of a busy line share it.
void Composer::append_time(WallTime time) {
    const auto second = std::chrono::floor<std::chrono::seconds>(time);
    if (second.time_since_epoch().count() != second_) {
        second_ = second.time_since_epoch().count();
        date_ = rfc3339(second).substr(0, 19);
    }
    body_ += date_;
    body_ += '.';
    append_digits(body_, static_cast<std::uint64_t>((time - second).count() / 1000), 3);
    body_ += 'Z';
}

}  // namespace panelgate::audit
