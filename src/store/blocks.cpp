#include "panelgate/store/blocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace panelgate::store {

namespace {

constexpr std::size_t kFigures = 3;

template <class Number>
void put(std::string& bytes, double value) {
    const auto number = static_cast<Number>(value);
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

template <class Number>
double get(std::string_view bytes, std::size_t index) {
    Number number{};
    std::memcpy(&number, bytes.data() + index * sizeof number, sizeof number);
    return static_cast<double>(number);
}

bool is_short(double value) {
    return std::abs(value) <= std::numeric_limits<float>::max() &&
           static_cast<double>(static_cast<float>(value)) == value;
}

/// The mean of readings has more digits than a reading; float32 is exact enough for a mean if the
/// two readings beside the mean are short.
bool is_short(const Summary& slot) { return is_short(slot.min) && is_short(slot.max); }

template <class Number>
std::string bytes_of(const std::array<Summary, Block::kSlots>& slots) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    std::string bytes;
    for (const Summary& slot : slots)
        for (const double value : {slot.min, slot.max, slot.mean})
            put<Number>(bytes, slot.count == 0 ? none : value);
    return bytes;
}

template <class Number>
Summary slot_of(std::string_view bytes, std::size_t index) {
    const std::size_t at = kFigures * index;
    Summary slot{get<Number>(bytes, at), get<Number>(bytes, at + 1), get<Number>(bytes, at + 2), 1};
    return std::isnan(slot.min) ? Summary() : slot;
}

}  // namespace

void Summary::add(const Summary& other) {
    if (other.count == 0) return;
    if (count == 0) {
        *this = other;
        return;
    }
    const double share =
        static_cast<double>(other.count) / static_cast<double>(count + other.count);
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    mean += (other.mean - mean) * share;
    count += other.count;
}

std::int64_t Block::number_of(WallTime time) {
    return std::chrono::floor<std::chrono::seconds>(time.time_since_epoch()) / kSpan;
}

WallTime Block::begin_of(std::int64_t number) { return WallTime(number * kSpan); }

void Block::add(WallTime time, double value) {
    const auto behind = time - begin_of(number_of(time));
    slots_[static_cast<std::size_t>(std::max<std::int64_t>(behind / kSlot, 0)) % kSlots].add(value);
}

void Block::add(const Block& other) {
    for (std::size_t i = 0; i < kSlots; ++i) slots_[i].add(other.slots_[i]);
}

std::string Block::bytes() const {
    const bool all_short = std::ranges::all_of(
        slots_, [](const Summary& slot) { return slot.count == 0 || is_short(slot); });
    return all_short ? bytes_of<float>(slots_) : bytes_of<double>(slots_);
}

std::optional<Block> Block::parse(std::string_view bytes) {
    constexpr std::size_t kNumbers = kFigures * kSlots;
    if (bytes.size() != kNumbers * sizeof(float) && bytes.size() != kNumbers * sizeof(double))
        return std::nullopt;
    const bool is_short = bytes.size() == kNumbers * sizeof(float);
    Block block;
    for (std::size_t i = 0; i < kSlots; ++i)
        block.slots_[i] = is_short ? slot_of<float>(bytes, i) : slot_of<double>(bytes, i);
    return block;
}

}  // namespace panelgate::store
