#include "panelgate/yaml/map_reader.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "encoding.hpp"
#include "hints.hpp"
#include "panelgate/base/suggest.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::yaml {
namespace {

struct Unit {
    std::string_view name;
    Duration length;
};
constexpr std::array<Unit, 4> kUnits{{{"min", 60s}, {"s", 1s}, {"ms", 1ms}, {"us", 1us}}};

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

std::string wrong(std::string_view key, std::string_view wanted, const Node& node) {
    const std::string name(key);
    if (node.kind == Node::Kind::null)
        return name + " has no value; it must be " + std::string(wanted);
    return name + " must be " + std::string(wanted) + ", not " + shown(node) +
           variable_hint(node.scalar);
}

/// Nobody counts 1440 minutes.
std::string limit(Duration duration) {
    const bool hours = duration > 1h && duration % 1h == Duration::zero();
    return format_duration(duration) +
           (hours ? " (" + std::to_string(duration / 1h) + " h)" : std::string());
}

bool has_leading_zero(std::string_view text) {
    return text.size() > 1 && text[0] == '0' && text[1] >= '0' && text[1] <= '9';
}

}  // namespace

std::optional<std::int64_t> parse_integer(std::string_view text) {
    const std::string_view digits = !text.empty() && text[0] == '-' ? text.substr(1) : text;
    if (digits.empty() || (digits.size() > 1 && digits[0] == '0')) return std::nullopt;
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<Duration> parse_duration(std::string_view text) {
    const std::size_t letters = text.find_first_not_of("0123456789");
    if (letters == std::string_view::npos) return std::nullopt;
    const auto count = parse_integer(text.substr(0, letters));
    const auto unit = std::find_if(kUnits.begin(), kUnits.end(),
                                   [&](const Unit& u) { return u.name == text.substr(letters); });
    constexpr std::int64_t kMost = 1'000'000'000;
    if (!count || unit == kUnits.end() || *count > kMost) return std::nullopt;
    if (*count > Duration::max() / unit->length) return std::nullopt;
    return *count * unit->length;
}

std::string format_duration(Duration duration) {
    if (duration == Duration::zero()) return "0ms";
    for (const Unit& unit : kUnits) {
        if (duration % unit.length == Duration::zero())
            return std::to_string(duration / unit.length) + std::string(unit.name);
    }
    return std::to_string(duration.count()) + "ns";
}

MapReader::MapReader(const Node& node, Problems& problems, std::string what)
    : node_(&node), problems_(&problems), what_(std::move(what)) {
    if (node.kind != Node::Kind::map) {
        problems.add(node.mark, what_ + " must be a map of keys, not " + shown(node) +
                                    blank_hint(node.scalar));
    }
}

const Node* MapReader::find(std::string_view key) {
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
    for (const Entry& entry : node_->entries) {
        if (entry.key == key) return &entry.value;
    }
    return nullptr;
}

bool MapReader::has(std::string_view key) { return find(key) != nullptr; }

bool MapReader::require(std::string_view key) {
    if (has(key)) return true;
    // finish() asks whether this is what was meant.
    const auto was_meant = [&](const Entry& entry) {
        return nearest(entry.key, std::span(&key, 1)) == key ||
               entry.key.starts_with(std::string(key) + ':');
    };
    if (std::ranges::any_of(node_->entries, was_meant)) return false;
    // What is no map at all has been told already.
    if (node_->kind == Node::Kind::map)
        problems_->add(node_->mark, what_ + " needs '" + std::string(key) + '\'');
    return false;
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
    if (node->scalar.empty()) {
        problem(key, std::string(key) + " must not be empty");
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
    const std::string wanted =
        "a whole number from " + std::to_string(min) + " to " + std::to_string(max);
    const Node* node = scalar(key, wanted);
    if (node == nullptr) return std::nullopt;
    const auto value = node->quoted ? std::nullopt : parse_integer(node->scalar);
    if (value && *value >= min && *value <= max) return value;
    std::string why;
    if (node->quoted && parse_integer(node->scalar)) why = " in quotes";
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
    double value = 0;
    const char* end = node->scalar.data() + node->scalar.size();
    const auto [stop, error] = std::from_chars(node->scalar.data(), end, value);
    const bool whole = error == std::errc() && stop == end && std::isfinite(value);
    const std::size_t sign = node->scalar.starts_with('-') ? 1 : 0;
    const bool zeros = has_leading_zero(std::string_view(node->scalar).substr(sign));
    if (whole && !zeros && !node->quoted) return value;
    const std::string why = zeros          ? " (no leading zeros)"
                            : node->quoted ? " in quotes"
                                           : number_hint(node->scalar, false);
    problem(key, wrong(key, "a number", *node) + why);
    return std::nullopt;
}

std::optional<bool> MapReader::boolean(std::string_view key) {
    const Node* node = scalar(key, "true or false");
    if (node == nullptr) return std::nullopt;
    if (!node->quoted && node->scalar == "true") return true;
    if (!node->quoted && node->scalar == "false") return false;
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
                                                   std::span<const std::string_view> words) {
    const Node* node = scalar(key, join(words));
    if (node == nullptr) return std::nullopt;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == node->scalar) return i;
    }
    const std::string near = nearest(node->scalar, words);
    problem(key, wrong(key, join(words), *node) +
                     (near.empty() ? "" : "; did you mean '" + near + "'?"));
    return std::nullopt;
}

const Node* MapReader::child(std::string_view key) {
    const Node* node = find(key);
    return node == nullptr || node->kind == Node::Kind::null ? nullptr : node;
}

const Node* MapReader::map(std::string_view key, std::string_view example) {
    const Node* node = child(key);
    if (node == nullptr || node->kind == Node::Kind::map) return node;
    const std::string such = example.empty() ? "" : " such as " + std::string(example);
    problem(key, wrong(key, "a map of keys" + such, *node) + blank_hint(node->scalar));
    return nullptr;
}

const Node* MapReader::sequence(std::string_view key) {
    const Node* node = child(key);
    if (node == nullptr || node->kind == Node::Kind::sequence) return node;
    const bool is_map = node->kind == Node::Kind::map;
    problem(key, wrong(key, "a list", *node) +
                     (is_map ? "; begin each item with '- '"
                             : "; write [" + std::string(clip(node->scalar, 40)) +
                                   "], or '- ' before each item"));
    return nullptr;
}

Mark MapReader::mark(std::string_view key) const {
    for (const Entry& entry : node_->entries) {
        if (entry.key == key) return entry.value.mark;
    }
    return node_->mark;
}

void MapReader::problem(std::string_view key, std::string message) {
    problems_->add(mark(key), std::move(message));
}

void MapReader::finish() {
    const std::vector<std::string_view> known(known_.begin(), known_.end());
    for (const Entry& entry : node_->entries) {
        if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
        const std::string near = nearest(entry.key, known);
        std::string message = "unknown key " + quote(entry.key) + " in " + what_;
        const std::string blank = blank_hint(entry.key);
        if (!blank.empty()) {
            message += blank;
        } else if (!near.empty()) {
            message += "; did you mean '" + near + "'?";
        } else {
            message += "; known keys are ";
            for (std::size_t i = 0; i < known.size(); ++i)
                message += (i > 0 ? ", " : "") + std::string(known[i]);
        }
        problems_->add(entry.mark, std::move(message));
    }
}

}  // namespace panelgate::yaml
