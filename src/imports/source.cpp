#include "source.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "panelgate/base/text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::imports {

std::optional<std::string> text_itself(const std::string& text) { return text; }

std::optional<double> number_of(const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool whole = !text.empty() && *end == '\0' && std::isfinite(value);
    return whole ? std::optional(value) : std::nullopt;
}

std::optional<std::int64_t> integer_of(const std::string& text) {
    if (text.starts_with("0x")) return to_number<std::uint32_t>(text.substr(2), 16);
    return to_number<std::int32_t>(text);
}

std::optional<Duration> duration_of(const std::string& typed) {
    constexpr double kMost = 1e16;  // ns
    static const std::map<std::string_view, Duration> kUnits{
        {"h", 3600s}, {"m", 60s}, {"s", 1s}, {"", 1s}, {"ms", 1ms}, {"us", 1us}, {"ns", 1ns}};
    if (typed.empty()) return std::nullopt;
    double sum = 0;
    std::string_view text = typed;
    while (!text.empty()) {
        double count = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count,
                                                  std::chars_format::fixed);
        if (error != std::errc() || !std::isfinite(count) || count < 0) return std::nullopt;
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        const std::string_view word = text.substr(0, text.find_first_of("0123456789."));
        const auto known = kUnits.find(word);
        if (known == kUnits.end()) return std::nullopt;
        sum += count * static_cast<double>(known->second.count());
        text.remove_prefix(word.size());
    }
    return Duration(static_cast<std::int64_t>(std::min(sum, kMost)));
}

Source::Source(const yaml::Node& node, std::string kind, Draft& draft, std::string_view name_key)
    : node_(node),
      kind_(std::move(kind)),
      draft_(draft),
      name_(guess(name_key, text_itself).value_or("")) {
    if (name_.empty()) name_ = kind_;
    if (node.kind != yaml::Node::Kind::map) fail("its keys are not in this file");
}

void Source::refuse(std::string_view key) {
    const yaml::Node* const found = node_.find(key);
    if (found == nullptr) return;
    const bool is_scalar = found->kind == yaml::Node::Kind::scalar;
    fail(std::string(key) + (is_scalar ? " '" + found->scalar + '\'' : " has no plain value"));
}

std::string Source::needed(std::string_view key) {
    const std::string value = text(key);
    if (value.empty()) fail("it has no " + std::string(key));
    return value;
}

std::vector<const yaml::Node*> Source::list(std::string_view key) {
    std::vector<const yaml::Node*> items;
    used_.emplace(key);
    const yaml::Node* const found = node_.find(key);
    if (found == nullptr) return items;
    if (found->kind != yaml::Node::Kind::sequence) return {found};
    for (const yaml::Node& item : found->items) items.push_back(&item);
    return items;
}

void Source::fail(const std::string& fault) {
    if (fault_.empty()) fault_ = fault;
}

bool Source::finish() {
    if (!fault_.empty()) draft_.note(line(), name_ + ": " + fault_);
    for (const yaml::Entry& entry : node_.entries)
        if (fault_.empty() && !used_.contains(entry.key))
            draft_.left_over(entry.value.mark.line, kind_, name_, entry.key);
    return fault_.empty();
}

std::string serial_map(Source& in, std::string_view baud, std::string_view data_bits,
                       std::string_view stop_bits, bool ascii) {
    const std::string parity = in.text("parity", "N");
    if (parity != "N" && parity != "E" && parity != "O") in.fail("parity '" + parity + '\'');
    return "{baud: " + std::to_string(in.get(baud, integer_of, 9600)) +
           ", data_bits: " + std::to_string(in.get(data_bits, integer_of, 8)) + ", parity: " +
           (parity == "E"   ? "even"
            : parity == "O" ? "odd"
                            : "none") +
           ", stop_bits: " + std::to_string(in.get(stop_bits, integer_of, 1)) +
           (ascii ? ", mode: ascii}" : "}");
}

std::map<std::string, std::string> waits_of(std::optional<Duration> timeout,
                                            std::optional<Duration> gap,
                                            std::optional<Duration> connect) {
    std::map<std::string, std::string> waits;
    std::string timing;
    if (timeout) timing = "response_timeout: " + yaml::format_duration(*timeout);
    if (gap.value_or(0s) > 0s)
        timing += (timing.empty() ? "" : ", ") + ("station_gap: " + yaml::format_duration(*gap));
    if (!timing.empty()) waits["timing"] = '{' + timing + '}';
    if (connect.value_or(0s) > 0s) waits["connect_pause"] = yaml::format_duration(*connect);
    return waits;
}

}  // namespace panelgate::imports
