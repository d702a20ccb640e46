#include "protobuf.hpp"

#include <cstddef>

namespace panelgate::mqtt {
namespace {

enum Wire : unsigned { kVarint = 0, kFixed64 = 1, kLength = 2, kFixed32 = 5 };
constexpr unsigned kWireBits = 3;
constexpr unsigned kGroup = 7;     // bits of a varint in a byte
constexpr unsigned kLongest = 10;  // bytes of a varint

}  // namespace

void ProtobufWriter::raw(std::uint64_t value) {
    while (value >= 0x80) {
        text_ += static_cast<char>(0x80 | (value & 0x7F));
        value >>= kGroup;
    }
    text_ += static_cast<char>(value);
}

void ProtobufWriter::little_endian(std::uint64_t value, unsigned size) {
    for (unsigned i = 0; i < size; ++i) text_ += static_cast<char>(value >> (8 * i));
}

ProtobufWriter& ProtobufWriter::varint(unsigned field, std::uint64_t value) {
    raw(field << kWireBits | kVarint);
    raw(value);
    return *this;
}

ProtobufWriter& ProtobufWriter::fixed32(unsigned field, std::uint32_t value) {
    raw(field << kWireBits | kFixed32);
    little_endian(value, 4);
    return *this;
}

ProtobufWriter& ProtobufWriter::fixed64(unsigned field, std::uint64_t value) {
    raw(field << kWireBits | kFixed64);
    little_endian(value, 8);
    return *this;
}

ProtobufWriter& ProtobufWriter::bytes(unsigned field, std::string_view value) {
    raw(field << kWireBits | kLength);
    raw(value.size());
    text_ += value;
    return *this;
}

std::optional<std::uint64_t> ProtobufReader::varint() {
    std::uint64_t value = 0;
    for (unsigned i = 0; i < kLongest && i < text_.size(); ++i) {
        const auto byte = static_cast<std::uint8_t>(text_[i]);
        value |= static_cast<std::uint64_t>(byte & 0x7F) << (kGroup * i);
        if ((byte & 0x80) != 0) continue;
        text_.remove_prefix(i + 1);
        return value;
    }
    return std::nullopt;
}

std::optional<std::uint64_t> ProtobufReader::little_endian(unsigned size) {
    if (text_.size() < size) return std::nullopt;
    std::uint64_t value = 0;
    for (unsigned i = 0; i < size; ++i)
        value |= static_cast<std::uint64_t>(static_cast<std::uint8_t>(text_[i])) << (8 * i);
    text_.remove_prefix(size);
    return value;
}

std::optional<ProtobufField> ProtobufReader::broken() {
    ok_ = false;
    text_ = {};
    return std::nullopt;
}

std::optional<ProtobufField> ProtobufReader::next() {
    if (text_.empty()) return std::nullopt;
    const auto key = varint();
    if (!key || *key >> kWireBits == 0 || *key >> 32 != 0) return broken();
    ProtobufField field;
    field.number = static_cast<unsigned>(*key >> kWireBits);
    const auto wire = static_cast<unsigned>(*key & 7);
    std::optional<std::uint64_t> value;
    if (wire == kVarint || wire == kLength) value = varint();
    if (wire == kFixed64) value = little_endian(8);
    if (wire == kFixed32) value = little_endian(4);
    if (!value) return broken();
    field.value = *value;
    field.has_length = wire == kLength;
    if (!field.has_length) return field;
    if (field.value > text_.size()) return broken();
    const auto size = static_cast<std::size_t>(field.value);
    field.bytes = text_.substr(0, size);
    text_.remove_prefix(size);
    return field;
}

}  // namespace panelgate::mqtt
