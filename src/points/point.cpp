#include "panelgate/points/point.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>

#include "panelgate/base/text.hpp"
#include "registers.hpp"

namespace panelgate::points {

namespace {

/// Raw number of an integer type: signed types are sign-extended; u64 above int64 goes to `large`.
struct Raw {
    bool is_unsigned = false;
    std::int64_t number = 0;
    std::uint64_t large = 0;  ///< for u64
};

std::optional<Raw> raw_of(Type type, std::uint64_t bits) {
    switch (type) {
        case Type::boolean:
        case Type::u8l:
            return Raw{false, static_cast<std::uint8_t>(bits), 0};
        case Type::i8l:
            return Raw{false, static_cast<std::int8_t>(bits), 0};
        case Type::u8h:
            return raw_of(Type::u8l, bits >> 8);
        case Type::i8h:
            return raw_of(Type::i8l, bits >> 8);
        case Type::u16:
        case Type::u32:
        case Type::u48:
            return Raw{false, static_cast<std::int64_t>(bits), 0};
        case Type::i48:
            return Raw{false, static_cast<std::int64_t>(bits << 16) >> 16, 0};
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
        case Type::f16:
        case Type::f32:
        case Type::f64:
        case Type::string:
            break;
    }
    std::abort();
}

std::optional<Value> scaled(const Point& point, double raw) {
    const double value = from_raw(point, raw);
    if (!std::isfinite(value)) return std::nullopt;
    return Value(value);
}

/// Returns a double if it holds all the digits.
Value plain_value_of(const Decimal& value) {
    const double number = value.nearest();
    const bool is_small = std::abs(number) < 1e15;
    if (is_small && Decimal(number) == value) return number;
    if (const auto i = value.as_int64()) return *i;
    if (const auto u = value.as_uint64()) return *u;
    return value;
}

std::optional<Value> decode_double(const Point& point, double raw) {
    if (is_no_value(point, raw)) return std::nullopt;
    return scaled(point, raw);
}

/// Uses the shortest digits, 0.1: widened to a double it would be 0.10000000149011612.
std::optional<Value> decode_float(const Point& point, float raw) {
    if (is_no_value(point, static_cast<double>(raw))) return std::nullopt;
    return scaled(point, as_printed(raw));
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
    if (const auto* decimal = std::get_if<Decimal>(&value)) return decimal->nearest();
    return std::nullopt;
}

std::optional<Value> decode(const Point& point, std::span<const std::uint16_t> items) {
    if (items.size() < point.count()) return std::nullopt;
    if (modbus::is_bit_table(point.table)) return Value(items[0] != 0);
    if (point.bit) return Value((items[0] >> *point.bit & 1) != 0);
    const Words words =
        reordered(items.first(point.count()), point.word_order, point.type == Type::string);
    if (point.type == Type::string) return Value(text_of_words(words, point.length));
    const std::uint64_t bits = join_words(words);
    if (point.type == Type::f16)
        return decode_float(point, from_half(static_cast<std::uint16_t>(bits)));
    if (point.type == Type::f32)
        return decode_float(point, std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    if (point.type == Type::f64) return decode_double(point, std::bit_cast<double>(bits));
    const auto raw = raw_of(point.type, bits);
    if (!raw || is_no_value(point, static_cast<std::uint64_t>(raw->number))) return std::nullopt;
    if (point.type == Type::boolean) return Value(raw->number != 0);
    if (is_plain(point)) return raw->is_unsigned ? Value(raw->large) : Value(raw->number);
    if (registers_of(point.type) < 4) return scaled(point, static_cast<double>(raw->number));
    const Decimal number = raw->is_unsigned ? Decimal(raw->large) : Decimal(raw->number);
    return plain_value_of(Scaling(point.scale, point.offset).value_of(number));
}

std::optional<std::string> label_of(const Point& point, std::span<const std::uint16_t> items) {
    if (point.labels.empty() || items.size() < point.count() || !is_integer(point.type))
        return std::nullopt;
    const auto raw = raw_of(
        point.type, join_words(reordered(items.first(point.count()), point.word_order, false)));
    const auto found = raw ? point.labels.find(raw->number) : point.labels.end();
    if (found == point.labels.end()) return std::nullopt;
    return found->second;
}

std::string to_string(const Value& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
    if (const auto* i = std::get_if<std::int64_t>(&value)) return std::to_string(*i);
    if (const auto* u = std::get_if<std::uint64_t>(&value)) return std::to_string(*u);
    if (const double* d = std::get_if<double>(&value)) return number_text(*d);
    if (const auto* decimal = std::get_if<Decimal>(&value)) return decimal->text();
    return std::get<std::string>(value);
}

namespace {

/// A row for each Type.
struct TypeRow {
    std::string_view word;
    unsigned bits;
};
constexpr std::array<TypeRow, std::size(kTypes)> kTypeRows{{{"bool", 16},
                                                            {"u8h", 8},
                                                            {"u8l", 8},
                                                            {"i8h", 8},
                                                            {"i8l", 8},
                                                            {"u16", 16},
                                                            {"i16", 16},
                                                            {"u32", 32},
                                                            {"i32", 32},
                                                            {"u48", 48},
                                                            {"i48", 48},
                                                            {"u64", 64},
                                                            {"i64", 64},
                                                            {"f16", 16},
                                                            {"f32", 32},
                                                            {"f64", 64},
                                                            {"bcd16", 16},
                                                            {"bcd32", 32},
                                                            {"string", 16}}};
constexpr std::array<std::string_view, std::size(kOrders)> kOrderWords{"ABCD", "BADC", "CDAB",
                                                                       "DCBA"};

}  // namespace

std::string_view label(Type type) { return kTypeRows.at(static_cast<std::size_t>(type)).word; }

unsigned bits_of(Type type) { return kTypeRows.at(static_cast<std::size_t>(type)).bits; }

unsigned registers_of(Type type) { return (bits_of(type) + 15) / 16; }

std::string_view label(WordOrder order) { return kOrderWords.at(static_cast<std::size_t>(order)); }

unsigned Point::count() const {
    if (modbus::is_bit_table(table)) return 1;
    return type == Type::string ? (length + 1) / 2 : registers_of(type);
}

}  // namespace panelgate::points
