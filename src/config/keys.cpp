#include "keys.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "hints.hpp"
#include "panelgate/config/setting.hpp"
#include "table.hpp"

namespace panelgate::config {

std::string list_text(std::vector<std::string> words) {
    std::ranges::sort(words);
    std::string text;
    for (const std::string& one : words) text += (text.empty() ? "" : ", ") + one;
    return words.empty() ? "" : '[' + text + ']';
}

std::vector<std::string_view> Table::names() const {
    std::vector<std::string_view> all;
    for (const Row& row : rows_) all.push_back(row.shape.path);
    return all;
}

namespace {

/// True if `key` may be beside a neighbour with this value; nullptr: without the neighbour.
bool is_met(const KeyRule& rule, const std::string* value) {
    if (value == nullptr) return rule.absent_will_do;
    return std::ranges::find(rule.words, *value) != rule.words.end();
}

/// False for a faulty value of a key that has words: the fault is told there.
bool is_word(const std::vector<Row>& rows, const std::string& key, const yaml::Node& value) {
    const auto row = std::ranges::find(rows, key, [](const Row& of) { return of.shape.path; });
    if (row == rows.end() || row->shape.kind != KeyShape::Kind::word) return true;
    return std::ranges::find(row->shape.words, value.scalar) != row->shape.words.end();
}

}  // namespace

void Table::check(yaml::MapReader& in) const {
    for (const auto& [rule, why] : conditions_) {
        const yaml::Node* own = in.node().find(rule.key);
        if (own == nullptr) continue;
        const yaml::Node* other = in.node().find(rule.other);
        const bool right = rule.needs ? own->scalar != rule.words.front() || other != nullptr
                                      : is_met(rule, other == nullptr ? nullptr : &other->scalar);
        if (right || (other != nullptr && !is_word(rows_, rule.other, *other))) continue;
        const std::string beside =
            other == nullptr || rule.needs ? "" : ", not with " + rule.other + ": " + other->scalar;
        in.problem(rule.key, rule.key + ' ' + why + beside);
    }
}

void Table::mark_idle(std::span<Setting> shown) const {
    const auto named = [&](std::string_view key) {
        const auto found = std::ranges::find(shown, key, &Setting::key);
        return found == shown.end() ? nullptr : &*found;
    };
    for (const auto& [rule, why] : conditions_) {
        Setting* const key = rule.needs ? nullptr : named(rule.key);
        const Setting* const other = key == nullptr ? nullptr : named(rule.other);
        if (other != nullptr && !is_met(rule, &other->value)) key->applies = false;
    }
}

KeyShape shape_of(std::string_view key, Kind kind, std::string_view text) {
    KeyShape shape{.path = std::string(key), .kind = kind};
    shape.text = text;
    return shape;
}

KeyShape integers(std::string_view key, std::int64_t min, std::int64_t max, std::string_view text) {
    KeyShape shape = shape_of(key, Kind::integer, text);
    shape.min = min;
    shape.max = max;
    return shape;
}

KeyShape durations(std::string_view key, Duration min, Duration max, std::string_view text) {
    KeyShape shape = shape_of(key, Kind::duration, text);
    shape.shortest = min;
    shape.longest = max;
    return shape;
}

KeyShape words_shape(std::string_view key, std::span<const std::string_view> words,
                     std::string_view text) {
    KeyShape shape = shape_of(key, Kind::word, text);
    shape.words.assign(words.begin(), words.end());
    return shape;
}

KeyShape text_shape(std::string_view key, const Form& form, std::string_view text) {
    KeyShape shape = shape_of(key, Kind::text, text);
    shape.pattern = form.pattern;
    shape.may_be_number = form.pattern.empty() || form.may_be_number;
    shape.longest_text = form.longest;
    return shape;
}

namespace {

constexpr std::uint64_t kKiB = 1024;
constexpr std::array<std::pair<std::string_view, std::uint64_t>, 3> kUnits{
    {{"KiB", kKiB}, {"MiB", kKiB* kKiB}, {"GiB", kKiB* kKiB* kKiB}}};

std::optional<std::uint64_t> parse_size(std::string_view text) {
    for (const auto& [name, bytes] : kUnits) {
        if (!text.ends_with(name)) continue;
        const auto number = yaml::parse_integer(text.substr(0, text.size() - name.size()));
        constexpr std::int64_t kMost = 1 << 30;
        if (!number || *number < 1 || *number > kMost) return std::nullopt;
        return static_cast<std::uint64_t>(*number) * bytes;
    }
    return std::nullopt;
}

}  // namespace

Form whole_path(const std::string& example) {
    return {"^/.*[^/]$", false, 0, [example](std::string_view typed) -> std::string {
                if (typed.starts_with('/') && !typed.ends_with('/')) return "";
                return "file must be the whole path of a file, such as " + example + ", not " +
                       yaml::quote(typed);
            }};
}

KeyShape size_shape(std::string_view key, std::string_view text) {
    return text_shape(key, {"^[1-9][0-9]*(KiB|MiB|GiB)$"}, text);
}

std::string size_text(std::uint64_t bytes) {
    auto unit = kUnits.front();
    for (const auto& larger : kUnits)
        if (bytes % larger.second == 0 && bytes >= larger.second) unit = larger;
    return std::to_string(bytes / unit.second) + std::string(unit.first);
}

std::optional<std::uint64_t> read_size(Reader& in, std::string_view key, std::uint64_t least,
                                       std::uint64_t most) {
    const auto typed = in.text(key);
    if (!typed) return std::nullopt;
    const auto bytes = parse_size(*typed);
    if (bytes && *bytes >= least && *bytes <= most) return bytes;
    in.problem(key, std::string(key) + " must be a size such as 50MiB (KiB, MiB, GiB), from " +
                        size_text(least) + " to " + size_text(most) + ", not " +
                        yaml::quote(*typed));
    return std::nullopt;
}

KeyShape items_shape(std::string_view key, const Items& items, std::string_view text) {
    KeyShape shape = shape_of(key, Kind::list, text);
    shape.pattern = items.pattern;
    shape.may_be_number = items.pattern.empty() || items.may_be_number;
    shape.holds_integers = items.holds_integers;
    shape.min = items.integers.first;
    shape.max = items.integers.second;
    if (items.any.empty()) return shape;
    shape.fewest = 1;
    shape.may_be_null = false;
    return shape;
}

std::optional<std::string> read_text(Reader& in, std::string_view key, const Form& form) {
    auto typed = in.text(key);
    if (!typed) return typed;
    std::string fault = form.fault ? form.fault(*typed) : "";
    if (form.longest != 0 && typed->size() > form.longest)
        fault =
            std::string(key) + " must have at most " + std::to_string(form.longest) + " characters";
    if (fault.empty()) return typed;
    in.problem(key, std::move(fault));
    return std::nullopt;
}

std::optional<Decimal> read_number(Reader& in, std::string_view key) {
    const auto number = in.number(key);
    if (!number) return std::nullopt;
    return Decimal::parse(in.node().find(key)->scalar).value_or(Decimal(*number));
}

std::optional<double> read_exact(Reader& in, std::string_view key) {
    const auto number = in.number(key);
    if (!number) return number;
    const std::string& written = in.node().find(key)->scalar;
    const auto exact = Decimal::parse(written);
    if (exact && *exact != Decimal(*number))
        in.problem(key, std::string(key) + " has more digits than are reckoned with, " +
                            yaml::quote(written) + "; write " + number_text(*number));
    return number;
}

Items network_items(std::string_view any) {
    return {"[192.168.1.0/24]", any,
            "^([0-9.]+(/" + yaml::integer_pattern(0, 32) + ")?|[0-9A-Fa-f.]*:[0-9A-Fa-f:.]*(/" +
                yaml::integer_pattern(0, 128) + ")?)$"};
}

std::function<std::optional<Network>(Reader&, const yaml::Node&)> read_network(
    std::string_view key) {
    return [key](Reader& in, const yaml::Node& item) -> std::optional<Network> {
        const auto cidr = parse_cidr(item.scalar);
        if (!cidr) {
            in.problems().add(item.mark,
                              std::string(key) + " lists networks such as 192.168.1.0/24, not " +
                                  yaml::quote(item.scalar) + network_hint(item.scalar, key));
            return std::nullopt;
        }
        if (const std::string network = network_of(*cidr); !network.empty())
            in.loading.warn(item.mark, item.scalar + " is all of " + network + "; write that, or " +
                                           cidr->address +
                                           (is_ipv6(cidr->address) ? "/128" : "/32") +
                                           " for one machine");
        return *cidr;
    };
}

}  // namespace panelgate::config
