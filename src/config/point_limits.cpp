#include "point_limits.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::config {

namespace {

using points::Point;
using points::Type;

void warn_of_limits(Loading& loading, yaml::MapReader& in, const Point& point) {
    if (point.writable || (!point.min && !point.max)) return;
    const std::string key = point.min ? "min" : "max";
    const std::string keys = point.min && point.max ? "min and max" : key;
    loading.warn(in.mark(key), keys + (keys == key ? " has" : " have") +
                                   " no effect: what is written is limited, and the point is not "
                                   "writable; add writable: true, or leave " +
                                   keys + " out");
}

/// CDAB only swaps words; strings keep their order.
void warn_of_order(Loading& loading, yaml::MapReader& in, const Point& point) {
    const bool turns = points::registers_of(point.type) > 1 && point.type != Type::string;
    if (point.type == Type::boolean || turns || point.word_order != points::WordOrder::cdab) return;
    const std::string why = point.type == Type::string
                                ? "a string keeps the order of its words"
                                : std::string(label(point.type)) + " is one word";
    loading.warn(in.mark("word_order"), "word_order: CDAB has no effect: " + why +
                                            "; leave it out, or write BADC to turn the bytes of "
                                            "each word");
}

}  // namespace

void warn_of_unused_keys(Loading& loading, yaml::MapReader& in, const Point& point) {
    warn_of_limits(loading, in, point);
    warn_of_order(loading, in, point);
}

namespace {

RawRange signed_range(unsigned bits) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    const std::int64_t high = bits >= 64 ? kMost : (std::int64_t{1} << (bits - 1)) - 1;
    return {-high - 1, high};
}

RawRange unsigned_range(unsigned bits) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    return {0, bits >= 63 ? kMost : (std::int64_t{1} << bits) - 1};
}

/// The range of the scaled value.
struct ValueRange {
    double low = 0;
    double high = 0;
    bool contains(double value) const { return value >= low && value <= high; }
    std::string text() const { return shown(low) + " to " + shown(high); }

    /// Formats 3276.7, though 32767 * 0.1 is a little more.
    static std::string shown(double value) {
        std::array<char, 32> digits{};
        const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                                std::chars_format::general, 15);
        double rounded = value;
        if (error == std::errc()) std::from_chars(digits.data(), end, rounded);
        return number_text(rounded);
    }
};

ValueRange value_range(const Point& point) {
    const auto value = [&](double raw) { return raw * point.scale + point.offset; };
    double low = 0;
    double high = 0;
    if (point.type == Type::f64) {
        high = std::numeric_limits<double>::max();
        low = -high;
        return {low, high};
    }
    if (point.type == Type::f32) {
        high = as_printed(std::numeric_limits<float>::max());
        low = -high;
    } else {
        const RawRange range = label_range(point.type);
        low = static_cast<double>(range.low);
        // A RawRange has signed 64 bits, which cannot hold all of a u64.
        high = point.type == Type::u64 ? 0x1p64 : static_cast<double>(range.high);
    }
    const auto [least, most] = std::minmax({value(low), value(high)});
    return {least, most};
}

/// With all the digits as written.
std::optional<Decimal> limit_of(yaml::MapReader& in, std::string_view key) {
    const auto number = in.number(key);
    if (!number) return std::nullopt;
    const yaml::Node* written = in.child(key);
    return written != nullptr ? Decimal::parse(written->scalar).value_or(*number) : *number;
}

void check_limit(yaml::MapReader& in, std::string_view key, const Point& point,
                 std::optional<Decimal>& limit) {
    const ValueRange range = value_range(point);
    // Tolerates rounding: 6553.5 is 65535 * 0.1, whatever its last bit.
    const double slack = std::max(std::abs(range.low), std::abs(range.high)) * 1e-12;
    if (!limit || ValueRange{range.low - slack, range.high + slack}.contains(limit->nearest()))
        return;
    std::string type(label(point.type));
    if (point.scale != 1) type += " with scale " + number_text(point.scale);
    if (point.offset != 0)
        type += (point.scale != 1 ? " and offset " : " with offset ") + number_text(point.offset);
    in.problem(key, std::string(key) + " must be a value that the point can have, " + range.text() +
                        " (" + type + "), not " + limit->text());
    limit.reset();
}

/// True if a whole raw number is between them: with scale 10, 0 and 10 are, but none of 1 to 9.
bool has_value_between(const Point& point, double min, double max) {
    const auto raw = [&](double value) { return (value - point.offset) / point.scale; };
    const auto [low, high] = std::minmax({raw(min), raw(max)});
    const double slack = std::max({1.0, std::abs(low), std::abs(high)}) * 1e-9;
    return std::ceil(low - slack) <= std::floor(high + slack);
}

}  // namespace

RawRange label_range(Type type) {
    switch (type) {
        case Type::bcd16:
            return {0, 9'999};
        case Type::bcd32:
            return {0, 99'999'999};
        case Type::i16:
        case Type::i32:
        case Type::i64:
            return signed_range(16 * points::registers_of(type));
        case Type::u16:
        case Type::u32:
        case Type::u64:
            return unsigned_range(16 * points::registers_of(type));
        case Type::boolean:
        case Type::f32:
        case Type::f64:
        case Type::string:
            return signed_range(64);
    }
    std::abort();
}

RawRange no_value_range(Type type) {
    RawRange range = label_range(type);
    const bool is_bcd = type == Type::bcd16 || type == Type::bcd32;
    if (!is_integer(type) || is_bcd) return range;
    range.low = signed_range(16 * points::registers_of(type)).low;
    range.high = unsigned_range(16 * points::registers_of(type)).high;
    return range;
}

void load_limits(yaml::MapReader& in, Point& point) {
    point.min = limit_of(in, "min");
    point.max = limit_of(in, "max");
    if (point.min && point.max && *point.min > *point.max)
        in.problem("min", "min is above max: nothing could be written");
    if (point.type == Type::boolean || point.type == Type::string) return;
    check_limit(in, "min", point, point.min);
    check_limit(in, "max", point, point.max);
    if (is_integer(point.type) && point.min && point.max && *point.min <= *point.max &&
        !has_value_between(point, point.min->nearest(), point.max->nearest()))
        in.problem("min", "the point has no value from " + point.min->text() + " to " +
                              point.max->text() + " (scale " + number_text(point.scale) +
                              "): nothing could be written");
}

}  // namespace panelgate::config
