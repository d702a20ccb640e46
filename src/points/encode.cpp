#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/point.hpp"
#include "registers.hpp"

namespace panelgate::points {

namespace {

WriteRefusal refusal(std::string message) { return {.message = std::move(message)}; }

struct Limits {
    Decimal low;
    Decimal high;
};

/// `value` is a finite number.
Decimal decimal_of(const Value& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? 1 : 0;
    if (const auto* i = std::get_if<std::int64_t>(&value)) return *i;
    if (const auto* u = std::get_if<std::uint64_t>(&value)) return *u;
    if (const double* d = std::get_if<double>(&value)) return *d;
    return std::get<Decimal>(value);
}

template <class Number>
Limits limits_of() {
    return {Decimal(std::numeric_limits<Number>::lowest()),
            Decimal(std::numeric_limits<Number>::max())};
}

/// Range of the raw number.
Limits limits_of(Type type) {
    if (type == Type::boolean) return {0, 1};
    if (type == Type::u64) return limits_of<std::uint64_t>();
    if (type == Type::i64) return limits_of<std::int64_t>();
    if (type == Type::bcd16) return {0, 9999};
    if (type == Type::bcd32) return {0, 99999999};
    if (type == Type::f16) return {-65504, 65504};
    if (type == Type::f32)
        return {as_printed(std::numeric_limits<float>::lowest()),
                as_printed(std::numeric_limits<float>::max())};
    if (!is_integer(type)) return limits_of<double>();
    const std::int64_t half = std::int64_t{1} << (bits_of(type) - 1);
    if (is_signed(type)) return {-half, half - 1};
    return {0, 2 * half - 1};
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
    const Scaling scaling(point.scale, point.offset);
    std::string low = scaling.value_of(limits.low).text();
    std::string high = scaling.value_of(limits.high).text();
    if (point.scale < 0) std::swap(low, high);
    return low + " to " + high + " (" + type_text(point) + ')';
}

bool within_limits(const Point& point, const Value& value) {
    const Decimal number = decimal_of(value);
    return !(point.min && number < *point.min) && !(point.max && number > *point.max);
}

bool within_type(Type type, const Decimal& raw) {
    const Limits limits = limits_of(type);
    return raw >= limits.low && raw <= limits.high;
}

/// "x must be at most 25"
std::string limits_text(const Point& point) {
    std::string range = point.min ? "at least " + point.min->text()
                                  : "at most " + point.max.value_or(Decimal()).text();
    if (point.min && point.max) range = "from " + point.min->text() + " to " + point.max->text();
    return point.name + " must be " + range;
}

WriteRefusal beyond_limits(const Point& point, const Value& value) {
    return refusal(limits_text(point) + ", not " + to_string(value));
}

/// The raw number is outside the type's range.
WriteRefusal beyond_type(const Point& point, const Value& value) {
    if (!within_limits(point, value)) return beyond_limits(point, value);
    return refusal(point.name + " must be from " + range_text(point) + ", not " + to_string(value));
}

/// The nearest values on both sides, or the nearest float and the next one.
struct Neighbours {
    std::optional<Value> one;
    std::optional<Value> other;
};

/// "x cannot be exactly 21.55 (i16, scale 0.1); the nearest that it can be are 21.5 and 21.6":
/// names only values within the point's limits.
WriteRefusal inexact(const Point& point, const Value& value, Neighbours nearest) {
    auto& [one, other] = nearest;
    if (one && other && decimal_of(*one) > decimal_of(*other)) std::swap(one, other);
    if (one == other) other.reset();
    std::string list;
    int count = 0;
    for (const auto& neighbour : {one, other}) {
        if (!neighbour || !within_limits(point, *neighbour)) continue;
        list += (count++ > 0 ? " and " : "") + to_string(*neighbour);
    }
    if (count > 0)
        list = std::string("; the nearest that it can be ") + (count > 1 ? "are " : "is ") + list;
    return {.message = point.name + " cannot be exactly " + to_string(value) + " (" +
                       type_text(point) + ')' + list,
            .inexact = true};
}

/// Checks the value as it would be written, also after rounding.
Encoded<Words> check_written(const Point& point, const Value& value, Words words) {
    const auto written = decode(point, words);
    if (!written)
        return refusal(point.name + " cannot be " + to_string(value) + ": that means no value");
    if (within_limits(point, *written)) return words;
    if (!within_limits(point, value)) return beyond_limits(point, value);
    return refusal(limits_text(point) + "; " + to_string(value) + " would be written as " +
                   to_string(*written));
}

/// Returns the bits of a register that a byte has.
std::uint64_t byte_mask(Type type) {
    return type == Type::u8h || type == Type::i8h ? 0xFF00 : 0x00FF;
}

/// `raw` is within the type's range. The other half of a byte's register is 0.
Words words_of(const Point& point, const Decimal& raw) {
    const auto i = raw.as_int64();
    std::uint64_t bits = i ? static_cast<std::uint64_t>(*i) : raw.as_uint64().value_or(0);
    if (is_byte(point.type)) bits = (bits << 8 | (bits & 0xFF)) & byte_mask(point.type);
    return reordered(split_words(is_bcd(point.type) ? to_bcd(bits) : bits, point.count()),
                     point.word_order, false);
}

/// Returns the value of a raw number, if it may be written.
std::optional<Value> allowed(const Point& point, const Decimal& raw) {
    if (!within_type(point.type, raw)) return std::nullopt;
    auto value = decode(point, words_of(point, raw));
    if (value && !within_limits(point, *value)) value.reset();
    return value;
}

Encoded<Words> encode_whole(const Point& point, const Value& value, Rounding rounding) {
    const Scaling scaling(point.scale, point.offset);
    const Decimal given = decimal_of(value);
    const auto around = scaling.around(given);
    const auto exact = scaling.exact_raw_of(given);
    Decimal raw = exact.value_or(around.nearest);
    if (!within_type(point.type, raw)) return beyond_type(point, value);
    if (!exact && !allowed(point, raw) && within_limits(point, value)) {
        const Decimal& other = raw == around.below ? around.above : around.below;
        if (allowed(point, other)) raw = other;
    }
    if (!exact && rounding == Rounding::exact && allowed(point, raw))
        return inexact(point, value, {allowed(point, around.below), allowed(point, around.above)});
    return check_written(point, value, words_of(point, raw));
}

Decimal as_shown(float number) { return as_printed(number); }
Decimal as_shown(double number) { return number; }

/// True if `number`, the nearest float, may stand for the value. Fractions need not be exact to the
/// last bit. Integers must be, and fractions where floats have none (from `whole` on); a value
/// other than 0 must not become 0 or lose most of its digits (below `normal`).
template <class Float>
bool float_holds(const Point& point, const Value& value, Float number,
                 Float normal = std::numeric_limits<Float>::min(),
                 Float whole = 1 / std::numeric_limits<Float>::epsilon()) {
    if (!is_plain(point)) return true;
    const Decimal given = decimal_of(value);
    const auto held = static_cast<double>(number);
    if (given == Decimal::exactly(held) || given == as_shown(number)) return true;
    const Float size = std::abs(number);
    return !given.is_whole() && size >= normal && size < whole;
}

/// Names this float and the next one on the other side of the value.
template <class Float>
WriteRefusal inexact_float(const Point& point, const Value& value, Float number) {
    constexpr Float kMost = std::numeric_limits<Float>::max();
    const bool is_below = decimal_of(value) < Decimal::exactly(static_cast<double>(number));
    const Float next = std::nextafter(number, is_below ? -kMost : kMost);
    return inexact(point, value, {as_shown(number).nearest(), as_shown(next).nearest()});
}

Encoded<Words> encode_f32(const Point& point, const Value& value, double raw, Rounding rounding) {
    constexpr float kMost = std::numeric_limits<float>::max();
    const float number = std::abs(raw) > static_cast<double>(kMost)
                             ? std::copysign(kMost, static_cast<float>(raw < 0 ? -1 : 1))
                             : static_cast<float>(raw);
    if (rounding == Rounding::exact && !float_holds(point, value, number))
        return inexact_float(point, value, number);
    const auto bits = std::bit_cast<std::uint32_t>(number);
    return check_written(point, value, reordered(split_words(bits, 2), point.word_order, false));
}

Encoded<Words> encode_f16(const Point& point, const Value& value, double raw, Rounding rounding) {
    const std::uint16_t bits = to_half(raw);
    const float number = from_half(bits);
    constexpr float kNormal = 1.0F / (1 << 14);
    constexpr float kWhole = 1 << 10;
    if (rounding == Rounding::exact && !float_holds(point, value, number, kNormal, kWhole))
        return inexact(point, value, {as_shown(number).nearest(), {}});
    return check_written(point, value, reordered(Words{bits}, point.word_order, false));
}

Encoded<Words> encode_number(const Point& point, const Value& value, Rounding rounding) {
    const double number = *number_of(value);
    if (!std::isfinite(number)) return refusal(point.name + " takes finite numbers only");
    if (is_integer(point.type)) return encode_whole(point, value, rounding);
    const double raw = Scaling(point.scale, point.offset).raw_of(number);
    if (!std::isfinite(raw) || !within_type(point.type, raw)) return beyond_type(point, value);
    if (rounding == Rounding::exact && !within_limits(point, value))
        return beyond_limits(point, value);
    if (point.type == Type::f16) return encode_f16(point, value, raw, rounding);
    if (point.type == Type::f32) return encode_f32(point, value, raw, rounding);
    if (rounding == Rounding::exact && !float_holds(point, value, raw))
        return inexact_float(point, value, raw);
    const auto bits = std::bit_cast<std::uint64_t>(raw);
    return check_written(point, value, reordered(split_words(bits, 4), point.word_order, false));
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

/// Returns the raw value of a label.
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

/// The text is not one of the point's labels.
WriteRefusal unknown_label(const Point& point, const std::string& text) {
    if (is_non_finite(text))
        return {.message = point.name + " takes finite numbers only, not '" + text + '\'',
                .malformed = true};
    if (!point.labels.empty())
        return refusal(point.name + " has no label '" + text + '\'' + labels_of(point));
    const char* const wanted = point.type == Type::boolean ? " takes true or false, not the text '"
                                                           : " takes a number, not the text '";
    return refusal(point.name + wanted + text + '\'');
}

Encoded<Words> encode_bit(const Point& point, const Value& value) {
    const bool is_finite = std::isfinite(*number_of(value));
    if (is_finite && decimal_of(value) == 0) return Words{0};
    if (is_finite && decimal_of(value) == 1) return Words{1};
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
        if (!raw) return unknown_label(point, *text);
        given = *raw;  // a raw number: scaled to a value first if the point has a scale
        if (!is_plain(point)) given = Scaling(point.scale, point.offset).value_of(Decimal(*raw));
    }
    if (point.type == Type::boolean) return encode_bit(point, given);
    if (std::holds_alternative<bool>(given))
        return refusal(point.name + " takes a number, not " + to_string(given));
    return encode_number(point, given, rounding);
}

namespace {

bool writes_coils(const profile::PanelProfile& profile) {
    return profile.has_function(modbus::kWriteSingleCoil) ||
           profile.has_function(modbus::kWriteMultipleCoils);
}

/// Requires one of the two functions.
Bytes write_coil(const profile::PanelProfile& profile, std::uint16_t address, bool on) {
    if (profile.has_function(modbus::kWriteSingleCoil))
        return modbus::encode_write_coil(address, on);
    return modbus::encode_write_coils(address, {on});
}

/// Returns the panel's bit view of this word if it is writable (Autonics UB over UW).
const profile::Area* bit_view(const profile::PanelProfile& profile, const Point& point) {
    const profile::Area* words = profile.find_area(point.table, point.address);
    if (words == nullptr) return nullptr;
    const std::uint32_t bit = point.address * 16u + *point.bit;
    for (const profile::Area& area : profile.areas) {
        if (area.view_of == words->name && area.table == modbus::Table::coils && area.writable &&
            area.writable->contains(bit) && writes_coils(profile)) {
            return &area;
        }
    }
    return nullptr;
}

/// Writes the bits of `mask`, and leaves the others of the register.
Bytes write_part(std::uint16_t address, unsigned mask, unsigned bits) {
    return Writer()
        .u8(modbus::kMaskWriteRegister)
        .u16(address)
        .u16(~mask & 0xFFFFu)
        .u16(bits)
        .take();
}

/// Requires one of the two ways.
Bytes write_bit(const profile::PanelProfile& profile, const Point& point, bool on) {
    if (bit_view(profile, point) != nullptr) {
        const auto coil = static_cast<std::uint16_t>(point.address * 16u + *point.bit);
        return write_coil(profile, coil, on);
    }
    const unsigned mask = 1u << *point.bit;
    return write_part(point.address, mask, on ? mask : 0);
}

std::optional<std::string> why_no_part(const profile::PanelProfile& profile, const Point& point) {
    if (point.bit && bit_view(profile, point) != nullptr) return std::nullopt;
    if (profile.has_function(modbus::kMaskWriteRegister)) return std::nullopt;
    return profile.name + " can write no single " +
           (point.bit ? "bit of " + point.at + ": it has neither function 22 nor a bit view of it"
                      : "byte of " + point.at + ": it has no function 22") +
           ", and reading, changing and writing the word would undo what changes in between";
}

std::optional<std::string> why_no_registers(const profile::PanelProfile& profile, unsigned count) {
    if (count == 1 && profile.has_function(modbus::kWriteSingleRegister)) return std::nullopt;
    const bool several = profile.has_function(modbus::kWriteMultipleRegisters);
    const unsigned most = several ? profile.max_count(modbus::kWriteMultipleRegisters) : 0;
    if (count <= most) return std::nullopt;
    if (several)
        return profile.name + " takes at most " + std::to_string(most) +
               " registers in one write, not " + std::to_string(count);
    return profile.name + " has no function that writes " + std::to_string(count) +
           (count == 1 ? " register" : " registers at once");
}

Bytes pdu_of(const profile::PanelProfile& profile, const Point& point,
             const std::vector<std::uint16_t>& items) {
    if (point.table == modbus::Table::coils)
        return write_coil(profile, point.address, items.front() != 0);
    if (point.bit) return write_bit(profile, point, items.front() != 0);
    if (is_byte(point.type)) {
        const auto mask = static_cast<std::uint16_t>(byte_mask(point.type));
        return write_part(point.address, reordered(Words{mask}, point.word_order, false).front(),
                          items.front());
    }
    if (items.size() == 1 && profile.has_function(modbus::kWriteSingleRegister))
        return modbus::encode_write_register(point.address, items.front());
    return modbus::encode_write_registers(point.address, items);
}

/// Returns the value that a read of these items will give.
Value written_value(const Point& point, const std::vector<std::uint16_t>& items) {
    if (point.type == Type::boolean) return items.front() != 0;
    return *decode(point, items);
}

}  // namespace

std::optional<std::string> why_unwritable(const profile::PanelProfile& profile,
                                          const Point& point) {
    if (point.table == modbus::Table::coils) {
        if (writes_coils(profile)) return std::nullopt;
        return profile.name + " has no function that writes coils";
    }
    if (point.table != modbus::Table::holding_registers)
        return point.at + " is in a table that cannot be written";
    if (point.bit || is_byte(point.type)) return why_no_part(profile, point);
    return why_no_registers(profile, point.count());
}

Encoded<PointWrite> write_request(const profile::PanelProfile& profile, const Point& point,
                                  const Value& value, Rounding rounding) {
    if (!point.writable) return refusal(point.name + " is not writable");
    if (auto why = why_unwritable(profile, point)) return refusal(std::move(*why));
    const auto items = encode(point, value, rounding);
    if (!items) return items.error();
    return PointWrite{pdu_of(profile, point, *items), written_value(point, *items),
                      label_of(point, *items)};
}

std::vector<Interpretation> interpretations(std::span<const std::uint16_t> registers) {
    std::vector<Interpretation> all;
    for (const Type type : kTypes) {
        if (type == Type::boolean) continue;
        for (const WordOrder order : kOrders) {
            Point point;
            point.type = type;
            point.word_order = order;
            if (type == Type::string) point.length = static_cast<unsigned>(registers.size() * 2);
            const unsigned size = point.count();
            const bool words_matter = size > 1 && type != Type::string;
            const bool turned = order == WordOrder::cdab || order == WordOrder::dcba ||
                                (order == WordOrder::badc && is_byte(type));
            if (size == 0 || size > registers.size() || (turned && !words_matter)) continue;
            Interpretation made{type, order, {}};
            for (std::size_t i = 0; i + size <= registers.size(); i += size) {
                const auto value = decode(point, registers.subspan(i, size));
                made.values.push_back(value ? to_string(*value) : "");
            }
            all.push_back(std::move(made));
        }
    }
    return all;
}

}  // namespace panelgate::points
