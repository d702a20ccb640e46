#include "sparkplug_payload.hpp"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>
#include <variant>

#include "panelgate/base/text.hpp"

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

namespace {

// Field numbers of sparkplug_b.proto (Sparkplug 3.0, 6.4).
namespace payload {
constexpr unsigned kTimestamp = 1, kMetrics = 2, kSeq = 3;
}
namespace metric {
constexpr unsigned kName = 1, kAlias = 2, kTimestamp = 3, kDatatype = 4, kIsHistorical = 5,
                   kIsNull = 7, kProperties = 9, kInt = 10, kLong = 11, kFloat = 12, kDouble = 13,
                   kBoolean = 14, kString = 15;
}
namespace properties {
constexpr unsigned kKeys = 1, kValues = 2;
}
namespace property {
constexpr unsigned kType = 1, kInt = 3, kString = 8;
}

std::uint64_t milliseconds(WallTime time) {
    const auto since = std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch();
    return static_cast<std::uint64_t>(since.count());
}

/// The codes of the property Quality (Sparkplug 3.0, 6.4.10).
std::uint32_t code_of(points::Quality quality) {
    if (quality == points::Quality::good) return 192;
    return quality == points::Quality::stale ? 500 : 0;
}

/// Converts to an integer in two's complement.
struct Whole {
    std::uint64_t operator()(bool value) const { return value ? 1 : 0; }
    std::uint64_t operator()(std::int64_t value) const { return static_cast<std::uint64_t>(value); }
    std::uint64_t operator()(std::uint64_t value) const { return value; }
    std::uint64_t operator()(double value) const {
        return static_cast<std::uint64_t>(std::llround(value));
    }
    std::uint64_t operator()(const Decimal& value) const {
        return (*this)(*points::number_of(value));
    }
    std::uint64_t operator()(const std::string&) const { return 0; }
};

void add_value(ProtobufWriter& out, DataType type, const points::Value& value) {
    const std::uint64_t whole =
        type == DataType::float32 || type == DataType::float64 ? 0 : std::visit(Whole(), value);
    switch (type) {
        case DataType::int16:
        case DataType::int32:
        case DataType::uint16:
            out.varint(metric::kInt, static_cast<std::uint32_t>(whole));
            return;
        case DataType::uint32:  // as in Tahu
        case DataType::int64:
        case DataType::uint64:
            out.varint(metric::kLong, whole);
            return;
        case DataType::float32:
            out.fixed32(metric::kFloat, std::bit_cast<std::uint32_t>(static_cast<float>(
                                            points::number_of(value).value_or(0))));
            return;
        case DataType::float64:
            out.fixed64(metric::kDouble,
                        std::bit_cast<std::uint64_t>(points::number_of(value).value_or(0)));
            return;
        case DataType::boolean:
            out.varint(metric::kBoolean, whole != 0 ? 1 : 0);
            return;
        case DataType::string:
            out.bytes(metric::kString, points::to_string(value));
            return;
    }
    std::abort();
}

std::string properties_of(const Metric& one) {
    ProtobufWriter set;
    if (one.quality) set.bytes(properties::kKeys, "Quality");
    if (!one.unit.empty()) set.bytes(properties::kKeys, "engUnit");
    if (one.quality)
        set.bytes(properties::kValues,
                  ProtobufWriter()
                      .varint(property::kType, static_cast<std::uint32_t>(DataType::int32))
                      .varint(property::kInt, code_of(*one.quality))
                      .take());
    if (!one.unit.empty())
        set.bytes(properties::kValues,
                  ProtobufWriter()
                      .varint(property::kType, static_cast<std::uint32_t>(DataType::string))
                      .bytes(property::kString, one.unit)
                      .take());
    return set.take();
}

std::string text_of(const Metric& one) {
    ProtobufWriter out;
    if (!one.name.empty()) out.bytes(metric::kName, one.name);
    if (one.alias) out.varint(metric::kAlias, *one.alias);
    out.varint(metric::kTimestamp, milliseconds(one.time));
    out.varint(metric::kDatatype, static_cast<std::uint32_t>(one.type));
    if (one.historical) out.varint(metric::kIsHistorical, 1);
    if (!one.value) out.varint(metric::kIsNull, 1);
    const std::string set = properties_of(one);
    if (!set.empty()) out.bytes(metric::kProperties, set);
    if (one.value) add_value(out, one.type, *one.value);
    return out.take();
}

void read_field(const ProtobufField& field, ReceivedMetric& heard) {
    switch (field.number) {
        case metric::kName:
            heard.name = field.bytes;
            break;
        case metric::kAlias:
            heard.alias = field.value;
            break;
        case metric::kDatatype:
            heard.type = static_cast<std::uint32_t>(field.value);
            break;
        case metric::kInt:
        case metric::kLong:
            heard.value = field.value;
            heard.is_integer = true;
            break;
        case metric::kFloat:
            heard.value =
                static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(field.value)));
            break;
        case metric::kDouble:
            heard.value = std::bit_cast<double>(field.value);
            break;
        case metric::kBoolean:
            heard.value = field.value != 0;
            break;
        case metric::kString:
            heard.value = std::string(field.bytes);
            break;
        default:
            break;
    }
}

std::optional<ReceivedMetric> parse_metric(std::string_view text) {
    ReceivedMetric heard;
    ProtobufReader in(text);
    bool is_null = false;
    while (const auto field = in.next()) {
        if (field->number == metric::kIsNull) is_null = field->value != 0;
        read_field(*field, heard);
    }
    const auto* text_value = heard.value ? std::get_if<std::string>(&*heard.value) : nullptr;
    if (!in.ok() || !is_utf8(heard.name) || (text_value != nullptr && !is_utf8(*text_value)))
        return std::nullopt;
    if (is_null) heard.value.reset();
    return heard;
}

}  // namespace

std::string sparkplug_payload(WallTime time, const std::vector<Metric>& metrics,
                              std::optional<std::uint8_t> seq) {
    ProtobufWriter out;
    out.varint(payload::kTimestamp, milliseconds(time));
    for (const Metric& one : metrics) out.bytes(payload::kMetrics, text_of(one));
    if (seq) out.varint(payload::kSeq, *seq);
    return out.take();
}

std::optional<std::vector<ReceivedMetric>> parse_sparkplug(std::string_view text,
                                                           std::size_t most) {
    std::vector<ReceivedMetric> metrics;
    ProtobufReader in(text);
    while (const auto field = in.next()) {
        if (field->number != payload::kMetrics || !field->has_length) continue;
        auto heard = parse_metric(field->bytes);
        if (!heard || metrics.size() == most) return std::nullopt;
        metrics.push_back(std::move(*heard));
    }
    if (!in.ok()) return std::nullopt;
    return metrics;
}

std::optional<points::Value> value_of(const ReceivedMetric& metric, DataType fallback) {
    if (!metric.value || !metric.is_integer) return metric.value;
    const auto bits = std::get<std::uint64_t>(*metric.value);
    const auto type = metric.type.value_or(static_cast<std::uint32_t>(fallback));
    switch (type) {
        case 1:  // Int8
        case static_cast<std::uint32_t>(DataType::int16):
        case static_cast<std::uint32_t>(DataType::int32):
            return static_cast<std::int64_t>(static_cast<std::int32_t>(bits));
        case static_cast<std::uint32_t>(DataType::int64):
            return static_cast<std::int64_t>(bits);
        default:
            return bits;
    }
}

}  // namespace panelgate::mqtt
