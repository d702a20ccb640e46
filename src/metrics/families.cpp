#include "families.hpp"

#include <prometheus/text_serializer.h>

#include <sstream>
#include <vector>

namespace panelgate::metrics {

using prometheus::ClientMetric;
using prometheus::MetricType;

void Families::push_back(prometheus::MetricFamily family) {
    if (ended_ || family.metric.empty()) return;
    std::vector<prometheus::MetricFamily> one;
    one.push_back(std::move(family));
    std::ostringstream text;
    prometheus::TextSerializer{}.Serialize(text, one);
    ended_ = !take_(text.view());
}

Family::Family(std::string name, std::string help, MetricType type) {
    family_.name = std::move(name);
    family_.help = std::move(help);
    family_.type = type;
}

ClientMetric& Family::add(Labels labels) {
    ClientMetric& metric = family_.metric.emplace_back();
    metric.label = std::move(labels);
    return metric;
}

void Family::counter(Labels labels, double value) { add(std::move(labels)).counter.value = value; }

void Family::gauge(Labels labels, double value) { add(std::move(labels)).gauge.value = value; }

void Family::histogram(Labels labels, const Histogram& histogram) {
    ClientMetric::Histogram& out = add(std::move(labels)).histogram;
    for (std::size_t i = 0; i < Histogram::kBounds.size(); ++i) {
        out.sample_count += histogram.counts[i];
        out.bucket.push_back({out.sample_count, Histogram::kBounds[i]});
    }
    out.sample_count += histogram.counts.back();
    out.sample_sum = histogram.sum;
}

Family make_counter(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Counter};
}

Family make_gauge(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Gauge};
}

Family make_histogram(std::string name, std::string help) {
    return {std::move(name), std::move(help), MetricType::Histogram};
}

}  // namespace panelgate::metrics
