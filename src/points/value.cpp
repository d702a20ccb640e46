#include "panelgate/points/value.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>

#include "panelgate/base/number_text.hpp"
#include "text.hpp"

namespace panelgate::points {
namespace {

using Words = std::vector<std::uint16_t>;

bool swaps_bytes(WordOrder order) { return order == WordOrder::badc || order == WordOrder::dcba; }
bool swaps_words(WordOrder order) { return order == WordOrder::cdab || order == WordOrder::dcba; }

std::uint16_t swapped(std::uint16_t word) {
    return static_cast<std::uint16_t>(word << 8 | word >> 8);
}

/// Into the standard's order, or out of it: it is its own inverse.
Words reordered(std::span<const std::uint16_t> items, WordOrder order, bool keep_words) {
    Words words(items.begin(), items.end());
    if (swaps_bytes(order)) std::ranges::transform(words, words.begin(), swapped);
    if (swaps_words(order) && !keep_words) std::ranges::reverse(words);
    return words;
}

std::uint64_t joined(const Words& words) {
    std::uint64_t raw = 0;
    for (const std::uint16_t word : words) raw = raw << 16 | word;
    return raw;
}

Words parted(std::uint64_t raw, unsigned count) {
    Words words(count);
    for (unsigned i = count; i-- > 0; raw >>= 16) words[i] = static_cast<std::uint16_t>(raw);
    return words;
}

std::optional<std::int64_t> from_bcd(std::uint64_t raw, unsigned digits) {
    std::int64_t value = 0;
    for (unsigned i = digits; i-- > 0;) {
        const auto digit = static_cast<std::int64_t>(raw >> (4 * i) & 0xF);
        if (digit > 9) return std::nullopt;
        value = value * 10 + digit;
    }
    return value;
}

std::uint64_t to_bcd(std::uint64_t value) {
    std::uint64_t raw = 0;
    for (unsigned shift = 0; value > 0; shift += 4, value /= 10) raw |= value % 10 << shift;
    return raw;
}

/// An integer type's raw number: signed types sign-extended; u64 beyond int64 does not fit here.
struct Raw {
    bool is_unsigned = false;
    std::int64_t number = 0;
    std::uint64_t large = 0;  ///< of u64
};

std::optional<Raw> raw_of(Type type, std::uint64_t bits) {
    switch (type) {
        case Type::boolean:
        case Type::u16:
        case Type::u32:
            return Raw{false, static_cast<std::int64_t>(bits), 0};
        case Type::i16:
            return Raw{false, static_cast<std::int16_t>(bits), 0};
        case Type::i32:
            return Raw{false, static_cast<std::int32_t>(bits), 0};
        case Type::i64:
            return Raw{false, static_cast<std::int64_t>(bits), 0};
        case Type::u64:
            return Raw{true, static_cast<std::int64_t>(bits), bits};
        case Type::bcd16:
        case Type::bcd32: {
            const auto value = from_bcd(bits, type == Type::bcd16 ? 4 : 8);
            if (!value) return std::nullopt;
            return Raw{false, *value, 0};
        }
        case Type::f32:
        case Type::f64:
        case Type::string:
            break;
    }
    std::abort();
}

bool is_plain(const Point& point) { return point.scale == 1 && point.offset == 0; }

/// n when the scale is 1/n. Dividing by n gives the double nearest to the decimal number, 0.3;
/// multiplying by 0.1 gives 0.30000000000000004.
std::optional<double> divisor_of(double scale) {
    const double inverse = std::round(1 / scale);
    if (std::abs(scale) >= 1 || 1 / inverse != scale) return std::nullopt;
    return inverse;
}

double from_raw(const Point& point, double raw) {
    const auto divisor = divisor_of(point.scale);
    return (divisor ? raw / *divisor : raw * point.scale) + point.offset;
}

double to_raw(const Point& point, double value) {
    const auto divisor = divisor_of(point.scale);
    return divisor ? (value - point.offset) * *divisor : (value - point.offset) / point.scale;
}

/// As many low bits count as the type has: -1 and 65535 are the same u16.
bool means_none(const Point& point, std::uint64_t number) {
    const unsigned unused = 64 - 16 * registers_of(point.type);
    return std::ranges::any_of(point.no_value, [&](std::int64_t none) {
        return (static_cast<std::uint64_t>(none) ^ number) << unused == 0;
    });
}

bool means_none(const Point& point, double number) {
    return std::ranges::any_of(
        point.no_value, [&](std::int64_t none) { return static_cast<double>(none) == number; });
}

std::optional<Value> scaled(const Point& point, double raw) {
    const double value = from_raw(point, raw);
    if (!std::isfinite(value)) return std::nullopt;
    return Value(value);
}

std::optional<Value> decode_double(const Point& point, double raw) {
    if (means_none(point, raw)) return std::nullopt;
    return scaled(point, raw);
}

/// As a float prints, 0.1: widened to a double it would be 0.10000000149011612.
std::optional<Value> decode_float(const Point& point, float raw) {
    if (means_none(point, static_cast<double>(raw))) return std::nullopt;
    return scaled(point, as_printed(raw));
}

WriteRefusal refusal(std::string message) { return {std::move(message)}; }

struct Limits {
    double low = 0;
    double high = 0;
};

Limits limits_of(Type type) {
    switch (type) {
        case Type::boolean:
            return {0, 1};
        case Type::u16:
            return {0, 65535};
        case Type::i16:
            return {-32768, 32767};
        case Type::u32:
            return {0, 4294967295.0};
        case Type::i32:
            return {-2147483648.0, 2147483647.0};
        case Type::u64:
            return {0, 18446744073709549568.0};  // the largest double below 2^64
        case Type::i64:
            return {-9223372036854775808.0, 9223372036854774784.0};
        case Type::bcd16:
            return {0, 9999};
        case Type::bcd32:
            return {0, 99999999};
        case Type::f32:
            return {-as_printed(std::numeric_limits<float>::max()),
                    as_printed(std::numeric_limits<float>::max())};
        case Type::f64:
        case Type::string:
            return {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
    }
    std::abort();
}

std::string range_text(const Point& point) {
    const Limits limits = limits_of(point.type);
    std::string low = number_text(from_raw(point, limits.low));
    std::string high = number_text(from_raw(point, limits.high));
    if (point.scale < 0) std::swap(low, high);
    if (is_plain(point) && point.type == Type::u64) high = "18446744073709551615";
    if (is_plain(point) && point.type == Type::i64) {
        low = "-9223372036854775808";
        high = "9223372036854775807";
    }
    std::string type(label(point.type));
    if (point.scale != 1) type += ", scale " + number_text(point.scale);
    if (point.offset != 0) type += ", offset " + number_text(point.offset);
    return low + " to " + high + " (" + type + ')';
}

std::uint64_t bits_of(Type type, double raw) {
    if (type == Type::f32) return std::bit_cast<std::uint32_t>(static_cast<float>(raw));
    if (type == Type::f64) return std::bit_cast<std::uint64_t>(raw);
    if (type == Type::bcd16 || type == Type::bcd32)
        return to_bcd(static_cast<std::uint64_t>(std::llround(raw)));
    if (type == Type::u64) return static_cast<std::uint64_t>(std::round(raw));
    return static_cast<std::uint64_t>(std::llround(raw));
}

/// An integer that a 64-bit type takes as it is, without a detour over a double.
std::optional<std::uint64_t> exact_bits(const Point& point, const Value& value) {
    if (!is_plain(point)) return std::nullopt;
    const auto* i = std::get_if<std::int64_t>(&value);
    const auto* u = std::get_if<std::uint64_t>(&value);
    constexpr auto kMostSigned =
        static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (point.type == Type::i64 && i != nullptr) return static_cast<std::uint64_t>(*i);
    if (point.type == Type::i64 && u != nullptr && *u <= kMostSigned) return *u;
    if (point.type == Type::u64 && u != nullptr) return *u;
    if (point.type == Type::u64 && i != nullptr && *i >= 0) return static_cast<std::uint64_t>(*i);
    return std::nullopt;
}

Encoded<Words> encode_text(const Point& point, const std::string& text) {
    if (text.size() > point.length) {
        return refusal(point.name + " holds " + std::to_string(point.length) + " characters, not " +
                       std::to_string(text.size()));
    }
    if (text.find('\0') != text.npos)
        return refusal(point.name + " takes no text with a NUL: it would end there");
    return reordered(text_to_words(text, point.count()), point.word_order, true);
}

/// The raw value behind a label.
std::optional<std::int64_t> raw_of_label(const Point& point, const std::string& text) {
    for (const auto& [raw, name] : point.labels) {
        if (name == text) return raw;
    }
    return std::nullopt;
}

/// "; its labels are stopped, running"
std::string labels_of(const Point& point) {
    std::string list;
    for (const auto& [raw, name] : point.labels)
        list += (list.empty() ? "; its labels are " : ", ") + name;
    return list;
}

std::optional<WriteRefusal> judge_limits(const Point& point, double number, const Value& value) {
    const bool below = point.min && number < *point.min;
    const bool above = point.max && number > *point.max;
    if (!below && !above) return std::nullopt;
    std::string range = point.min ? "at least " + number_text(*point.min)
                                  : "at most " + number_text(point.max.value_or(0));
    if (point.min && point.max)
        range = "from " + number_text(*point.min) + " to " + number_text(*point.max);
    return refusal(point.name + " must be " + range + ", not " + to_string(value));
}

/// The raw value, rounded where the type is whole. `exact`: it is known and fits, a double may not
/// hold it.
Encoded<double> checked_raw(const Point& point, const Value& value, bool exact) {
    const double number = *number_of(value);
    if (!std::isfinite(number)) return refusal(point.name + " takes finite numbers only");
    if (auto refused = judge_limits(point, number, value)) return std::move(*refused);
    double raw = to_raw(point, number);
    if (is_integer(point.type)) raw = std::round(raw);
    const Limits limits = limits_of(point.type);
    if (!exact && !(raw >= limits.low && raw <= limits.high)) {
        return refusal(point.name + " must be from " + range_text(point) + ", not " +
                       to_string(value));
    }
    return raw;
}

Encoded<Words> encode_bit(const Point& point, const Value& value) {
    const double number = *number_of(value);
    if (number == 0 || number == 1) return Words{static_cast<std::uint16_t>(number)};
    return refusal(point.name + " takes true or false, not " + to_string(value));
}

Encoded<Words> encode_number(const Point& point, const Value& value) {
    const auto exact = exact_bits(point, value);
    const auto raw = checked_raw(point, value, exact.has_value());
    if (!raw) return raw.error();
    const std::uint64_t bits = exact ? *exact : bits_of(point.type, *raw);
    const bool is_bcd = point.type == Type::bcd16 || point.type == Type::bcd32;
    const bool none = is_integer(point.type) && !is_bcd ? means_none(point, bits)
                      : point.type == Type::f32
                          ? means_none(point, static_cast<double>(static_cast<float>(*raw)))
                          : means_none(point, *raw);
    if (none)
        return refusal(point.name + " cannot be " + to_string(value) + ": that means no value");
    return reordered(parted(bits, point.count()), point.word_order, false);
}

}  // namespace

void throw_exception_from_error(const WriteRefusal& refusal, const boost::source_location&) {
    throw std::invalid_argument(refusal.message);
}

std::optional<double> number_of(const Value& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? 1 : 0;
    if (const auto* i = std::get_if<std::int64_t>(&value)) return static_cast<double>(*i);
    if (const auto* u = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*u);
    if (const double* d = std::get_if<double>(&value)) return *d;
    return std::nullopt;
}

std::optional<Value> decode(const Point& point, std::span<const std::uint16_t> items) {
    if (items.size() < point.count()) return std::nullopt;
    if (modbus::is_bit_table(point.table)) return Value(items[0] != 0);
    if (point.bit) return Value((items[0] >> *point.bit & 1) != 0);
    const Words words =
        reordered(items.first(point.count()), point.word_order, point.type == Type::string);
    if (point.type == Type::string) return Value(text_of_words(words, point.length));
    const std::uint64_t bits = joined(words);
    if (point.type == Type::f32)
        return decode_float(point, std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    if (point.type == Type::f64) return decode_double(point, std::bit_cast<double>(bits));
    const auto raw = raw_of(point.type, bits);
    if (!raw || means_none(point, static_cast<std::uint64_t>(raw->number))) return std::nullopt;
    if (point.type == Type::boolean) return Value(raw->number != 0);
    if (!is_plain(point)) {
        return scaled(point, raw->is_unsigned ? static_cast<double>(raw->large)
                                              : static_cast<double>(raw->number));
    }
    if (raw->is_unsigned) return Value(raw->large);
    return Value(raw->number);
}

std::optional<std::string> label_of(const Point& point, std::span<const std::uint16_t> items) {
    if (point.labels.empty() || items.size() < point.count() || !is_integer(point.type))
        return std::nullopt;
    const auto raw =
        raw_of(point.type, joined(reordered(items.first(point.count()), point.word_order, false)));
    const auto found = raw ? point.labels.find(raw->number) : point.labels.end();
    if (found == point.labels.end()) return std::nullopt;
    return found->second;
}

Encoded<std::vector<std::uint16_t>> encode(const Point& point, const Value& value) {
    const auto* text = std::get_if<std::string>(&value);
    if (point.type == Type::string) {
        if (text == nullptr) return refusal(point.name + " takes a text");
        return encode_text(point, *text);
    }
    Value given = value;
    if (text != nullptr) {
        const auto raw = raw_of_label(point, *text);
        if (!raw) return refusal(point.name + " has no label '" + *text + '\'' + labels_of(point));
        given = *raw;  // raw, so it has to become a value first where there is a scale
        if (!is_plain(point)) given = from_raw(point, static_cast<double>(*raw));
    }
    if (point.type == Type::boolean) return encode_bit(point, given);
    if (std::holds_alternative<bool>(given))
        return refusal(point.name + " takes a number, not " + to_string(given));
    return encode_number(point, given);
}

std::string to_string(const Value& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
    if (const auto* i = std::get_if<std::int64_t>(&value)) return std::to_string(*i);
    if (const auto* u = std::get_if<std::uint64_t>(&value)) return std::to_string(*u);
    if (const double* d = std::get_if<double>(&value)) return number_text(*d);
    return std::get<std::string>(value);
}

}  // namespace panelgate::points
