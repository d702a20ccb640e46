#include <string>
#include <string_view>
#include <utility>

#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::yaml {

KeyShape* MapReader::shape(std::string_view key) {
    Description* description = problems_->description();
    return description == nullptr ? nullptr : description->shape(*node_, key);
}

void MapReader::looks_like(std::string_view key, std::string_view pattern, bool number) {
    KeyShape* told = shape(key);
    if (told == nullptr) return;
    told->pattern = pattern;
    told->may_be_number = number;
}

void MapReader::no_longer(std::string_view key, std::size_t characters) {
    if (KeyShape* told = shape(key)) told->longest_text = characters;
}

void MapReader::keyed_by(std::string_view key, std::string_view pattern) {
    if (KeyShape* told = shape(key)) told->keys = pattern;
}

void MapReader::holds_integers(std::string_view key) {
    if (KeyShape* told = shape(key)) told->holds_integers = true;
}

void MapReader::within(std::string_view key, std::int64_t min, std::int64_t max) {
    KeyShape* told = shape(key);
    if (told == nullptr) return;
    told->min = min;
    told->max = max;
}

void MapReader::never(std::string_view key, double number) {
    if (KeyShape* told = shape(key)) told->never = number;
}

void MapReader::may_be_null(std::string_view key, bool may) {
    if (KeyShape* told = shape(key)) told->may_be_null = may;
}

void MapReader::needed(std::string_view key) {
    if (KeyShape* told = shape(key)) told->required = true;
}

void MapReader::entries(std::string_view key, std::size_t fewest, std::size_t most) {
    KeyShape* told = shape(key);
    if (told == nullptr) return;
    told->fewest = fewest;
    told->most_entries = most;
}

bool MapReader::lacks(std::string_view key, std::string_view word, std::string_view other) {
    if (Description* description = problems_->description())
        description->tell_rule(
            *node_, {{}, std::string(key), std::string(other), {std::string(word)}, true, false});
    const Node* node = find(key);
    return node != nullptr && node->scalar == word && !has(other);
}

void MapReader::belongs(std::string_view key, std::string_view other,
                        std::span<const std::string_view> words, bool absent) {
    if (Description* description = problems_->description())
        description->tell_rule(*node_, {{},
                                        std::string(key),
                                        std::string(other),
                                        {words.begin(), words.end()},
                                        false,
                                        absent});
}

std::optional<double> MapReader::share(std::string_view key) {
    const auto value = number(key);
    if (KeyShape* told = shape(key)) {
        told->least = 0;
        told->most = 1;
    }
    if (!value || (*value >= 0 && *value <= 1)) return value;
    problem(key, std::string(key) + " must be a share from 0 to 1, such as 0.1 for 10 %");
    return std::nullopt;
}

}  // namespace panelgate::yaml
