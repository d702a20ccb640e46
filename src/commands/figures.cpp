#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "overview.hpp"

namespace panelgate::commands {

namespace {

using Labels = std::map<std::string, std::string, std::less<>>;

/// A sample of the text format (exposition format 0.0.4): NAME{LABEL="VALUE",...} NUMBER.
struct Sample {
    std::string_view name;
    Labels labels;
    double value = 0;
};

std::string quoted_value(std::string_view text, std::size_t& at) {
    std::string value;
    for (; at < text.size() && text[at] != '"'; ++at) {
        if (text[at] == '\\' && at + 1 < text.size()) ++at;
        value += text[at];
    }
    return value;
}

/// Where the labels end.
std::size_t read_labels(std::string_view line, std::size_t at, Labels& labels) {
    while (at < line.size() && line[at] != '}') {
        const std::size_t equals = line.find("=\"", at);
        if (equals == line.npos) return line.size();
        const std::string name(line.substr(at, equals - at));
        at = equals + 2;
        labels[name] = quoted_value(line, at);
        ++at;
        if (at < line.size() && line[at] == ',') ++at;
    }
    return at + 1;
}

std::optional<Sample> sample_of(std::string_view line) {
    if (line.empty() || line.front() == '#') return std::nullopt;
    Sample sample;
    std::size_t at = line.find_first_of("{ ");
    if (at == line.npos) return std::nullopt;
    sample.name = line.substr(0, at);
    if (line[at] == '{') at = read_labels(line, at + 1, sample.labels);
    at = line.find_first_not_of(' ', at);
    if (at >= line.size()) return std::nullopt;
    const auto result = std::from_chars(line.data() + at, line.data() + line.size(), sample.value);
    if (result.ec != std::errc()) return std::nullopt;
    return sample;
}

bool is_error(std::string_view outcome) {
    return outcome != "ok" && outcome != "cached" && outcome != "shared";
}

void add(const Sample& sample, Figures& into) {
    if (sample.name == "panelgate_bus_transaction_seconds_sum") into.seconds += sample.value;
    if (sample.name == "panelgate_bus_transaction_seconds_count") into.transactions += sample.value;
    if (sample.name != "panelgate_requests_total") return;
    into.requests += sample.value;
    const auto outcome = sample.labels.find("outcome");
    if (outcome != sample.labels.end() && is_error(outcome->second)) into.errors += sample.value;
}

void add(const Figures& one, Figures& into) {
    into.requests += one.requests;
    into.errors += one.errors;
    into.transactions += one.transactions;
    into.seconds += one.seconds;
}

/// A station whose counters have begun anew counts from zero.
Figures minus(const Figures& now, const Figures& before) {
    const bool is_new = now.requests < before.requests || now.errors < before.errors ||
                        now.transactions < before.transactions || now.seconds < before.seconds;
    if (is_new) return now;
    return {now.requests - before.requests, now.errors - before.errors,
            now.transactions - before.transactions, now.seconds - before.seconds};
}

}  // namespace

AllFigures figures_of(std::string_view metrics) {
    AllFigures all;
    while (!metrics.empty()) {
        const std::size_t end = std::min(metrics.find('\n'), metrics.size());
        const auto sample = sample_of(metrics.substr(0, end));
        metrics.remove_prefix(std::min(end + 1, metrics.size()));
        if (!sample) continue;
        const auto line = sample->labels.find("line");
        const auto station = sample->labels.find("station");
        if (line == sample->labels.end() || station == sample->labels.end()) continue;
        add(*sample, all[{line->second, station->second}]);
        add(*sample, all[{line->second, ""}]);
    }
    return all;
}

AllFigures difference(const AllFigures& now, const AllFigures& before) {
    AllFigures all;
    for (const auto& [place, figures] : now) {
        if (place.second.empty()) continue;  // a line's are the sum of its stations'
        const auto found = before.find(place);
        const Figures since = found == before.end() ? figures : minus(figures, found->second);
        add(since, all[place]);
        add(since, all[{place.first, ""}]);
    }
    return all;
}

}  // namespace panelgate::commands
