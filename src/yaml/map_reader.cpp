#include "panelgate/yaml/map_reader.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "encoding.hpp"
#include "hints.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

namespace {

std::string join(std::span<const std::string_view> words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
        text += words[i];
    }
    return text;
}

std::string shown(const Node& node) {
    if (node.kind == Node::Kind::scalar) return quote(node.scalar);
    if (node.kind == Node::Kind::sequence) return "a list";
    return node.kind == Node::Kind::map ? "a map" : "nothing";
}

std::string such_as(std::string_view example) {
    return example.empty() ? "" : " such as " + std::string(example);
}

std::string wrong(std::string_view key, std::string_view wanted, const Node& node) {
    const std::string name(key);
    if (node.kind == Node::Kind::null)
        return name + " has no value; it must be " + std::string(wanted);
    return name + " must be " + std::string(wanted) + ", not " + shown(node);
}

std::string list_hint(const Node& node, std::string_view example) {
    if (node.kind == Node::Kind::map) return "; begin each item with '- '";
    if (std::string text = text_hint(node, '['); !text.empty() || !example.empty()) return text;
    std::string_view items = node.scalar;
    if (items == "all" || items == "any") return "; leave it out for all";
    constexpr std::string_view kBrackets = "[](){}<> ";
    items.remove_prefix(std::min(items.find_first_not_of(kBrackets), items.size()));
    items = items.substr(0, items.find_last_not_of(kBrackets) + 1);
    const std::size_t dash = items.find_first_not_of("0123456789");
    if (dash > 0 && dash != items.npos && items[dash] == '-')
        return "; write all numbers, with ',' between, as [1, 2, 3]";
    return "; write [" + std::string(clip(items, 40)) + "], or '- ' before each item";
}

std::string two_values(const Node& node) {
    return quote(node.scalar) + " is two values in { }; put a text that holds a ',' in quotes";
}

/// Adds hours: 1440min (24 h).
std::string limit(Duration duration) {
    const bool hours = duration > 1h && duration % 1h == Duration::zero();
    return format_duration(duration) +
           (hours ? " (" + std::to_string(duration / 1h) + " h)" : std::string());
}

/// +5 (YAML 1.2, 10.3.2)
std::string_view without_plus(std::string_view text) {
    constexpr std::string_view kNumber = ".0123456789";
    const bool plus = text.size() > 1 && text[0] == '+' && kNumber.find(text[1]) != text.npos;
    return plus ? text.substr(1) : text;
}

bool has_leading_zero(std::string_view text) {
    return text.size() > 1 && text[0] == '0' && text[1] >= '0' && text[1] <= '9';
}

}  // namespace

MapReader::MapReader(const Node& node, Problems& problems, std::string what,
                     std::string_view example)
    : node_(&node), problems_(&problems), what_(std::move(what)) {
    if (node.kind == Node::Kind::map) return;
    const bool twice = node.items.size() == 1 && node.items[0].kind == Node::Kind::map;
    problems.add(node.mark, what_ + " must be a map of keys" + such_as(example) + ", not " +
                                shown(node) + (twice ? "; one '-' or [ is too many" : "") +
                                blank_hint(node.scalar));
}

const Node* MapReader::find(std::string_view key) {
    known_.emplace_back(key);
    return node_->find(key);
}

bool MapReader::has(std::string_view key) { return find(key) != nullptr; }

bool MapReader::require(std::string_view key) {
    if (has(key)) return true;
    if (is_mistyped(key)) {
        excused_.emplace_back(key);
        return false;
    }
    // A node that is no map has been reported already.
    if (node_->kind == Node::Kind::map) problems_->add(node_->mark, needs(key));
    return false;
}

std::string MapReader::needs(std::string_view key) const {
    return what_ + " needs '" + std::string(key) + '\'';
}

const Node* MapReader::scalar(std::string_view key, std::string_view wanted) {
    const Node* node = find(key);
    if (node == nullptr) return nullptr;
    if (node->kind == Node::Kind::scalar) return node;
    problem(key, wrong(key, wanted, *node));
    return nullptr;
}

std::optional<std::string> MapReader::text(std::string_view key) {
    const Node* node = scalar(key, "a text");
    if (node == nullptr) return std::nullopt;
    if (node->scalar.empty() || node->comma) {
        problem(key, node->comma ? two_values(*node) : std::string(key) + " must not be empty");
        return std::nullopt;
    }
    return node->scalar;
}

std::optional<std::string> MapReader::required_text(std::string_view key) {
    if (!require(key)) return std::nullopt;
    return text(key);
}

std::optional<std::int64_t> MapReader::integer(std::string_view key, std::int64_t min,
                                               std::int64_t max) {
    if (!has(key)) return std::nullopt;
    const std::string most = std::to_string(max);
    const std::string wanted =
        min == max ? most : "a whole number from " + std::to_string(min) + " to " + most;
    const Node* node = scalar(key, wanted);
    if (node == nullptr) return std::nullopt;
    const auto value = node->is_text() ? std::nullopt : parse_integer(without_plus(node->scalar));
    if (value && *value >= min && *value <= max) return value;
    std::string why;
    if (node->is_text() && parse_integer(node->scalar))
        why = " in quotes; write " + node->scalar + " without";
    if (has_leading_zero(node->scalar)) why = " (no leading zeros)";
    if (why.empty() && !value) why = number_hint(node->scalar, true);
    problem(key, wrong(key, wanted, *node) + why);
    return std::nullopt;
}

std::optional<std::int64_t> MapReader::required_integer(std::string_view key, std::int64_t min,
                                                        std::int64_t max) {
    if (!require(key)) return std::nullopt;
    return integer(key, min, max);
}

std::optional<double> MapReader::number(std::string_view key) {
    const Node* node = scalar(key, "a number");
    if (node == nullptr) return std::nullopt;
    const std::string_view typed = without_plus(node->scalar);
    const auto value = parse_number(typed);
    const std::size_t sign = typed.starts_with('-') ? 1 : 0;
    const bool zeros = has_leading_zero(typed.substr(sign));
    if (value && !zeros && !node->is_text()) return value;
    const std::string why =
        zeros             ? " (no leading zeros)"
        : node->is_text() ? " in quotes" + (value ? "; write " + node->scalar + " without" : "")
                          : number_hint(node->scalar, false);
    problem(key, wrong(key, "a number", *node) + why);
    return std::nullopt;
}

std::optional<double> MapReader::share(std::string_view key) {
    const auto value = number(key);
    if (!value || (*value >= 0 && *value <= 1)) return value;
    problem(key, std::string(key) + " must be a share from 0 to 1, such as 0.1 for 10 %");
    return std::nullopt;
}

std::optional<bool> MapReader::boolean(std::string_view key) {
    const Node* node = scalar(key, "true or false");
    if (node == nullptr) return std::nullopt;
    constexpr std::array<std::string_view, 3> kTrue{"true", "True", "TRUE"};
    constexpr std::array<std::string_view, 3> kFalse{"false", "False", "FALSE"};
    const bool plain = !node->is_text();
    if (plain && std::ranges::find(kTrue, node->scalar) != kTrue.end()) return true;
    if (plain && std::ranges::find(kFalse, node->scalar) != kFalse.end()) return false;
    problem(key, wrong(key, "true or false", *node) + boolean_hint(*node));
    return std::nullopt;
}

std::optional<Duration> MapReader::duration(std::string_view key, Duration min, Duration max) {
    const Node* node = scalar(key, "a duration such as 300ms");
    if (node == nullptr) return std::nullopt;
    const auto value = parse_duration(node->scalar);
    if (!value) {
        problem(key, wrong(key, "a duration such as 300ms", *node) + duration_hint(node->scalar));
        return std::nullopt;
    }
    if (*value >= min && *value <= max) return value;
    const std::string wanted = "from " + format_duration(min) + " to " + limit(max);
    problem(key, wrong(key, wanted, *node));
    return std::nullopt;
}

std::optional<std::size_t> MapReader::choice_index(std::string_view key,
                                                   std::span<const std::string_view> words,
                                                   const Hint& hint) {
    if (!has(key)) return std::nullopt;
    const Node* node = scalar(key, join(words));
    if (node == nullptr) return std::nullopt;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == node->scalar) return i;
    }
    const std::string near = nearest(node->scalar, words);
    problem(key, wrong(key, join(words), *node) +
                     (near.empty() ? "" : "; did you mean '" + near + "'?") +
                     (hint ? hint(node->scalar) : ""));
    return std::nullopt;
}

bool MapReader::is_word(std::string_view key, std::string_view word) {
    const Node* node = find(key);
    return node != nullptr && node->kind == Node::Kind::scalar && node->scalar == word;
}

const Node* MapReader::child(std::string_view key) {
    const Node* node = find(key);
    return node == nullptr || node->kind == Node::Kind::null ? nullptr : node;
}

const Node* MapReader::map(std::string_view key, std::string_view example) {
    const Node* node = child(key);
    parents_.emplace_back(key);
    if (node == nullptr || node->kind == Node::Kind::map) return node;
    const std::string text = text_hint(*node, '{') + none_hint(key, example, *node);
    const bool is_list = node->kind == Node::Kind::sequence && !node->items.empty() &&
                         std::ranges::all_of(node->items, [](const Node& item) {
                             return item.kind == Node::Kind::map;
                         });
    problem(key, wrong(key, "a map of keys" + such_as(example), *node) +
                     (is_list ? "; remove the '-' (or the [ ]) around its keys" : "") +
                     (text.empty() ? blank_hint(node->scalar) : text));
    return nullptr;
}

const Node* MapReader::sequence(std::string_view key, std::string_view example) {
    const Node* node = child(key);
    parents_.emplace_back(key);
    if (node == nullptr || node->kind == Node::Kind::sequence) return node;
    problem(key, wrong(key, "a list" + such_as(example), *node) + list_hint(*node, example));
    return nullptr;
}

std::span<const Node> MapReader::entries(std::string_view key, std::string_view example,
                                         std::size_t most) {
    const Node* list = sequence(key, example);
    if (list == nullptr) return {};
    if (most == kAnyNumber || list->items.size() <= most) return list->items;
    problem(key, "at most " + std::to_string(most) + ' ' + std::string(key) + ", not " +
                     std::to_string(list->items.size()));
    return {};
}

std::vector<const Node*> MapReader::scalars(std::string_view key, std::string_view example) {
    std::vector<const Node*> all;
    const Node* list = sequence(key);
    if (list == nullptr) return all;
    for (const Node& item : list->items) {
        if (item.kind == Node::Kind::scalar) {
            all.push_back(&item);
        } else {
            problems_->add(item.mark, std::string(key) + " is a list of words, such as " +
                                          std::string(example));
        }
    }
    return all;
}

std::vector<const Node*> MapReader::items(std::string_view key, std::string_view example,
                                          std::string_view any) {
    refuse_empty(key, "list at least one, or leave it out for " + std::string(any));
    const Node* list = child(key);
    if (list != nullptr && list->kind == Node::Kind::sequence && list->items.empty())
        problem(key,
                std::string(key) + " must list at least one; leave it out for " + std::string(any));
    return scalars(key, example);
}

void MapReader::refuse_empty(std::string_view key, std::string_view instead) {
    not_empty_.emplace_back(key, instead);
}

Mark MapReader::mark(std::string_view key) const {
    const Node* value = node_->find(key);
    return value == nullptr ? node_->mark : value->mark;
}

void MapReader::problem(std::string_view key, std::string message) {
    if (const Node* value = node_->find(key)) message += origin_hint(*value, message);
    problems_->add(mark(key), std::move(message));
}

}  // namespace panelgate::yaml
