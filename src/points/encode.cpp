#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>

#include "compare.hpp"
#include "panelgate/base/number_text.hpp"
#include "panelgate/points/value.hpp"
#include "registers.hpp"
#include "scaling.hpp"
#include "text.hpp"

namespace panelgate::points {
namespace {

WriteRefusal refusal(std::string message) { return {.message = std::move(message)}; }

constexpr double kExactDouble = 9007199254740992.0;  ///< 2^53

struct Limits {
    double low = 0;
    double high = 0;
};

/// Of the raw number.
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
            return {as_printed(std::numeric_limits<float>::lowest()),
                    as_printed(std::numeric_limits<float>::max())};
        case Type::f64:
        case Type::string:
            return {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
    }
    std::abort();
}

/// "u16, scale 0.1"
std::string type_text(const Point& point) {
    std::string type(label(point.type));
    if (point.scale != 1) type += ", scale " + number_text(point.scale);
    if (point.offset != 0) type += ", offset " + number_text(point.offset);
    return type;
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
    return low + " to " + high + " (" + type_text(point) + ')';
}

bool within_limits(const Point& point, const Value& value) {
    return !(point.min && is_below(value, *point.min)) &&
           !(point.max && is_above(value, *point.max));
}

/// "x must be at most 25"
std::string limits_text(const Point& point) {
    std::string range = point.min ? "at least " + number_text(*point.min)
                                  : "at most " + number_text(point.max.value_or(0));
    if (point.min && point.max)
        range = "from " + number_text(*point.min) + " to " + number_text(*point.max);
    return point.name + " must be " + range;
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

/// The raw number nearest to this, which is within the type's range.
std::uint64_t nearest_bits(Type type, double raw) {
    if (type == Type::u64) return static_cast<std::uint64_t>(std::round(raw));
    return static_cast<std::uint64_t>(std::llround(raw));
}

/// The raw number whose value is exactly this; nothing when there is none.
std::optional<std::uint64_t> exact_raw(const Point& point, const Value& value, double raw) {
    if (auto bits = exact_bits(point, value)) return bits;
    if (is_plain(point)) {
        // Beyond 2^53 a double is whole whatever was meant.
        const bool is_whole = raw == std::floor(raw) && std::abs(raw) <= kExactDouble;
        return is_whole ? std::optional(nearest_bits(point.type, raw)) : std::nullopt;
    }
    const Scaling scaling(point.scale, point.offset);
    std::optional<std::int64_t> exact;
    if (const auto* i = std::get_if<std::int64_t>(&value)) {
        exact = scaling.exact_raw_of(*i);
    } else if (const auto* u = std::get_if<std::uint64_t>(&value)) {
        exact = scaling.exact_raw_of(*u);
    } else {
        exact = scaling.exact_raw_of(*number_of(value));
    }
    if (exact) return static_cast<std::uint64_t>(*exact);
    return std::nullopt;
}

/// "; the nearest that it can be are 21.5 and 21.6": of those that its limits allow.
std::string neighbours_text(const Point& point, double below, double above) {
    if (below > above) std::swap(below, above);
    std::string list;
    int count = 0;
    for (const double one : {below, above}) {
        if (!within_limits(point, one) || (count > 0 && below == above)) continue;
        list += (count++ > 0 ? " and " : "") + number_text(one);
    }
    if (count == 0) return {};
    return std::string("; the nearest that it can be ") + (count > 1 ? "are " : "is ") + list;
}

WriteRefusal inexact(const Point& point, const Value& value, double below, double above) {
    return {.message = point.name + " cannot be exactly " + to_string(value) + " (" +
                       type_text(point) + ')' + neighbours_text(point, below, above),
            .inexact = true};
}

WriteRefusal inexact_whole(const Point& point, const Value& value, double raw) {
    const Limits limits = limits_of(point.type);
    if (std::abs(raw) > kExactDouble)
        return {.message = point.name +
                           " takes no fraction here: with so many digits it is not exact (" +
                           type_text(point) + ')',
                .inexact = true};
    return inexact(point, value, from_raw(point, std::max(std::floor(raw), limits.low)),
                   from_raw(point, std::min(std::ceil(raw), limits.high)));
}

/// What everybody is refused: not a number, outside what the configuration allows, outside the
/// type.
std::optional<WriteRefusal> judge_given(const Point& point, const Value& value, double raw) {
    if (!std::isfinite(*number_of(value)))
        return refusal(point.name + " takes finite numbers only");
    if (!within_limits(point, value))
        return refusal(limits_text(point) + ", not " + to_string(value));
    const Limits limits = limits_of(point.type);
    if (exact_bits(point, value) || (raw >= limits.low && raw <= limits.high)) return std::nullopt;
    return refusal(point.name + " must be from " + range_text(point) + ", not " + to_string(value));
}

/// The same of what it is rounded to.
Encoded<Words> judge_written(const Point& point, const Value& value, Words words) {
    const auto written = decode(point, words);
    if (!written)
        return refusal(point.name + " cannot be " + to_string(value) + ": that means no value");
    if (!within_limits(point, *written))
        return refusal(limits_text(point) + "; " + to_string(value) + " would be written as " +
                       to_string(*written));
    return words;
}

Encoded<Words> encode_whole(const Point& point, const Value& value, Rounding rounding) {
    const double raw = Scaling(point.scale, point.offset).raw_of(*number_of(value));
    if (auto refused = judge_given(point, value, std::round(raw))) return std::move(*refused);
    auto number = exact_raw(point, value, raw);
    if (!number && rounding == Rounding::exact) return inexact_whole(point, value, raw);
    if (!number) number = nearest_bits(point.type, std::round(raw));
    const std::uint64_t bits = is_bcd(point.type) ? to_bcd(*number) : *number;
    return judge_written(point, value,
                         reordered(parted(bits, point.count()), point.word_order, false));
}

/// Of a number that a float is to hold, too: the float nearest to it, for nobody means the last bit
/// of a fraction; but a whole number is meant exactly, and what is not 0 must not become 0 or lose
/// most of its digits.
template <class Float>
bool is_held(const Point& point, const Value& value, double raw, Float number) {
    if (!is_plain(point)) return true;
    const auto held = static_cast<double>(number);
    if (is_same(value, held) || is_printed_as(value, number)) return true;
    if (raw == std::floor(raw)) return false;
    return std::abs(held) >= static_cast<double>(std::numeric_limits<Float>::min());
}

/// The float that is nearest on the other side of the value.
template <class Float>
Float beyond(const Value& value, Float number) {
    constexpr Float kMost = std::numeric_limits<Float>::max();
    return std::nextafter(number, is_below(value, static_cast<double>(number)) ? -kMost : kMost);
}

Encoded<Words> encode_f32(const Point& point, const Value& value, double raw, Rounding rounding) {
    constexpr float kMost = std::numeric_limits<float>::max();
    const float number = std::abs(raw) > static_cast<double>(kMost)
                             ? std::copysign(kMost, static_cast<float>(raw < 0 ? -1 : 1))
                             : static_cast<float>(raw);
    if (rounding == Rounding::exact && !is_held(point, value, raw, number))
        return inexact(point, value, as_printed(number), as_printed(beyond(value, number)));
    const auto bits = std::bit_cast<std::uint32_t>(number);
    return judge_written(point, value, reordered(parted(bits, 2), point.word_order, false));
}

Encoded<Words> encode_number(const Point& point, const Value& value, Rounding rounding) {
    if (is_integer(point.type)) return encode_whole(point, value, rounding);
    const double raw = Scaling(point.scale, point.offset).raw_of(*number_of(value));
    if (auto refused = judge_given(point, value, raw)) return std::move(*refused);
    if (point.type == Type::f32) return encode_f32(point, value, raw, rounding);
    if (rounding == Rounding::exact && !is_held(point, value, raw, raw))
        return inexact(point, value, raw, beyond(value, raw));
    const auto bits = std::bit_cast<std::uint64_t>(raw);
    return judge_written(point, value, reordered(parted(bits, 4), point.word_order, false));
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

/// A text that is none of the point's labels.
WriteRefusal no_label(const Point& point, const std::string& text) {
    if (is_no_number(text))
        return {.message = point.name + " takes finite numbers only, not '" + text + '\'',
                .malformed = true};
    if (!point.labels.empty())
        return refusal(point.name + " has no label '" + text + '\'' + labels_of(point));
    const char* const wanted = point.type == Type::boolean ? " takes true or false, not the text '"
                                                           : " takes a number, not the text '";
    return refusal(point.name + wanted + text + '\'');
}

Encoded<Words> encode_bit(const Point& point, const Value& value) {
    const double number = *number_of(value);
    if (number == 0 || number == 1) return Words{static_cast<std::uint16_t>(number)};
    return refusal(point.name + " takes true or false, not " + to_string(value));
}

}  // namespace

Encoded<std::vector<std::uint16_t>> encode(const Point& point, const Value& value,
                                           Rounding rounding) {
    const auto* text = std::get_if<std::string>(&value);
    if (point.type == Type::string) {
        if (text == nullptr) return refusal(point.name + " takes a text");
        return encode_text(point, *text);
    }
    Value given = value;
    if (text != nullptr) {
        const auto raw = raw_of_label(point, *text);
        if (!raw) return no_label(point, *text);
        given = *raw;  // raw, so it has to become a value first where there is a scale
        if (!is_plain(point)) given = from_raw(point, static_cast<double>(*raw));
    }
    if (point.type == Type::boolean) return encode_bit(point, given);
    if (std::holds_alternative<bool>(given))
        return refusal(point.name + " takes a number, not " + to_string(given));
    return encode_number(point, given, rounding);
}

}  // namespace panelgate::points
